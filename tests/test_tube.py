"""A tube of errors before any run: no run leaves it, and it knows what it is not about."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from cells import random_experiment
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from refusals import refused
from scipy.linalg import expm
from seams.degrees import Degrees
from theory_cells import EDGES, GAINS, coupling, experiment

from synctrl import Cell, Coupling, Disturbance, Experiment, Friction, Gains, Member, load_robot
from synctrl.analysis import Tube, dissipation, tube
from synctrl.analysis.jacobian_size import jacobian_sizes, parts_of
from synctrl.analysis.modal_filter import ModalFilter
from synctrl.analysis.replay import replay
from synctrl.control.controller import Controller
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, bead_on_edge, panda_four, planar_four, ur5_payload
from synctrl.tasks.trajectories import FunctionTrajectory, Hold

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


@pytest.mark.parametrize(
    ("kind", "weight", "space"),
    [
        ("pair", "scalar", "joint"),
        ("pair", "moving", "cartesian"),
        ("ring", "constant", "cartesian"),
        ("ring", "moving", "joint"),
        ("all-to-all", "scalar", "cartesian"),
        ("all-to-all", "constant", "joint"),
    ],
)
def test_no_run_leaves_its_tube(kind: str, weight: str, space: str) -> None:
    link = coupling(kind, 2 if kind == "pair" else 3, 2, weight)
    acting = {"disturbances": (PUSH,), "friction": FRICTION}
    sizes, radius = sides(experiment(link, cartesian=space == "cartesian", **acting), speed=8.0)
    assert (sizes <= radius).all()


@pytest.mark.parametrize("weight", ["scalar", "speeds"])
def test_nor_does_one_with_viscous_friction_whether_speeds_are_stated_or_not(weight: str) -> None:
    heavy = Friction(viscous=(1.2, 0.9), coulomb=0.1, smoothing=0.2)
    one = experiment(coupling("ring", 4, 2), friction=heavy)
    sizes, radius = sides(one, speed=6.0 if weight == "speeds" else None)
    assert (sizes <= radius).all()


@pytest.mark.parametrize("leak", [1.5, 4.0])
def test_nor_does_one_with_a_leak_of_the_integrals(leak: float) -> None:
    one = experiment(coupling("ring", 4, 2), replace(GAINS, leak=leak), cartesian=True)
    sizes, radius = sides(one)
    assert (sizes <= radius).all()


@given(seed=st.integers(0, 2**20), space=st.sampled_from(["joint", "cartesian"]))
@settings(max_examples=4)
def test_nor_does_one_of_robots_that_nobody_chose(seed: int, space: str) -> None:
    sizes, radius = sides(random_experiment(seed, space, "ring" if seed % 2 else "chain"))
    assert (sizes <= radius).all()


@pytest.mark.parametrize("cartesian", [False, True], ids=["joint", "cartesian"])
@pytest.mark.parametrize("weight", ["constant", "moving"])
def test_energy_torque_and_kappa_are_at_least_those_of_the_run(weight: str, cartesian: bool) -> None:
    """V(0) and, of pushes alone, D are exact; X and |c J K_r^-1/2| are bounds."""
    one = experiment(coupling("ring", 3, 2, weight), cartesian=cartesian, disturbances=(PUSH,))
    run = replay(one.simulate(DURATION, DT), one)
    found, x = dissipation(run), run.rows
    told = tube(one.cell, one.gains, duration=DURATION, disturbances=one.disturbances)
    assert pytest.approx(found.V0) == told.V0
    assert pytest.approx(found.D) == told.D
    assert found.X <= told.X == pytest.approx(found.X_bound)
    scaled = x.c @ x.J / np.sqrt(run.loop.controller.K_r)[:, None]
    parts = [np.linalg.norm(scaled[:, :, p.start : p.stop], 2, axis=(-2, -1)) for p in told.parts]
    assert (np.stack(parts, axis=-1) <= told.kappa * (1 + 1e-6)).all()
    size = np.sqrt(np.trapezoid(x.r[run.logged] ** 2, run.result.t, axis=0).sum(-1))
    assert (size <= np.linalg.norm(told.kappa, axis=-1) * found.X).all()


@pytest.mark.parametrize("kind", ["viscous", "coulomb"])
def test_friction_of_a_run_is_within_what_was_reckoned_with(kind: str) -> None:
    one = experiment(coupling("ring", 3, 2), friction=Friction(**{kind: 0.6}, smoothing=0.2))
    found = dissipation(one.simulate(DURATION, DT), one)
    assert 0 < found.D <= tube(one.cell, one.gains, duration=DURATION).D


def test_viscous_friction_at_rest_adds_its_share_of_the_damping_to_the_torque() -> None:
    one, gamma = quiet(0.5), 0.3
    rubbed = quiet(0.5, friction=Friction(viscous=gamma * GAINS.K_r))
    assert one.X / (1 - gamma) == pytest.approx(rubbed.X)
    assert pytest.approx(one.D + gamma * rubbed.X) == rubbed.D


@pytest.mark.parametrize("make", [ur5_payload, panda_four])
def test_nor_does_one_in_poses_or_of_redundant_arms(make: Callable[[], Experiment]) -> None:
    one = make()
    run = one.simulate(0.1, 2e-3)
    told = tube(one.cell, one.gains, duration=one.duration, times=run.t)
    assert (told.sizes(run.tracking_error) <= told.radius).all()


@pytest.mark.parametrize("make", [planar_four, ur5_payload, panda_four, bead_on_edge])
def test_no_jacobian_at_any_place_is_larger_than_lengths_of_links_say(make: Callable[[], Experiment]) -> None:
    """With errors of orientations as they come, and points that slide on what an arm carries."""
    one, rng = make(), np.random.default_rng(0)
    cell, K_r = one.cell, Controller(one.cell, one.gains).K_r
    times = np.linspace(0.0, one.duration, 40)
    scale = np.divide(1.0, np.sqrt(K_r), out=np.zeros_like(K_r), where=K_r > 0)[:, None]
    for desired in cell.reference_table(times).desired:
        motion = np.stack((rng.uniform(-np.pi, np.pi, K_r.shape), 0 * K_r))
        task = cell.task.measure(motion, desired)
        angle = float(np.linalg.norm(task.error[0][:, 3:], axis=-1).max()) if cell.m == 6 else 0.0
        sizes, sampled = jacobian_sizes(cell, K_r, times, angle)
        parts = [np.linalg.norm((scale * task.J)[:, part], 2, axis=(-2, -1)) for part in parts_of(cell)]
        assert not sampled and (np.stack(parts, axis=-1) <= sizes * (1 + 1e-9)).all()


# -- what it is made of ------------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**20), kind=st.sampled_from(sorted(EDGES)), leak=st.sampled_from([0.0, 0.7, 1.0]))
@settings(max_examples=12)
def test_modes_are_the_solution_of_the_equation_of_the_errors(seed: int, kind: str, leak: float) -> None:
    """w and E as one linear system, by its matrix exponential; beta lambda = Lambda is among the cases."""
    rng, n = np.random.default_rng(seed), 2 if kind == "pair" else 4
    link = coupling(kind, n, 1)
    L = link.matrix.T @ link.matrix
    Lambda = rng.uniform(0.5, 5.0)
    beta = rng.choice([0.0, rng.uniform(0.1, 5.0), Lambda / np.linalg.eigvalsh(L)[-1]])
    gains = Gains(Lambda=Lambda, beta=beta, K_r=1.0, K_eps=1.0, Gamma=0.1, leak=leak * Lambda)
    modes = ModalFilter.of(Controller(experiment(link, joints=1).cell, gains))
    one = np.eye(n)
    A = np.block([[-Lambda * one - beta * L, -(1 - leak) * Lambda * beta * one], [L, -leak * Lambda * one]])
    step = 4e-3 / Lambda
    times = np.arange(0.0, 12.0 / Lambda, step)
    w, moved, flow = rng.standard_normal((n, 1)), np.vstack([one, 0 * one]), expm(step * A)
    responses = np.empty((len(times), n, n))
    for k in range(len(times)):
        responses[k], moved = moved[:n], flow @ moved
    free = modes.vectors @ modes.free(times, modes.to_modes(w), 0 * w)
    np.testing.assert_allclose(free, responses @ w, atol=1e-9)
    slopes = np.trapezoid(np.gradient(responses @ modes.vectors, step, axis=0) ** 2, times, axis=0).sum(0)
    assert np.sqrt(slopes.max()) == pytest.approx(modes.free_rate_norm()[0], rel=0.05)
    if beta == 0 or leak > 0 or beta * np.linalg.eigvalsh(L)[1] > Lambda:  # else slow modes last longer
        found = np.trapezoid(responses**2, times, axis=0)
        np.testing.assert_allclose(modes.spread(0), found, rtol=0.02, atol=1e-5)


def quiet(
    torque: float = 0.0,
    duration: float = 2.0,
    c: float = 1.0,
    friction: Friction | None = None,
    **changes: ArrayLike,
) -> Tube:
    """The tube of two arms that are known and stand where they should, V(0) = 0."""
    arm, gains = load_robot("planar2r"), replace(GAINS, **changes)
    more = {"theta_hat0": arm.inertial_parameters, "friction": friction}
    stay = [Member(arm, Hold([0.3, 1.0]), name=f"arm {k}", **more) for k in (1, 2)]
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
    one = experiment(coupling("ring", 3, 2), cartesian=True)
    few = {"duration": 1.0, "times": [0.0, 0.5, 1.0]}
    less, more = (tube(one.cell, one.gains, torque, **few) for torque in torques)
    assert less.D <= more.D and less.X <= more.X
    assert (less.radius <= more.radius).all()
    push = Disturbance(0, 2.0, late, late + 0.5)
    assert tube(one.cell, one.gains, torques[0], **few, disturbances=(push,)).D >= less.D


def test_it_is_never_wider_than_the_plain_formula() -> None:
    for kind in EDGES:
        for cartesian in (False, True):
            link = coupling(kind, 2 if kind == "pair" else 4, 2)
            one = experiment(link, cartesian=cartesian)
            told = tube(one.cell, one.gains, 0.3, times=np.linspace(0, 1, 11))
            assert (np.linalg.norm(told.radius, axis=-1).max(0) <= told.plain * np.sqrt(1 + cartesian)).all()
            assert (told.largest.max(-1) <= told.plain).all()


def test_viscous_friction_needs_a_bound_of_speeds_where_errors_do_not_give_one() -> None:
    slow, heavy = Friction(viscous=0.5), Friction(viscous=1.1 * float(GAINS.K_r))
    for one in (
        experiment(coupling("pair", 2, 2), cartesian=True, friction=slow),
        experiment(coupling("pair", 2, 2, "moving"), friction=slow),
        experiment(coupling("pair", 2, 2), friction=heavy),
    ):
        with refused(InputError, "speed"):
            tube(one.cell, one.gains, duration=0.1, times=[0.0])
        assert tube(one.cell, one.gains, duration=0.1, speed=1.0, times=[0.0]).D > 0


def test_friction_in_the_regressor_is_no_torque_outside_the_model() -> None:
    knowing, not_knowing = (a460_pair(adapt_friction=adapt) for adapt in (True, False))
    assert tube(knowing.cell, knowing.gains, times=[0.0, 1.0]).D == 0
    assert tube(not_knowing.cell, not_knowing.gains, times=[0.0, 1.0]).D > 1


# -- what it is not about ----------------------------------------------------------------------------------


def test_what_it_cannot_be_told_is_refused() -> None:
    one = experiment(coupling("pair", 2, 2))
    cell, gains = one.cell, one.gains
    with refused(InputError, "cell"):
        tube(gains, gains)
    with refused(InputError, "torque", found=-1.0):
        tube(cell, gains, -1.0)
    with refused(InputError, "torque"):
        tube(cell, gains, [1.0, 2.0, 3.0])
    with refused(InputError, "speed", found=-2.0):
        tube(cell, gains, speed=-2.0)
    with refused(InputError, "duration"):
        tube(cell, gains, duration=0.0)
    with refused(InputError, "kappa"):
        tube(cell, gains, kappa=1.0)
    with refused(InputError, "kappa", found=-1.0):
        tube(cell, gains, kappa=-np.ones((2, 2)))
    for times in ([], [0.0, 6.0], [-1.0], [1.0, 0.5]):
        with refused(InputError, "times"):
            tube(cell, gains, times=times)


def test_errors_of_other_robots_have_no_lengths_in_a_tube() -> None:
    one = experiment(coupling("pair", 2, 2))
    told = tube(one.cell, one.gains, times=[0.0])
    np.testing.assert_array_equal(told.sizes([[3.0, 4.0], [0.0, -1.0]]), [[3.0, 4.0], [0.0, 1.0]])
    for e in (np.zeros(2), np.zeros((3, 2)), np.zeros((5, 2, 3)), None):
        with refused(InputError, "e"):
            told.sizes(e)


def test_an_error_of_parameters_that_is_never_learned_is_refused_and_one_that_is_none_is_not() -> None:
    one = experiment(coupling("pair", 2, 2))
    still = replace(GAINS, Gamma=0.0)
    with refused(InputError, "Gamma"):
        tube(one.cell, still)
    known = experiment(coupling("pair", 2, 2), known=1.0)
    assert tube(known.cell, still, times=[0.0]).energy["parameter"] == pytest.approx(0.0)


def test_a_desired_velocity_that_jumps_is_refused() -> None:
    arm = load_robot("planar2r")
    sharp = FunctionTrajectory(
        lambda t: np.abs(t - 1) * np.ones(2),
        lambda t: np.sign(t - 1 + 1e-12) * np.ones(2),
        lambda t: np.zeros(2),
        breaks=(1.0,),
    )
    cell = Cell([Member(arm, sharp, np.ones(2), name=f"arm {k}") for k in (1, 2)], Coupling.pair())
    with refused(InputError, "arm 1, trajectory"):
        tube(cell, GAINS)
    assert tube(cell, GAINS, duration=0.9).closes


def test_a_desired_position_that_jumps_is_refused() -> None:
    arm, rest = load_robot("planar2r"), lambda t: np.zeros(2)
    step = FunctionTrajectory(lambda t: (t >= 1.0) * np.array([0.0, 0.3]), rest, rest, breaks=(1.0,))
    cell = Cell([Member(arm, step, name=f"arm {k}") for k in (1, 2)], Coupling.pair())
    with refused(InputError, "arm 1, trajectory", found=0.3):
        tube(cell, GAINS)
    late = Cell(cell.members, cell.coupling, clocks=np.array([0.0, 0.7]))
    with refused(InputError, "arm 2, trajectory", found=0.3):
        tube(late, GAINS, duration=0.9)


def test_of_a_space_of_ones_own_kappa_is_sampled_and_it_says_so() -> None:
    one = experiment(coupling("pair", 2, 2))
    moved = {"trajectory": Hold(np.rad2deg([0.4, 1.1])), "q0": [0.4, 1.1]}
    members = [replace(member, **moved) for member in one.cell.members]
    cell = Cell(members, one.cell.coupling, Degrees())
    told = tube(cell, one.gains, times=[0.0, 1.0])
    assert told.sampled and not told.closes and "sampled" in str(told)
    exact = np.rad2deg(1.0) / np.sqrt(float(GAINS.K_r))
    assert told.kappa == pytest.approx(exact)


def test_a_kappa_that_is_given_takes_the_place_of_the_lengths_and_is_named_as_assumed() -> None:
    one = experiment(coupling("pair", 2, 2), cartesian=True)
    own = tube(one.cell, one.gains, duration=1.0)
    half = tube(one.cell, one.gains, duration=1.0, kappa=own.kappa / 2)
    assert "kappa is as given" in half.assumed and "kappa is as given" not in own.assumed
    assert (half.largest < own.largest).all()
    assert tube(one.cell, one.gains, duration=1.0, kappa=own.kappa).radius == pytest.approx(own.radius)


def test_it_says_in_words_and_numbers_what_it_found() -> None:
    one = experiment(coupling("pair", 2, 2), cartesian=True)
    told = tube(one.cell, one.gains, duration=1.0)
    data = json.loads(json.dumps(told.as_dict()))
    assert (
        data["closes"] is told.closes and data["V0"] == told.V0 and data["largest"] == told.largest.tolist()
    )
    text = str(told)
    for name, r in zip(told.names, told.largest[:, 0], strict=True):
        assert f"{name}: |e(x, y)| <= {r:.4g} m" in text
    assert "as long as J^-1 exists" in text
    assert "if no other torque acts, and weights" in text and repr(told) == text
