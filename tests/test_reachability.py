"""Inverse kinematics in position and pose, and the check of desired motions before anything runs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    FunctionTrajectory,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    PoseTrajectory,
    inverse_kinematics,
    load_robot,
)
from synctrl.coupling.reachability import check_reachable, reach
from synctrl.errors import UnreachableError
from synctrl.tasks.rotations import log

UR5, PANDA, PLANAR = load_robot("ur5"), load_robot("panda"), load_robot("planar2r")
ROBOTS = {"ur5": UR5, "panda": PANDA}
READY = {
    "ur5": np.array([0.0, -1.3, 1.9, -2.1, -1.5, 0.1]),
    "panda": np.array([0, -0.8, 0, -2.3, 0, 1.6, 0.8]),
}
SPACES = {"position": CartesianSpace("xyz"), "two axes": CartesianSpace("xz"), "pose": PoseSpace()}
TIMES = np.linspace(0, 2, 101)


def place(robot, q: np.ndarray, space) -> np.ndarray:
    """Task coordinates of a configuration."""
    pose = robot.tip_pose(q)
    if isinstance(space, PoseSpace):
        return np.concatenate((pose.translation, log(pose.rotation)))
    return pose.translation[space.rows]


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=15)
@given(seed=st.integers(0, 10_000))
def test_every_place_of_the_tip_is_found_again(name, space, seed):
    robot, space = ROBOTS[name], SPACES[space]
    q = READY[name] + np.random.default_rng(seed).uniform(-0.8, 0.8, robot.nv)
    target = place(robot, q, space)
    found = inverse_kinematics(robot, target, READY[name], space)
    assert found is not None
    assert np.abs(space.miss(robot, target, found)[0]).max() < 1e-6


@settings(max_examples=15)
@given(step=st.tuples(*[st.floats(-0.02, 0.02)] * 3))
def test_a_redundant_arm_stays_close_to_where_it_was(step):
    target = PANDA.tip_position(READY["panda"]) + step
    found = inverse_kinematics(PANDA, target, READY["panda"])
    J = PANDA.jacobian(READY["panda"])[:3]
    least = np.linalg.norm(np.linalg.pinv(J) @ np.array(step))
    assert np.linalg.norm(found - READY["panda"]) <= 1.2 * least + 1e-6


def test_inverse_kinematics_gives_the_same_answer_every_time():
    target = np.array([0.3, 0.4, 0.2])
    answers = [inverse_kinematics(UR5, target, np.zeros(6)) for _ in range(2)]
    np.testing.assert_array_equal(*answers)


def cell(space, trajectories: list, name: str = "ur5") -> Cell:
    members = [Member(ROBOTS[name], trajectory, READY[name]) for trajectory in trajectories]
    return Cell(members, Coupling.pair(), space)


def pose_at(position, rotation) -> PoseTrajectory:
    return PoseTrajectory(position, AxisRotation.fixed(rotation))


@pytest.mark.parametrize("name", ROBOTS)
def test_paths_inside_the_workspace_pass(name):
    tip = ROBOTS[name].tip_pose(READY[name])
    circle = Circle(tip.translation, 0.05, np.pi)
    check_reachable(cell(CartesianSpace("xyz"), [circle, circle], name), TIMES)
    turning = PoseTrajectory(circle, AxisRotation.steady(tip.rotation, (0, 0, 1), 0.2))
    check_reachable(cell(PoseSpace(), [turning, turning], name), TIMES)


def test_a_position_out_of_reach_is_reported_with_robot_time_and_place():
    near, far = Hold(UR5.tip_position(READY["ur5"])), Hold([0.3, 3.0, 0.2])
    with refused(UnreachableError, "robot 2, trajectory", time=0.0, found=(0.3, 3.0, 0.2)):
        check_reachable(cell(CartesianSpace("xyz"), [near, far]), TIMES)


def test_a_pose_out_of_reach_is_reported_with_its_orientation():
    tip = UR5.tip_pose(READY["ur5"])
    near, far = pose_at(Hold(tip.translation), tip.rotation), pose_at(Hold([0.0, 0.0, 2.0]), np.eye(3))
    where = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
    with refused(UnreachableError, "robot 2, trajectory", time=0.0, found=where) as caught:
        check_reachable(cell(PoseSpace(), [near, far]), TIMES)
    each = "z = 2 m, rx = 0 rad"
    assert each in caught.value.problem  # each coordinate with its unit


def test_a_place_that_the_tip_reaches_in_another_orientation_only_is_out_of_reach_as_a_pose():
    """The wrist would have to be where the arm ends: position alone is possible there, the pose is not."""
    q = np.array([0.0, 0.0, 0.01, 0.0, 0.0, 0.0])
    tip = UR5.tip_pose(q)
    outward = tip.translation / np.linalg.norm(tip.translation)
    axes = np.linalg.qr(np.column_stack((-outward, [0, 0, 1.0], [0, 1.0, 0])))[0]
    pointing_back = np.column_stack((axes[:, 1], np.cross(-outward, axes[:, 1]), -outward))
    position, pose = Hold(tip.translation), pose_at(Hold(tip.translation), pointing_back)
    check_reachable(cell(CartesianSpace("xyz"), [position, position]), TIMES)
    with pytest.raises(UnreachableError):
        check_reachable(cell(PoseSpace(), [pose, pose]), TIMES)


def test_the_time_at_which_a_path_leaves_the_workspace_is_given():
    """From (0.4, 0) outward by 0.2 m/s: the arm of 0.6 m ends after one second."""
    line = FunctionTrajectory(lambda t: [0.4 + 0.2 * t, 0.0], lambda t: [0.2, 0.0], lambda t: [0.0, 0.0])
    member = Member(PLANAR, line, [0.8, -1.6])
    with pytest.raises(UnreachableError) as caught:
        check_reachable(Cell([member, member], Coupling.pair(), CartesianSpace("xy")), TIMES)
    assert 1.0 < caught.value.time <= 1.0 + 2 * 2 / 59


def test_joint_space_has_nothing_to_check():
    check_reachable(cell(JointSpace(), [Hold(np.full(6, 50.0))] * 2), TIMES)


def test_reach_names_the_robot_when_there_is_no_way():
    with refused(UnreachableError, "target", found=(5.0, 0.0, 0.0)):
        reach(UR5, np.array([5.0, 0, 0]), READY["ur5"])
