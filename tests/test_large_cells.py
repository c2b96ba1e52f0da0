"""Cells of many robots: asked at once and one after another they are the same cell, and cost little each."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot
from refusals import refused

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Cubic,
    ExponentialApproach,
    FunctionTrajectory,
    Hold,
    Member,
    PoseSpace,
    PoseTrajectory,
    load_robot,
)
from synctrl.coupling import reachability
from synctrl.coupling.reachability import check_motions, check_reachable
from synctrl.errors import NonFiniteError, RobotError, SimulationError, TrajectoryError, UnreachableError
from synctrl.robots.mechanism import mechanism
from synctrl.robots.tips import tip_places
from synctrl.tasks.derivatives import find_misfit_in_motion, spread_windows
from synctrl.tasks.following import follow
from synctrl.tasks.together import EXACT

PLANAR, UR5, PANDA = load_robot("planar2r"), load_robot("ur5"), load_robot("panda")
ROBOTS = {"planar2r": PLANAR, "ur5": UR5, "panda": PANDA}
Q0 = {
    "planar2r": [0.4, 1.2],
    "ur5": [0.0, -1.3, 1.9, -2.1, -1.5, 0.1],
    "panda": [0, -0.8, 0, -2.3, 0, 1.6, 0.8],
}
TIMES = np.linspace(0, 2, 101)
seeds = st.integers(0, 10_000)


def lines(rng: np.random.Generator) -> list:
    """Lines of every kind, some of which keep time with each other, and motions of other kinds among them."""
    ends = rng.uniform(-0.1, 0.5, (12, 2, 2))
    found = [Cubic(*pair, 1.0 + k % 2) for k, pair in enumerate(ends[:5])]
    found += [ExponentialApproach(*pair, 0.5 + k % 2) for k, pair in enumerate(ends[5:9])]
    found += [Hold(pair[0]) for pair in ends[9:]]
    found += [Circle([0.3, 0.2], 0.1, 2.0)]
    found += [FunctionTrajectory(lambda t: [0.1 * t, 0.2], lambda t: [0.1, 0.0], lambda t: [0.0, 0.0])]
    return [found[k] for k in rng.permutation(len(found))]


def cell_of(trajectories, clocks=0.0) -> Cell:
    members = [Member(PLANAR, each, Q0["planar2r"]) for each in trajectories]
    return Cell(members, Coupling.signed_ring(len(members)), CartesianSpace("xy"), clocks=clocks)


# -- desired motions ---------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(seeds, st.booleans())
def test_motions_asked_together_are_bit_by_bit_those_asked_one_by_one(seed, apart):
    rng = np.random.default_rng(seed)
    trajectories = lines(rng)
    clocks = 0.01 * np.arange(len(trajectories)) if apart else 0.25
    cell, times = cell_of(trajectories, clocks), rng.uniform(0, 2, 17)
    expected = np.stack([cell.told(i, times) for i in range(cell.n)], axis=2)
    np.testing.assert_array_equal(cell.told_together(range(cell.n), times), expected)
    np.testing.assert_array_equal(cell.told_together([3, 1, 7], times), expected[:, :, [3, 1, 7]])
    np.testing.assert_array_equal(cell.reference_table(times).desired, expected.swapaxes(0, 1))


def test_a_line_of_ones_own_is_asked_itself():
    class Delayed(Cubic):
        def __call__(self, t):
            return super().__call__(np.asarray(t) - 0.1)

    own, plain = Delayed([0.3, 0.2], [0.2, 0.3], 1.0), Cubic([0.3, 0.2], [0.2, 0.3], 1.0)
    cell = cell_of([plain, own, plain])
    found = cell.told_together(range(3), TIMES)[0]
    np.testing.assert_array_equal(found[:, 1], own(TIMES).x)
    assert not np.array_equal(found[:, 1], found[:, 0])


def test_of_several_motions_that_fail_the_first_one_is_named():
    def late(t):
        if t > 1:
            raise ValueError(t)
        return [0.3, 0.2]

    def still(t):
        return [0.0, 0.0]

    wild, broken = Cubic([0.3, 0.2], [0.2, 0.3], 1.0), FunctionTrajectory(late, still, still)
    good = Cubic([0.3, 0.2], [0.2, 0.3], 1.0)
    cells = {NonFiniteError: cell_of([good, wild, broken]), SimulationError: cell_of([good, broken, wild])}
    wild.end = np.array([np.inf, 0.0])
    for kind, cell in cells.items():
        with pytest.raises(kind) as caught:
            cell.told_together(range(3), TIMES)
        assert type(caught.value) is kind and caught.value.robot == 1


# -- where tips are ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=5)
@given(seed=seeds)
def test_tips_side_by_side_are_those_of_the_robots(name, seed):
    rng, robot = np.random.default_rng(seed), ROBOTS[name]
    robots = [robot.placed(rng.uniform(-5, 5, 3), rng.uniform(-3, 3, 3)) for _ in range(4)]
    q = rng.uniform(-2, 2, (4, robot.nv))
    fixed, bases = mechanism(robot)[0], [mechanism(each)[1] for each in robots]
    p, R, J = tip_places(
        fixed, np.array([b.rotation for b in bases]), np.array([b.translation for b in bases]), q
    )
    for k, each in enumerate(robots):
        pose, expected, _ = each.tip_kinematics(q[k], np.zeros(robot.nv))
        np.testing.assert_allclose(p[k], pose.translation, rtol=0, atol=1e-13)
        np.testing.assert_allclose(R[k], pose.rotation, rtol=0, atol=1e-13)
        np.testing.assert_allclose(J[k], expected, rtol=0, atol=1e-12)


@settings(max_examples=20)
@given(seed=seeds)
def test_tips_of_trees_of_joints_that_turn_and_slide_are_those_of_the_robots(seed):
    rng, robot = np.random.default_rng(seed), random_robot(seed)
    try:
        fixed, base = mechanism(robot)
    except RobotError:  # it has several joints on the base, or none on the way to its tip
        return
    q = rng.uniform(-1, 1, (3, robot.nv))
    found = tip_places(fixed, np.array([base.rotation] * 3), np.array([base.translation] * 3), q)
    for k, row in enumerate(q):
        pose, J, _ = robot.tip_kinematics(row, np.zeros(robot.nv))
        np.testing.assert_allclose(found.position[k], pose.translation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.jacobian[k], J, rtol=0, atol=1e-12)


# -- whether they are followed -----------------------------------------------------------------------------


def seen(cell: Cell) -> np.ndarray:
    """Which robots of a cell of equal ones are seen to follow their paths without more patience."""
    stand = [mechanism(robot) for robot in cell.robots]
    R, p = (np.array([getattr(base, part) for _, base in stand]) for part in ("rotation", "translation"))
    return follow(cell.space, stand[0][0], (R, p), cell.q0, cell.told_together(range(cell.n), TIMES[::2])[0])


def patiently(cell: Cell, monkeypatch) -> UnreachableError | None:
    """What is said of a cell if every robot is looked at by itself, with all the patience there is."""
    with monkeypatch.context() as patch:
        patch.setattr(reachability, "can_be_followed", lambda space: False)
        return said_of(cell)


def said_of(cell: Cell) -> UnreachableError | None:
    try:
        check_reachable(cell, TIMES)
    except UnreachableError as error:
        return error
    return None


def told(error: UnreachableError | None) -> tuple:
    return (None,) if error is None else (str(error), error.subject, error.time, error.found)


@pytest.mark.parametrize("seed", range(8))
def test_what_is_said_of_paths_near_the_edge_of_the_workspace_is_what_patience_says(seed, monkeypatch):
    """Targets of the arm of 0.6 m between 0.3 m and a little more than it can reach, some to a nanometre."""
    rng = np.random.default_rng(seed)
    edge = np.array([0.6 + 0.9e-6, 0.6 + 1.1e-6, 0.6, 0.6 - 1e-9, 0.55, 0.62])
    members = []
    for k, radius in enumerate(rng.permutation(edge)):
        out = np.array([np.cos(k), np.sin(k)])
        place = rng.uniform(-3, 3, 2)
        robot = PLANAR.placed((*place, 0.0))
        members.append(Member(robot, Cubic(place + 0.3 * out, place + radius * out, 1.0), [k + 0.6, -1.2]))
    coupling = Coupling.pair()
    for first in range(0, 6, 2):
        cell = Cell(members[first : first + 2], coupling, CartesianSpace("xy"))
        assert told(said_of(cell)) == told(patiently(cell, monkeypatch))


def test_easy_paths_are_seen_at_once_and_paths_out_of_reach_are_not():
    easy, far = Cubic([0.3, 0.2], [0.2, 0.3], 1.0), Cubic([0.3, 0.2], [0.7, 0.2], 1.0)
    np.testing.assert_array_equal(seen(cell_of([easy, far, easy, far])), [True, False, True, False])


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_poses_are_followed_by_many_robots_that_stand_apart(name, monkeypatch):
    robot, q0, members = ROBOTS[name], np.array(Q0[name]), []
    for k in range(4):
        there = robot.placed((2.0 * k, -k, 0.1 * k), (0, 0, 0.3 * k))
        tip = there.tip_pose(q0)
        turning = AxisRotation.steady(tip.rotation, (0, 0, 1), 0.1 + 0.05 * k)
        members.append(Member(there, PoseTrajectory(Circle(tip.translation, 0.04, 2.0), turning), q0))
    cell = Cell(members, Coupling.signed_ring(4), PoseSpace())
    assert seen(cell).all()
    assert told(said_of(cell)) == told(patiently(cell, monkeypatch)) == (None,)


def test_equal_robots_with_equal_paths_are_looked_at_once_and_others_are_not_taken_for_them(monkeypatch):
    """Arms in a row with one path each as seen from their bases; then one base is turned, one arm moved."""
    asked = []

    def watched(fixed, R, p, q):
        asked.append(len(q))
        return tip_places(fixed, R, p, q)

    monkeypatch.setattr("synctrl.tasks.following.tip_places", watched)
    path = np.array([[0.3, 0.2], [0.2, 0.3]])

    def cell(shifts, turns, q0):
        arms = [PLANAR.placed((x, 0, 0), (0, 0, turn)) for x, turn in zip(shifts, turns, strict=True)]
        ways = [path + np.array([x, 0]) for x in shifts]
        members = [Member(a, Cubic(*w, 1.0), q) for a, w, q in zip(arms, ways, q0, strict=True)]
        return Cell(members, Coupling.signed_ring(len(arms)), CartesianSpace("xy"))

    shifts, q0 = [0.1, 1.7, 1000.3, -3.9], [Q0["planar2r"]] * 4
    assert seen(cell(shifts, [0.0] * 4, q0)).all() and max(asked) == 1
    asked.clear()
    assert seen(cell(shifts, [0.0, 0.5, 0.0, 0.0], q0)).all() and max(asked) == 2
    asked.clear()
    assert seen(cell(shifts, [0.0] * 4, [*q0[:3], [0.5, 1.1]])).all() and max(asked) == 2


def test_an_arm_that_cannot_follow_is_found_among_many_that_can():
    base = np.arange(50)
    paths = [Cubic([0.3 + x, 0.2], [0.2 + x + 0.5 * (x == 37), 0.3], 1.0) for x in base]
    members = [
        Member(PLANAR.placed((x, 0, 0)), path, Q0["planar2r"]) for x, path in zip(base, paths, strict=True)
    ]
    cell = Cell(members, Coupling.signed_ring(50), CartesianSpace("xy"))
    with refused(UnreachableError, "robot 38, trajectory"):
        check_reachable(cell, TIMES)


# -- derivatives -------------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(seeds, st.sampled_from(EXACT))
def test_motions_that_are_not_held_against_differences_would_pass(seed, kind):
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-5, 5, (2, 3))
    options = {Hold: (start,), Circle: (start, 0.7, rng.uniform(-9, 9))}
    motion = kind(*options.get(kind, (start, end, rng.uniform(0.1, 3))))
    windows = spread_windows(0.0, 4.0, motion.breaks, 24)
    assert find_misfit_in_motion(motion, windows, [slice(0, 3)]) is None


def test_a_line_of_rotation_vectors_is_no_motion_of_a_pose_and_is_still_refused():
    """Its velocity is the derivative of the coordinates; that of a pose is an angular velocity."""
    tip = UR5.tip_pose(np.array(Q0["ur5"]))
    start = np.concatenate((tip.translation, [0.8, 0.3, -0.5]))
    line = Cubic(start, start + np.array([0.0, 0.0, 0.0, -0.5, 0.9, 0.7]), 2.0)
    cell = Cell([Member(UR5, line, Q0["ur5"])] * 2, Coupling.pair(), PoseSpace())
    with refused(TrajectoryError, "robot 1, trajectory", derivative="velocity"):
        check_motions(cell, TIMES)
