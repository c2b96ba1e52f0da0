"""Gains for robots of different kinds, and the controller as somebody with an own loop calls it."""

from __future__ import annotations

import json
import pickle
from copy import copy, deepcopy
from dataclasses import replace

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Controller,
    Coupling,
    Experiment,
    Gains,
    Hold,
    Member,
    Result,
    load_robot,
)
from synctrl.analysis import side_by_side
from synctrl.analysis.convergence import identify
from synctrl.analysis.gain_condition import gain_condition
from synctrl.analysis.lyapunov import lyapunov
from synctrl.coupling.weights import Weights
from synctrl.errors import InputError, SimulationError
from synctrl.paper.fairness import taken_apart
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant
from synctrl.sweep.variations import with_gain, with_scaled_gain

GAINS = {"Lambda": 4.0, "beta": 4.0, "K_eps": 2.0}
ROWS = ([20.0, 15.0], [30.0, 40.0, 20.0])
RATES = (np.full(20, 0.1), np.full(30, 0.2))


def mixed_cell() -> Cell:
    """An arm with two joints and one with three, in the plane."""
    two, three = load_robot("planar2r"), load_robot("a460")
    members = []
    for robot, q in ((two, [0.4, 1.2]), (three, [0.2, 1.2, -1.5])):
        target = robot.tip_position(q)[:2] + 0.01
        members.append(Member(robot, Hold(target), q, theta_hat0=robot.inertial_parameters))
    return Cell(members, Coupling.pair(), CartesianSpace("xy"))


def mixed(K_r=ROWS, Gamma=RATES, **options) -> Experiment:
    return Experiment(mixed_cell(), Gains(**GAINS, K_r=K_r, Gamma=Gamma), 0.05, **options)


# -- rows of different lengths ----------------------------------------------------------------------------


def test_a_row_for_each_robot_is_the_same_as_padded_rows() -> None:
    ragged = mixed().simulate(0.02)
    K_r = np.array([[*ROWS[0], 7.0], ROWS[1]])
    Gamma = np.array([[*RATES[0], *[9.0] * 10], RATES[1]])
    padded = mixed(K_r, Gamma).simulate(0.02)
    for name in ("q", "tau", "theta_hat"):
        np.testing.assert_array_equal(getattr(ragged, name), getattr(padded, name))


def test_rows_are_stored_compared_and_told_as_they_are() -> None:
    gains = mixed().gains
    assert gains == mixed([list(row) for row in ROWS], [row.tolist() for row in RATES]).gains
    assert gains != mixed(([20.0, 15.1], ROWS[1])).gains
    assert gains.as_dict()["K_r"] == [list(row) for row in ROWS]
    assert json.loads(json.dumps(gains.as_dict()))["Gamma"][0] == [0.1] * 20
    for again in (copy(gains), deepcopy(gains), pickle.loads(pickle.dumps(gains)), replace(gains)):
        assert again == gains
    assert gains.replace(K_r=gains.K_r).independent().as_dict()["K_r"] == gains.as_dict()["K_r"]


def test_rows_are_saved_with_a_result(tmp_path) -> None:
    result = mixed().simulate(0.01)
    assert Result.load(result.save(tmp_path / "run.npz")).info["gains"]["K_r"] == [list(row) for row in ROWS]


@pytest.mark.parametrize("factor", [2.0, 2, np.float64(2.0), np.int64(2)])
def test_a_sweep_scales_rows_and_replaces_them(factor) -> None:
    scaled = with_scaled_gain(mixed(), factor, "K_r").gains
    assert scaled.as_dict()["K_r"] == [[40.0, 30.0], [60.0, 80.0, 40.0]]
    assert with_scaled_gain(mixed(), factor, "Gamma").gains.Gamma[1][0] == 0.4
    assert with_gain(mixed(), 3.0, "K_r").gains.as_dict()["K_r"] == 3.0


def test_what_makes_use_of_gains_takes_rows() -> None:
    experiment = mixed(reference_acceleration="paper")
    result = experiment.simulate(0.01)
    assert lyapunov(result).V.shape == result.t.shape
    assert gain_condition(result).K_r_min in (15.0, 20.0)
    assert len(identify(result)) == 2
    apart = taken_apart(experiment)
    assert len(side_by_side(apart, duration=0.01).rows) == len(apart) > 2**3


def test_damping_in_task_space_has_as_many_entries_for_every_robot() -> None:
    mixed(([20.0, 15.0], [30.0, 40.0]), k_r_space="task")
    with refused(InputError, "K_r"):
        mixed(k_r_space="task")


@pytest.mark.parametrize(
    ("K_r", "subject", "data"),
    [
        (([1.0], [1.0, 2.0, 3.0]), "K_r", {"found": (1, 3)}),
        (([1.0, 2.0, 3.0], [1.0, 2.0]), "K_r", {"found": (3, 2)}),
        (([1.0, 2.0],), "K_r", {"found": (1, 2)}),
        (([1.0, 2.0], [1.0, 2.0, 3.0], [1.0]), "K_r", {"found": (2, 3, 1)}),
        (([1.0, 2.0], [1.0, np.nan, 3.0]), "K_r: row 2", {}),
        (([1.0, 2.0], [1.0, 0.0, 3.0]), "K_r", {"found": 0.0}),
        (([1.0, "2"], [1.0, 0.0, 3.0]), "K_r: row 1", {}),
        (([[1.0], [2.0]], [[1.0], [0.0], [3.0]]), "K_r", {}),
    ],
)
def test_rows_that_do_not_fit_the_robots_are_refused(K_r, subject: str, data: dict) -> None:
    with refused(InputError, subject, **data):
        mixed(K_r)


