"""Inverse kinematics within the limits and the short way round; and cells that are not told a start."""

from __future__ import annotations

import pickle
import warnings
from dataclasses import replace

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
    Experiment,
    Gains,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    PoseTrajectory,
    Redundancy,
    Robot,
    inverse_kinematics,
    load_robot,
)
from synctrl.errors import InputError, LimitWarning, UnreachableError
from synctrl.robots.documents import planar_arm
from synctrl.robots.mechanism import joint_limits
from synctrl.robots.urdf.description import describe
from synctrl.robots.urdf.document import Document
from synctrl.tasks.inverse_kinematics import start_in, unwound
from synctrl.tasks.rotations import log

ARMS = {name: load_robot(name) for name in ("panda", "a460", "xarm7", "kinova", "ur5")}
SPACES = {"position": CartesianSpace("xyz"), "pose": PoseSpace()}
XY = CartesianSpace("xy")


def within(robot: Robot, q: np.ndarray) -> bool:
    limits = joint_limits(robot)
    return bool(((q >= limits.lower - 1e-9) & (q <= limits.upper + 1e-9)).all())


def allowed(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """A configuration within the limits, (nv,)."""
    limits = joint_limits(robot)
    return rng.uniform(np.maximum(limits.lower, -3), np.minimum(limits.upper, 3))


def place(robot: Robot, q: np.ndarray, space) -> np.ndarray:
    pose = robot.tip_pose(q)
    full = np.concatenate((pose.translation, log(pose.rotation)))
    return full if isinstance(space, PoseSpace) else full[:3][space.rows]


def narrow(lower: float, upper: float, joint: int = 1) -> Robot:
    """A planar arm of 0.3 m and 0.3 m of which one joint has another range, rad."""
    document = planar_arm([0.3, 0.3], [1, 1])
    joints = list(document.joints)
    limit = replace(joints[joint].limit, lower=lower, upper=upper)
    joints[joint] = replace(joints[joint], limit=limit)
    return robot_of(replace(document, joints=tuple(joints)))


def robot_of(document: Document) -> Robot:
    found = describe(document)
    return Robot(found.model, found.tip, name=found.name, document=document)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("name", ["panda", "xarm7"])
@settings(max_examples=8)
@given(seed=st.integers(0, 10_000))
def test_what_is_found_is_within_the_limits_where_such_a_configuration_is_near(name, space, seed):
    robot, space, rng = ARMS[name], SPACES[space], np.random.default_rng(seed)
    q = allowed(robot, rng)
    shifted = np.clip(q + rng.uniform(-0.3, 0.3, robot.nv), *within_bounds(robot))
    found = inverse_kinematics(robot, place(robot, shifted, space), q, space)
    assert np.abs(space.miss(robot, place(robot, shifted, space), found)[0]).max() < 1e-6
    assert within(robot, found)


def within_bounds(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    limits = joint_limits(robot)
    return limits.lower, limits.upper


def test_an_elbow_that_bends_one_way_only_is_bent_that_way():
    """The tip is nearest from the other side of the elbow, which the limits do not have."""
    robot, other_side = narrow(0.0, 3.0), np.array([0.4, -0.5])
    target = robot.tip_position(other_side)[:2]
    found = inverse_kinematics(robot, target, other_side, XY)
    assert within(robot, found)
    np.testing.assert_allclose(robot.tip_position(found)[:2], target, atol=1e-6)


def test_limits_that_have_to_be_left_are_named():
    """An elbow that stays stretched does not reach 0.3 m."""
    robot = narrow(-0.1, 0.1)
    with pytest.warns(LimitWarning, match=r"'joint2' at .*expected -0.1 to 0.1"):
        found = inverse_kinematics(robot, np.array([0.3, 0.0]), np.zeros(2) + 0.01, XY)
    np.testing.assert_allclose(robot.tip_position(found)[:2], [0.3, 0.0], atol=1e-6)
    assert not within(robot, found)


def test_what_is_out_of_reach_is_none_and_nothing_is_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert inverse_kinematics(narrow(0.0, 3.0), np.array([3.0, 0.0]), np.zeros(2), XY) is None


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000))
def test_a_joint_without_end_goes_the_short_way_round(seed):
    robot, rng = ARMS["kinova"], np.random.default_rng(seed)
    endless = np.isinf(joint_limits(robot).lower)
    assert endless.any()
    q = allowed(robot, rng) + np.where(endless, 2 * np.pi * rng.integers(-3, 4, robot.nv), 0.0)
    found = inverse_kinematics(robot, robot.tip_position(allowed(robot, rng)), q)
    assert (np.abs(found - q)[endless] <= np.pi + 1e-9).all()


