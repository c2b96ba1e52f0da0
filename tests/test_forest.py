"""Robots evaluated together move as they do alone: forests, and the regressors of a cell."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot, seeds
from theory_cells import planar_arm

from synctrl import CartesianSpace, Cell, Coupling, Cubic, Gains, Member, Robot, load_robot, simulate
from synctrl.analysis.certify import certify
from synctrl.robots.base_parameters import BaseParameters
from synctrl.robots.forest import LARGE, SMALL, Forest, as_selection, forests
from synctrl.robots.friction import Friction
from synctrl.robots.parameters import FrictionParameters, FullParameters, planar_two_link_parameters
from synctrl.robots.regressors import _groups, make_regressors
from synctrl.simulation.plant import pinocchio_dynamics
from synctrl.tasks.measurement import Tips

NAMES = ("planar2r", "a460", "ur5", "panda", "kinova")


def several(robot: Robot, seed: int, count: int = 3) -> list[Robot]:
    """A robot on several bases, in turn controlled at different frames and with different rotors."""
    rng = np.random.default_rng(seed)
    frames = [frame.name for frame in robot.model.frames if frame.name != "universe"]
    made = []
    for k in range(count):
        placed = robot.placed(rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3))
        moved = placed.with_tip(frames[rng.integers(len(frames))] if k else robot.tip)
        made.append(moved.with_armature(rng.uniform(0, 1)))
    return made


def motion(seed: int, count: int, n: int, nv: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2, 2, (count, n, nv))


def assert_moves_as_its_robots(robots: list[Robot], seed: int) -> None:
    forest, nv = Forest(robots), robots[0].nv
    q, v, v_ref, a_ref = motion(seed, 4, len(robots), nv)
    (p, p_dot), J, J_dot = forest.tips(q, v)
    _, R, J_t, J_t_dot = forest.poses(q, v)
    Y, v_dot = forest.regressor(q, v, v_ref, a_ref), forest.acceleration(q, v, a_ref)
    M, C_w, tau = (
        forest.mass_matrices(q),
        forest.coriolis_torque(q, v, a_ref),
        forest.torque(q, v, v_ref, a_ref),
    )
    for i, robot in enumerate(robots):
        pose, J_i, J_i_dot = robot.tip_kinematics(q[i], v[i])
        C, g = robot.coriolis_matrix(q[i], v[i]), robot.gravity(q[i])
        pairs = [
            (p[i], pose.translation), (p_dot[i], J_i[:3] @ v[i]), (R[i], pose.rotation), (J[i], J_i[:3]),
            (J_t[i], J_i), (J_dot[i], J_i_dot[:3]), (J_t_dot[i], J_i_dot),
            (Y[i], robot.regressor(q[i], v[i], v_ref[i], a_ref[i])),
            (v_dot[i], robot.forward_dynamics(q[i], v[i], a_ref[i])), (M[i], robot.mass_matrix(q[i])),
            (C_w[i], C @ a_ref[i]), (tau[i], M[i] @ a_ref[i] + C @ v_ref[i] + g),
        ]  # fmt: skip
        for found, expected in pairs:
            size = max(1.0, float(np.abs(expected).max()))
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * size)


@pytest.mark.parametrize("name", NAMES)
@given(seed=seeds)
@settings(max_examples=8)
def test_a_forest_of_a_ready_robot_moves_as_its_robots_do_alone(name: str, seed: int) -> None:
    assert_moves_as_its_robots(several(load_robot(name), seed), seed)


@given(seeds, st.integers(1, 6), st.booleans(), st.integers(1, 4))
@settings(max_examples=30)
def test_a_forest_of_random_robots_moves_as_they_do_alone(seed, joints, chain, count) -> None:
    assert_moves_as_its_robots(several(random_robot(seed, joints, chain), seed, count), seed)


def mixed(seed: int) -> list[Robot]:
    """Robots of different sizes; equal ones stand beside each other and apart."""
    return [
        robot
        for name, count in (("planar2r", 2), ("ur5", 3), ("planar2r", 1), ("a460", 2))
        for robot in several(load_robot(name), seed, count)
    ]


@given(seeds, st.integers(1, 20))
@settings(max_examples=10)
def test_forests_have_every_robot_once_and_each_its_own_in_order(seed: int, joints: int) -> None:
    robots = mixed(seed)
    found = [(np.arange(len(robots))[rows].tolist(), forest) for rows, forest in forests(robots, joints)]
    assert sorted(i for rows, _ in found for i in rows) == list(range(len(robots)))
    for rows, forest in found:
        assert rows == sorted(rows)
        assert forest.robots == tuple(robots[i] for i in rows)
        assert {robot.nv for robot in forest.robots} == {forest.nv}
        assert forest.n == 1 or forest.n * forest.nv <= joints


@given(st.lists(st.integers(0, 30), min_size=1, unique=True).map(sorted))
def test_rows_are_a_slice_exactly_where_they_are_evenly_spaced(indices: list[int]) -> None:
    rows = as_selection(indices)
    assert np.arange(31)[rows].tolist() == indices
    assert isinstance(rows, slice) == (len(set(np.diff(indices).tolist())) <= 1)


@pytest.mark.parametrize("order", ["ABAB", "ABBA", "BABA", "AABBA", "ABCABC", "CBACABB"])
@pytest.mark.parametrize("joints", [SMALL, LARGE])
def test_there_are_as_many_forests_in_any_order(order: str, joints: int) -> None:
    arms = dict(zip("ABC", map(load_robot, ("planar2r", "ur5", "panda")), strict=True))
    mixed, sorted_by_kind = (
        len(forests([arms[kind] for kind in row], joints)) for row in (order * 9, sorted(order * 9))
    )
    assert mixed == sorted_by_kind


@pytest.mark.parametrize("kind", ["full", "base", "friction of base parameters"])
def test_there_are_as_many_groups_of_regressors_in_any_order(kind: str) -> None:
    one, other = (parameters_of(kind, load_robot(name)) for name in ("planar2r", "ur5"))
    counts = [
        len(list(_groups(row, [6] * 8)))
        for row in ([one, other] * 4, [one] * 4 + [other] * 4, [other, one, one, other] * 2)
    ]
    assert counts == [2, 2, 2]


@given(st.permutations(range(8)), seeds)
@settings(max_examples=10)
def test_robots_in_another_order_move_the_same(order: list[int], seed: int) -> None:
    robots = mixed(7)
    shuffled, nv = [robots[i] for i in order], [robots[i].nv for i in order]
    rows = motion(seed, 4, len(robots), 6) * (np.arange(6) < [[robot.nv] for robot in robots])
    tips = [Tips(some).poses(*x[:2]) for some, x in ((robots, rows), (shuffled, rows[:, order]))]
    for k, (one, other) in enumerate(zip(*tips, strict=True)):
        np.testing.assert_allclose(other, one[:, order] if k == 0 else one[order], rtol=0, atol=1e-12)
    v_dot = [pinocchio_dynamics(some)(*x[:3]) for some, x in ((robots, rows), (shuffled, rows[:, order]))]
    np.testing.assert_allclose(v_dot[1], v_dot[0][order], rtol=1e-12, atol=1e-12)
    parameters = [FullParameters(robot) for robot in robots]
    Y = make_regressors(parameters, [robot.nv for robot in robots])(*rows)
    Y_shuffled = make_regressors([parameters[i] for i in order], nv)(*rows[:, order])
    np.testing.assert_allclose(Y_shuffled, Y[order], rtol=0, atol=1e-12 * np.abs(Y).max())


def test_robots_under_different_gravity_are_apart() -> None:
    robot = load_robot("a460")
    light = Robot(robot._weightless, robot.tip)
    assert [forest.n for _, forest in forests([robot, robot, light, robot])] == [3, 1]


def test_cost_per_robot_is_bounded_by_bounded_forests() -> None:
    found = forests([load_robot("planar2r")] * 200)
    assert max(forest.n * forest.nv for _, forest in found) <= LARGE < 400


def parameters_of(kind: str, robot: Robot):
    made: dict[str, Callable] = {
        "full": FullParameters,
        "base": BaseParameters,
        "theta 50": lambda _: planar_two_link_parameters(load_robot("planar2r")),  # arms that do not lean
        "friction": lambda robot: FrictionParameters(robot, Friction(1.0, 0.5), armature=True),
        "friction of base parameters": lambda robot: FrictionParameters(
            robot, Friction(1.0, 0.5, 0.1 * robot.nv), BaseParameters(robot)
        ),
    }
    return made[kind](robot)


@pytest.mark.parametrize(
    "kinds",
    [
        ("full",) * 8,
        ("base",) * 8,
        ("theta 50", "theta 50", *("full",) * 6),
        ("friction",) * 8,
        ("friction of base parameters",) * 8,
        ("theta 50", "full", "friction", "base", "friction", "full", "base", "friction"),
    ],
)
def test_regressors_of_a_cell_are_those_of_its_robots(kinds: tuple[str, ...]) -> None:
    robots = mixed(7)
    parameters = [parameters_of(kind, robot) for kind, robot in zip(kinds, robots, strict=True)]
    n, nv, P = len(robots), max(r.nv for r in robots), max(p.theta.size for p in parameters)
    rows = motion(3, 4, n, nv)
    Y = make_regressors(parameters, [robot.nv for robot in robots])(*rows)
    for i, (robot, p) in enumerate(zip(robots, parameters, strict=True)):
        k, size = robot.nv, p.theta.size
        Y_i = p.regressor(*rows[:, i, :k])
        expected = np.zeros((nv, P))
        expected[:k, :size] = Y_i
        scale = 1 + np.abs(expected).max()
        np.testing.assert_allclose(Y[i], expected, rtol=0, atol=1e-12 * scale)


def test_parameters_with_a_regressor_of_their_own_are_asked() -> None:
    class Doubled(FullParameters):
        def regressor(self, *motion: np.ndarray) -> np.ndarray:
            return 2 * super().regressor(*motion)

    robot, rows = load_robot("planar2r"), motion(0, 4, 2, 2)
    plain, doubled = (make_regressors([kind(robot)] * 2, [2, 2])(*rows) for kind in (FullParameters, Doubled))
    np.testing.assert_array_equal(doubled, 2 * plain)


def test_tips_of_different_robots_are_padded_with_zeros() -> None:
    robots = mixed(5)
    q, v = motion(6, 2, len(robots), 6)
    tips = Tips(robots)
    (p, p_dot), J, J_dot = tips.positions(q, v)
    _, R, J_t, J_t_dot = tips.poses(q, v)
    for i, robot in enumerate(robots):
        k = robot.nv
        pose, J_i, J_i_dot = robot.tip_kinematics(q[i, :k], v[i, :k])
        np.testing.assert_allclose(p[i], pose.translation, atol=1e-13)
        np.testing.assert_allclose(R[i], pose.rotation, atol=1e-13)
        np.testing.assert_allclose(p_dot[i], J_i[:3] @ v[i, :k], atol=1e-12)
        for found, expected in ((J, J_i[:3]), (J_t, J_i), (J_dot, J_i_dot[:3]), (J_t_dot, J_i_dot)):
            np.testing.assert_allclose(found[i, :, :k], expected, atol=1e-12)
            np.testing.assert_array_equal(found[i, :, k:], 0.0)


@pytest.mark.parametrize("order", [(0, 2, 1, 3), (3, 1, 0, 2)])
def test_a_run_with_robots_in_another_order_is_the_same_run(order: tuple[int, ...]) -> None:
    rng, members = np.random.default_rng(0), []
    for joints in (2, 2, 3, 3):
        arm, q0 = planar_arm(joints, gravity=3.0), np.array([0.4, 1.1, 0.7])[:joints] + rng.uniform(-0.1, 0.1)
        start = arm.tip_position(q0)[:2]
        members.append(Member(arm, Cubic(start, start + 0.05, 1.0), q0, friction=Friction(0.1, 0.2)))
    gains, runs = Gains(4.0, 3.0, 2.0, 1.5, 0.02), []
    for some in (members, [members[i] for i in order]):
        cell = Cell(some, Coupling.complete(4), CartesianSpace("xy"))
        runs.append(simulate(cell, gains, 0.03))
    one, other = runs
    for name in ("q", "v", "tau", "tracking_error", "theta_hat"):
        expected = getattr(one, name)[:, list(order)]
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(other, name), expected, rtol=0, atol=1e-10 * size)
    V, V_other = (certify(run).lyapunov.V for run in runs)
    np.testing.assert_allclose(V_other, V, rtol=1e-9)