@pytest.mark.parametrize("name", ["Lambda", "beta", "K_eps"])
def test_gains_that_are_the_same_for_all_robots_take_no_rows(name: str) -> None:
    with refused(InputError, name):
        Gains(**{**GAINS, "K_r": 1.0, "Gamma": 0.1, name: ([1.0], [1.0, 2.0])})


# -- evaluate, called from outside ------------------------------------------------------------------------


def arguments(controller: Controller) -> dict:
    cell = controller.cell
    return {
        "reference": cell.references(np.zeros(1))[0],
        "motion": np.stack((cell.q0, cell.v0)),
        "z": cell.theta_hat0,
        "integral": np.zeros((cell.coupling.pairs, cell.m)),
    }


CONTROLLER = Controller(small_cell(3), SMALL_GAINS)


def test_evaluate_is_what_a_simulation_computes() -> None:
    given = arguments(CONTROLLER)
    checked, unchecked = CONTROLLER.evaluate(**given), CONTROLLER.signals(**given)
    for name in ("tau", "z_dot", "v_ref", "epsilon", "u"):
        np.testing.assert_array_equal(getattr(checked, name), getattr(unchecked, name))
    lists = {k: v.tolist() for k, v in given.items() if k != "reference"}
    np.testing.assert_array_equal(CONTROLLER.evaluate(given["reference"], **lists).tau, checked.tau)


@pytest.mark.parametrize("name", ["motion", "z", "integral"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_evaluate_refuses_what_is_not_finite(name: str, bad: float) -> None:
    given = arguments(CONTROLLER)
    given[name] = given[name].copy()
    given[name].ravel()[-1] = bad
    with refused(InputError, name):
        CONTROLLER.evaluate(**given)


@pytest.mark.parametrize("name", ["motion", "z", "integral"])
@pytest.mark.parametrize("wrong", [lambda a: a[..., :-1], lambda a: a[:1], lambda a: a[None], lambda a: "x"])
def test_evaluate_refuses_other_sizes(name: str, wrong) -> None:
    given = arguments(CONTROLLER)
    given[name] = wrong(given[name])
    with refused(InputError, name):
        CONTROLLER.evaluate(**given)


@pytest.mark.parametrize(
    ("change", "subject"),
    [
        (lambda r: None, "reference"),
        (lambda r: replace(r, desired=r.desired[:2]), "reference: xd, xd' and xd''"),
        (lambda r: replace(r, desired=np.nan * r.desired), "reference: xd, xd' and xd''"),
        (lambda r: replace(r, weights=Weights(*(w[:2] for w in r.weights))), "reference: c"),
        (
            lambda r: replace(r, weights=r.weights._replace(c_inv=np.full_like(r.c, np.inf))),
            "reference: c^-1",
        ),
    ],
)
def test_evaluate_refuses_what_is_no_reference(change, subject: str) -> None:
    given = arguments(CONTROLLER)
    with refused(InputError, subject):
        CONTROLLER.evaluate(**{**given, "reference": change(given["reference"])})


def test_a_run_that_breaks_down_is_still_named_by_the_guard() -> None:
    wild = SMALL_GAINS.replace(K_r=1e9)
    with pytest.raises(SimulationError):
        Experiment(small_cell(), wild, 0.5).simulate(dt=1e-2)


def test_a_subclass_with_an_evaluate_of_its_own_is_the_one_that_runs() -> None:
    class Limp(Controller):
        def evaluate(self, *state):
            signals = super().evaluate(*state)
            return replace(signals, tau=0 * signals.tau)

    cell = small_cell()
    loop = ClosedLoop(Limp(cell, SMALL_GAINS), Plant(cell))
    found = loop.evaluate(cell.references(np.zeros(1))[0], loop.initial_state(), np.zeros((2, 2)))[1]
    assert (found.tau == 0).all()


def test_gains_of_many_parameters_are_shown_in_one_short_line_with_all_their_names():
    long, ragged = np.arange(1.0, 601.0), [np.arange(1.0, 601.0), np.arange(1.0, 301.0)]
    for Gamma in (long, np.tile(long, (9, 1)), ragged):
        text = repr(Gains(**GAINS, K_r=2.0, Gamma=Gamma))
        assert len(text) < 400 and "\n" not in text
        assert all(f"{name}=" in text for name in ("Lambda", "beta", "K_r", "K_eps", "Gamma"))
        assert "1., " in text and ", 600." in text and "..." in text


def test_few_gains_are_shown_whole():
    assert "K_r=[1., 2., 3.]" in repr(Gains(**GAINS, K_r=(1, 2, 3)))
    assert "Gamma=None" in repr(Gains(**GAINS, K_r=1))
