"""Torque that is cut off: what bounds keep estimates within, and what a guard costs the proof."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engines import ENGINE
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Experiment, Payload
from synctrl.analysis.certify import certify
from synctrl.control.adaptation import Ball, Composite, Gradient, Guarded, Leakage, Natural, Seen, bounded
from synctrl.control.adaptation.gradient import metric_of
from synctrl.control.adaptation.metric import distance
from synctrl.errors import InputError, SaturationWarning
from synctrl.experiments import a460_pair, planar_four, ur5_payload
from synctrl.simulation.result import LAYOUT

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scripts"))

from anti_windup import CELLS, below_gravity, plain, pushed_above_limits, run, with_limits

pytestmark = [
    pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning"),  # torque is meant to be cut
    pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning"),  # estimates that run away ask for less
]
SEEDS = st.integers(0, 2**32 - 1)
CELL = a460_pair(friction=False).cell
P = CELL.theta.shape[1]
ROWS = np.random.default_rng(0).standard_normal((P, P))
INSIDE = {
    "gradient": Gradient(0.3),
    "gradient of some entries": Gradient(np.where(np.arange(P) % 3, 0.4, 0.0)),
    "matrix": Gradient((0.02 * ROWS @ ROWS.T)[None]),
    "leakage": Leakage(0.3, 0.5),
    "ball": Ball(0.3, 0.5),
}


def seen(rng: np.random.Generator, size: float) -> Seen:
    """Random signals, with a regressor of some size and a gradient that belongs to it."""
    q, v, v_ref, a_ref, s_q = rng.standard_normal((5, 2, 3))
    Y = size * rng.standard_normal((2, 3, P))
    return Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, s_q, s_q)


def moved(bound, rng: np.random.Generator) -> np.ndarray:
    """A state that a rate can lead to."""
    z = bound.start()
    return bound.settle(z + 0.3 * bound.metric.raised(rng.standard_normal(z.shape)))


def reach(experiment: Experiment, theta_hat: np.ndarray) -> np.ndarray:
    """Distances of estimates, (T, n, P), from the first ones, (T, n), sqrt(N·m)."""
    metric = metric_of(experiment.gains.Gamma, experiment.cell)
    return np.array([distance(metric, now - experiment.cell.theta_hat0) for now in theta_hat])


# -- the guard --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", INSIDE)
@given(seed=SEEDS, size=st.sampled_from([1.0, 10.0, 1e4]))
def test_the_storage_changes_by_minus_s_y_tilde_and_the_named_powers(name, seed, size):
    rng = np.random.default_rng(seed)
    bound, theta, now = Guarded(INSIDE[name], 10.0).bind(CELL), CELL.theta, seen(rng, size)
    z = moved(bound, rng)
    powers = bound.powers(z, theta, now)
    model = float(np.sum(now.gradient * (theta - bound.estimate(z))))
    found = bound.storage_rate(z, bound.rate(z, now), theta)
    scale = np.abs(now.gradient).sum() * np.abs(theta - z).max()
    assert found == pytest.approx(-model + sum(powers.values()), rel=1e-9, abs=1e-9 * scale)
    assert (powers["guard"] != 0) == (bound.share(now) < 1).any()


@pytest.mark.parametrize("size", [0.1, 1e3])
def test_no_robot_learns_faster_than_its_guard_allows(size):
    """Fastest for M_0, and so for every larger mass matrix."""
    now = seen(np.random.default_rng(1), size)
    p = Guarded(Gradient(0.3), 20.0).bind(CELL).share(now)
    for robot, q, Y, share in zip(CELL.robots, CELL.q0, now.regressor, p, strict=True):
        squares = np.linalg.eigvals(np.linalg.solve(robot.mass_matrix(q), 0.3 * Y @ Y.T)).real
        assert share * squares.max() <= 20.0**2
        assert share == 1 or share * squares.sum() == pytest.approx(20.0**2)


def test_a_guard_that_need_not_act_leaves_the_adaptation_as_it_is_bit_for_bit():
    rng = np.random.default_rng(2)
    for adaptation in INSIDE.values():
        inner, bound, now = adaptation.bind(CELL), Guarded(adaptation, 1e9).bind(CELL), seen(rng, 1.0)
        z = moved(bound, rng)
        np.testing.assert_array_equal(bound.rate(z, now), inner.rate(z, now))
        assert bound.powers(z, CELL.theta, now) == {**inner.powers(z, CELL.theta, now), "guard": 0.0}


@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_both_engines_guard_alike(make, options):
    experiment = make(adaptation=Guarded(Gradient(0.3), 3.0))
    runs = [experiment.simulate(0.1, engine=engine, **options) for engine in ("pinocchio", "compiled")]
    free = make(adaptation=Gradient(0.3)).simulate(0.1, **options)
    assert np.abs(runs[0].theta_hat - free.theta_hat).max() > 1e-6
    for name in LAYOUT:
        expected, found = (getattr(each, name) for each in runs)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_the_balance_of_v_closes_while_the_guard_acts():
    experiment = a460_pair(friction=False, adaptation=Guarded(Gradient(0.3), 3.0))
    certificate = certify(experiment.simulate(0.1, dt=2e-4))
    assert certificate.closes
    assert np.abs(certificate.lyapunov.power["guard"]).max() > certificate.lyapunov.rounding.max()


@pytest.mark.parametrize(
    ("subject", "make"),
    [
        ("rate", lambda: Guarded(Gradient(0.3), 0.0)),
        ("rate", lambda: Guarded(Gradient(0.3), -1.0)),
        ("adaptation", lambda: Guarded(0.3)),
        ("adaptation", lambda: Guarded(Natural(0.1)).bind(CELL)),
        ("adaptation", lambda: Guarded(Composite(0.3, 2.0, 20.0)).bind(CELL)),
        ("Gamma", lambda: Guarded(Gradient(np.ones(7))).bind(CELL)),
        ("cell", lambda: bounded(a460_pair(), 0.3)),
        ("carried", lambda: bounded(CELL, 0.3, [0.1, 0.2, 0.3])),
        ("carried", lambda: bounded(CELL, 0.3, np.nan)),
    ],
)
def test_what_cannot_be_guarded_is_refused(subject, make):
    with refused(InputError, subject):
        make()


# -- bounds by default ------------------------------------------------------------------------------------


def test_the_default_ball_holds_the_truth_within_what_its_layer_allows():
    for experiment in (planar_four(), a460_pair(), ur5_payload()):
        cell, Gamma = experiment.cell, experiment.gains.Gamma
        radius = bounded(cell, Gamma).adaptation.radius
        error = distance(metric_of(Gamma, cell), cell.theta - cell.theta_hat0)
        assert (error < 0.9 * radius).all()


def test_the_default_ball_has_room_for_payloads_and_for_robots_that_learn_nothing():
    loaded = replace(a460_pair(), payloads=[Payload(1, 5.0)], saturate=True).closed_loop()
    free = replace(a460_pair(), saturate=True).closed_loop()
    radii = [loop.controller.adaptation_settings["adaptation"]["radius"] for loop in (loaded, free)]
    assert radii[0][0] == radii[1][0]
    assert radii[0][1] > radii[1][1]
    assert (bounded(CELL, 0.0).adaptation.radius > 0).all()


def test_an_adaptation_that_is_given_is_taken_as_it_is():
    adaptation = Gradient(0.3)
    experiment = a460_pair(adaptation=adaptation)
    loop = replace(experiment, saturate=True).closed_loop()
    assert loop.controller.adaptation_settings == adaptation.as_dict()


def test_a_ball_leaves_states_inside_it_as_they_are_to_the_last_bit():
    far = 30.0 * np.random.default_rng(4).standard_normal((2, P))
    bound = Ball(0.3, 1e4).bind(CELL)
    np.testing.assert_array_equal(bound.settle(CELL.theta_hat0 + far), CELL.theta_hat0 + far)


@pytest.mark.parametrize("options", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_a_run_that_is_never_cut_is_the_plain_law_bit_for_bit(make, engine, options):
    cell = make().cell
    strong = with_limits(make(), np.full((cell.n, cell.nv), 1e6))
    found, expected = (each.simulate(0.1, engine=engine, **options) for each in (strong, make()))
    assert found.info["adaptation"]["name"] == "Guarded"
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


@pytest.mark.parametrize("name", CELLS)
def test_estimates_stay_bounded_whatever_is_cut_off(name):
    experiment = CELLS[name]()
    result = run(experiment, 0.8, ENGINE)
    radius = np.array(result.info["adaptation"]["adaptation"]["radius"])
    assert (result.outputs["applied_torque"] != result.tau).any()
    assert (reach(experiment, result.theta_hat) <= radius * (1 + 1e-9)).all()


def test_estimates_drift_without_bounds_where_there_is_less_torque_than_gravity_takes():
    experiment = below_gravity()
    runs = [run(each, 2.0, ENGINE) for each in (plain(experiment), experiment)]
    drift = [reach(experiment, each.theta_hat)[-1] for each in runs]
    assert (drift[0] > 2 * drift[1]).any()


def test_a_leak_keeps_integrals_within_what_epsilon_was_over_the_leak_and_without_one_they_grow():
    leak, experiment = 5.0, below_gravity()
    leaking = replace(experiment, gains=experiment.gains.replace(leak=leak))
    runs = [run(each, 2.0, ENGINE) for each in (leaking, experiment)]
    held, free = (np.abs(each.sync_integral).max(axis=(1, 2)) for each in runs)
    allowed, much = (np.maximum.accumulate(np.abs(r.sync_error).max(axis=(1, 2))) / leak for r in runs)
    assert all((each.outputs["applied_torque"] != each.tau).any() for each in runs)
    assert (held <= allowed * (1 + 1e-3)).all()
    assert free[-1] > 2 * much[-1]


def test_after_a_push_above_its_limits_an_arm_comes_back_only_with_bounds():
    experiment = pushed_above_limits()
    short = replace(experiment.disturbances[0], start=0.1, stop=0.6)
    experiment = replace(experiment, disturbances=[short])
    plainly, held = (run(each, 2.5, ENGINE) for each in (plain(experiment), experiment))
    last = [
        np.flatnonzero((each.outputs["applied_torque"] != each.tau).any(axis=(1, 2)))[-1]
        for each in (plainly, held)
    ]
    assert held.t[last[1]] < 2.5
    assert plainly.t[last[0]] == plainly.t[-1]
    assert np.abs(held.tracking_error[-1]).max() < 0.1 < np.abs(plainly.tracking_error[-1]).max()


def test_the_warning_says_what_bounds_estimates_or_how_they_could_be_bounded():
    for experiment, words in ((below_gravity(), "Ball"), (plain(below_gravity()), "Guarded(Ball(")):
        with pytest.warns(SaturationWarning) as caught:
            experiment.simulate(0.4)
        (warning,) = [each for each in caught if each.category is SaturationWarning]
        assert words in str(warning.message)


def test_a_certificate_says_what_is_lost_when_torque_is_cut_off():
    certificate = certify(below_gravity().simulate(0.4))
    assert not certificate.certified
    (found,) = [text for text in certificate.outside if "torque that saturation takes away" in text]
    assert "no adaptation" in found
