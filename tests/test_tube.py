"""A tube of errors before any run: no run leaves it, and it knows what it is not about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cells import random_experiment
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from theory_cells import EDGES, GAINS, coupling, experiment

from synctrl import Cell, Coupling, Disturbance, Experiment, Friction, Gains, Member, load_robot
from synctrl.analysis import Tube, tube
from synctrl.analysis.error_modes import ErrorModes
from synctrl.control.controller import Controller
from synctrl.tasks.trajectories import Hold

DURATION, DT = 0.2, 2.5e-3
PUSH = Disturbance(robot=0, torque=4.0, start=0.05, stop=0.2)
FRICTION = Friction(viscous=0.3, coulomb=0.5, smoothing=0.2)


def sides(one: Experiment, speed: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of the errors of a run, and the radius of its tube at the same instants, (T, n, parts)."""
    run = one.simulate(DURATION, DT)
    told = tube(
        one.cell, one.gains, duration=DURATION, disturbances=one.disturbances, speed=speed, times=run.t
    )
    if speed is not None:
        assert np.abs(run.v).max() < speed
    return told.sizes(run.tracking_error), told.radius


# -- runs --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cartesian", [False, True], ids=["joint", "cartesian"])
@pytest.mark.parametrize("weight", ["scalar", "constant", "moving"])
@pytest.mark.parametrize("kind", ["pair", "ring", "all-to-all"])
def test_no_run_leaves_its_tube(kind: str, weight: str, cartesian: bool) -> None:
    n = 2 if kind == "pair" else 3
    one = experiment(
        coupling(kind, n, 2, weight), cartesian=cartesian, disturbances=(PUSH,), friction=FRICTION
    )
    sizes, radius = sides(one, speed=8.0)
    assert (sizes <= radius).all()


@pytest.mark.parametrize("leak", [0.0, 1.5, 4.0])
def test_nor_does_one_with_a_leak_of_the_integrals(leak: float) -> None:
    one = experiment(coupling("ring", 4, 2), replace(GAINS, leak=leak), cartesian=True)
    sizes, radius = sides(one)
    assert (sizes <= radius).all()


@given(seed=st.integers(0, 2**20), space=st.sampled_from(["joint", "cartesian"]))
@settings(max_examples=4)
def test_nor_does_one_of_robots_that_nobody_chose(seed: int, space: str) -> None:
    sizes, radius = sides(random_experiment(seed, space, "ring" if seed % 2 else "chain"))
    assert (sizes <= radius).all()


# -- what it is made of ------------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**20), kind=st.sampled_from(sorted(EDGES)), leak=st.sampled_from([0.0, 0.7, 1.0]))
@settings(max_examples=15)
def test_modes_are_the_solution_of_the_equation_of_the_errors(seed: int, kind: str, leak: float) -> None:
    """w and E as one linear system, by its matrix exponential; beta lambda = Lambda is among the cases."""
    rng, n = np.random.default_rng(seed), 2 if kind == "pair" else 4
    link = coupling(kind, n, 1)
    L = link.matrix.T @ link.matrix
    Lambda = rng.uniform(0.5, 5.0)
    beta = rng.choice([0.0, rng.uniform(0.1, 5.0), Lambda / np.linalg.eigvalsh(L)[-1]])
    gains = Gains(Lambda=Lambda, beta=beta, K_r=1.0, K_eps=1.0, Gamma=0.1, leak=leak * Lambda)
    modes = ErrorModes.of(Controller(experiment(link, joints=1).cell, gains))
    one = np.eye(n)
    A = np.block([[-Lambda * one - beta * L, -(1 - leak) * Lambda * beta * one], [L, -leak * Lambda * one]])
    step = 4e-3 / Lambda
    times = np.arange(0.0, 12.0 / Lambda, step)
    w, moved, flow = rng.standard_normal((n, 1)), np.vstack([one, 0 * one]), expm(step * A)
    responses = np.empty((len(times), n, n))
    for k in range(len(times)):
        responses[k], moved = moved[:n], flow @ moved
    assert modes.free(w, times) == pytest.approx(responses @ w, abs=1e-9)
    if beta == 0 or leak > 0 or beta * np.linalg.eigvalsh(L)[1] > Lambda:  # else slow modes last longer
        assert modes.spread(0) == pytest.approx(np.trapezoid(responses**2, times, axis=0), rel=0.02, abs=1e-5)


def quiet(torque: float = 0.0, duration: float = 2.0, c: float = 1.0, **changes) -> Tube:
    """The tube of two arms that are known and stand where they should, V(0) = 0."""
    arm, gains = load_robot("planar2r"), replace(GAINS, **changes)
    stay = [
        Member(arm, Hold([0.3, 1.0]), theta_hat0=arm.inertial_parameters, name=f"arm {k}") for k in (1, 2)
    ]
    return tube(Cell(stay, Coupling.pair((c, -c))), gains, torque, duration)


def test_from_a_start_without_energy_it_grows_with_torque_and_with_the_root_of_time() -> None:
    assert quiet().largest == pytest.approx(0.0, abs=1e-9)
    one = quiet(0.5)
    assert pytest.approx(one.D) == one.X
    assert pytest.approx(np.sqrt(2.0 * 4 * 0.5**2 / GAINS.K_r)) == one.D
    assert quiet(1.5).radius == pytest.approx(3 * one.radius)
    assert quiet(0.5, 8.0).largest == pytest.approx(2 * one.largest)


def test_damping_makes_it_narrower_by_as_much_and_scaled_weights_do_not_change_it() -> None:
    one = quiet(0.5)
    assert quiet(0.5, K_r=4 * GAINS.K_r).radius == pytest.approx(one.radius / 4)
    assert quiet(0.5, Lambda=9 * GAINS.Lambda, beta=9 * GAINS.beta).largest == pytest.approx(one.largest / 3)
    scaled = quiet(0.5, c=5.0)  # a pair's S has the same eigenvalues whatever c is
    assert scaled.radius == pytest.approx(one.radius)
    assert scaled.kappa == pytest.approx(5 * one.kappa)


@given(torques=st.tuples(st.floats(0, 5), st.floats(0, 5)).map(sorted), late=st.floats(0, 3))
@settings(max_examples=4)
def test_more_torque_outside_the_model_never_makes_it_narrower(torques: list[float], late: float) -> None:
    one, n = experiment(coupling("ring", 3, 2), cartesian=True), 3
    less, more = (tube(one.cell, one.gains, torque, 1.0) for torque in torques)
    assert less.D <= more.D and less.X <= more.X
    assert (less.radius <= more.radius).all()
    push = Disturbance(0, 2.0, late, late + 0.5)
    assert tube(one.cell, one.gains, torques[0], 1.0, disturbances=(push,)).D >= less.D
    assert less.radius.shape == (len(less.t), n, 1)


def test_it_is_never_wider_than_the_plain_formula() -> None:
    for kind in EDGES:
        for cartesian in (False, True):
            link = coupling(kind, 2 if kind == "pair" else 4, 2)
            told = tube(*(lambda one: (one.cell, one.gains))(experiment(link, cartesian=cartesian)), 0.3)
            assert (np.linalg.norm(told.radius, axis=-1).max(0) <= told.plain * np.sqrt(1 + cartesian)).all()
            assert (told.largest.max(-1) <= told.plain).all()