def test_whole_turns_keep_the_configuration_and_stay_within_the_limits():
    robot, near = ARMS["ur5"], np.array([6.0, -6.0, 0.0, 3.0, -3.0, 1.0])
    q = np.array([-0.2, 0.2, 5.0, 1.0, 1.0, -6.2])
    found = unwound(robot, q, near)
    np.testing.assert_allclose(np.cos(found), np.cos(q), atol=1e-12)
    np.testing.assert_allclose(np.sin(found), np.sin(q), atol=1e-12)
    assert within(robot, found)
    assert (np.abs(found - near) <= np.abs(q - near) + 1e-12).all()
    stuck = narrow(-1.0, 1.0)
    np.testing.assert_array_equal(unwound(stuck, np.array([0.0, 0.5]), np.array([0.0, 7.0])), [0.0, 0.5])


def test_positions_beyond_the_limits_are_brought_back_by_whole_turns_if_these_do_it():
    robot = narrow(-1.0, 1.0)
    found = unwound(robot, np.array([0.0, 2 * np.pi + 0.5]), np.array([0.0, 7.0]))
    np.testing.assert_allclose(found, [0.0, 0.5], atol=1e-12)


# -- cells that are not told a start ------------------------------------------------------------------------


def path_of(robot: Robot, q: np.ndarray, space) -> object:
    tip = robot.tip_pose(q)
    circle = Circle(tip.translation, 0.05, 1.0)
    if isinstance(space, PoseSpace):
        return PoseTrajectory(circle, AxisRotation.fixed(tip.rotation))
    return circle


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("name", ["panda", "ur5", "xarm7"])
def test_a_robot_that_nobody_told_where_to_start_starts_on_its_path_within_its_limits(name, space):
    robot, space = ARMS[name], SPACES[space]
    path = path_of(robot, allowed(robot, np.random.default_rng(3)), space)
    cell = Cell([Member(robot, path), Member(robot, path)], Coupling.pair(), space)
    assert cell.starts == ("inverse kinematics",) * 2
    assert np.abs(space.miss(robot, path(0.0).x, cell.q0[0])[0]).max() < 1e-6
    assert within(robot, cell.q0[0])
    np.testing.assert_array_equal(cell.q0[0], cell.q0[1])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(cell)).q0, cell.q0)


def test_the_posture_of_the_space_is_where_the_search_begins():
    robot = ARMS["panda"]
    posture = np.array([0, -0.8, 0, -2.3, 0, 1.6, 0.8])
    space = CartesianSpace("xyz", redundancy=Redundancy(posture))
    path = Hold(robot.tip_position(posture + 0.05))
    cell = Cell([Member(robot, path), Member(robot, path)], Coupling.pair(), space)
    assert np.linalg.norm(cell.q0[0] - posture) <= np.linalg.norm(np.full(7, 0.05)) + 1e-6


def test_without_a_posture_the_start_is_no_singular_configuration():
    """The middle of this arm's ranges is the stretched arm."""
    robot = load_robot("planar2r")
    target = np.array([0.4, 0.1])
    q = start_in(robot, target, XY, None)
    best = 0.3 * 0.3 * np.sin(np.arccos((target @ target - 2 * 0.3**2) / (2 * 0.3**2)))
    assert abs(np.linalg.det(robot.jacobian(q)[:2])) == pytest.approx(abs(best), abs=1e-6)


def test_a_result_says_where_the_starts_came_from():
    robot = load_robot("planar2r")
    path = Hold([0.4, 0.1])
    asked = Member(robot, path, theta_hat0=robot.inertial_parameters)
    told = Member(robot, path, start_in(robot, path(0.0).x, XY, None), theta_hat0=robot.inertial_parameters)
    cell = Cell([told, asked], Coupling.pair(), XY)
    result = Experiment(cell, Gains(5, 5, 1, 1, 0.1), 0.01).simulate()
    assert result.info["start"] == ["given", "inverse kinematics"]
    assert np.abs(result.tracking_error).max() < 1e-5
    joints = Cell([Member(robot, Hold([0.1, 0.2]))] * 2, Coupling.pair(), JointSpace())
    assert joints.starts == ("path", "path")


def test_a_start_out_of_reach_is_refused():
    robot = load_robot("planar2r")
    with refused(UnreachableError):
        Cell([Member(robot, Hold([3.0, 0.0]))] * 2, Coupling.pair(), XY)


def test_a_posture_of_another_size_is_refused_where_it_is_needed_for_a_start():
    space = CartesianSpace("xyz", redundancy=Redundancy(np.zeros(3)))
    with refused(InputError):
        Cell([Member(ARMS["panda"], Hold([0.4, 0.0, 0.4]))] * 2, Coupling.pair(), space)
