"""Joint space and Cartesian space: what is measured, and how it leads to the joints and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from machines import random_robot, rate, rod_arm, seeds
from refusals import refused

from synctrl import CartesianSpace, Cell, Coupling, Hold, JointSpace, Member, load_robot
from synctrl.errors import InputError
from synctrl.tasks.spaces import units_of

AXES = ["x", "z", "xy", "yx", "zx", "xyz", "zxy"]


def bound(axes: str, seed: int):
    """Two random chains with as many joints as axes, and a random state of them."""
    rng = np.random.default_rng(seed)
    m = len(axes)
    robots = [random_robot(int(rng.integers(2**31)), m, chain=True) for _ in range(2)]
    q, v = rng.uniform(-2, 2, (2, 2, m))
    desired = rng.uniform(-1, 1, (3, 2, m))
    return robots, CartesianSpace(axes).bind(robots), q, v, desired


def measure(space, q: np.ndarray, v: np.ndarray, desired: np.ndarray):
    """What a bound space measures of robots in motion; desired: position, velocity and acceleration."""
    return space.measure(np.stack((q, v)), np.stack(desired))


def rows(axes: str) -> list[int]:
    return ["xyz".index(axis) for axis in axes]


@pytest.mark.parametrize("axes", AXES)
@given(seed=seeds)
@settings(max_examples=10)
def test_cartesian_space_measures_the_tips_along_its_axes(axes, seed):
    robots, space, q, v, desired = bound(axes, seed)
    task = measure(space, q, v, desired)
    for i, robot in enumerate(robots):
        np.testing.assert_allclose(task.x[i], robot.tip_position(q[i])[rows(axes)], atol=1e-13)
        np.testing.assert_allclose(task.e[i], desired[0, i] - task.x[i], atol=1e-13)
        moving = rate(lambda s, i=i, robot=robot: robot.tip_position(q[i] + s * v[i])[rows(axes)])
        np.testing.assert_allclose(task.x_dot[i], moving, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(task.J[i], robot.jacobian(q[i])[rows(axes)], atol=1e-13)
        np.testing.assert_allclose(task.J_dot[i], robot.jacobian_dot(q[i], v[i])[rows(axes)], atol=1e-13)
    np.testing.assert_array_equal(task.xd_dot, desired[1])
    np.testing.assert_array_equal(task.xd_ddot, desired[2])


@pytest.mark.parametrize("axes", AXES)
@given(seed=seeds)
@settings(max_examples=10)
def test_the_joint_reference_moves_the_tip_as_the_task_reference_asks(axes, seed):
    _robots, space, q, v, desired = bound(axes, seed)
    task = measure(space, q, v, desired)
    if np.linalg.cond(task.J).max() > 1e4:
        return  # no joint motion does what is asked there
    v_ref, a_ref = space.to_joints(task, desired[1], desired[2])
    np.testing.assert_allclose(np.matvec(task.J, v_ref), desired[1], rtol=1e-7, atol=1e-7)
    bent = np.matvec(task.J, a_ref) + np.matvec(task.J_dot, v_ref)
    np.testing.assert_allclose(bent, desired[2], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("axes", AXES)
@given(seed=seeds)
@settings(max_examples=10)
def test_a_force_on_the_tip_and_its_joint_torque_have_the_same_power(axes, seed):
    _, space, q, v, desired = bound(axes, seed)
    task, force = measure(space, q, v, desired), desired[2]
    np.testing.assert_allclose(
        (space.to_torque(task, force) * v).sum(), (force * task.x_dot).sum(), atol=1e-11
    )


@given(seeds)
@settings(max_examples=10)
def test_joint_space_is_the_identity(seed):
    robots = [random_robot(seed, 3), random_robot(seed // 2, 3)]
    q, v, xd, xd_dot, xd_ddot = np.random.default_rng(seed).normal(size=(5, 2, 3))
    space = JointSpace().bind(robots)
    task = measure(space, q, v, (xd, xd_dot, xd_ddot))
    np.testing.assert_array_equal(task.x, q)
    np.testing.assert_array_equal(task.e, xd - q)
    np.testing.assert_array_equal(task.x_dot, v)
    for found, given_ in zip(space.to_joints(task, xd_dot, xd_ddot), (xd_dot, xd_ddot), strict=True):
        np.testing.assert_array_equal(found, given_)
    np.testing.assert_array_equal(space.to_torque(task, xd), xd)


def test_a_singular_robot_does_not_spoil_the_others():
    robots = [rod_arm((1.0, 1.0), (0.3, 0.3)) for _ in range(3)]
    space = CartesianSpace("xy").bind(robots)
    q = np.array([[0.0, 1.0], [0.0, 0.0], [0.5, -1.0]])
    task = measure(space, q, np.ones((3, 2)), np.zeros((3, 3, 2)))
    for i in (0, 2):
        np.testing.assert_allclose(task.J[i] @ task.J_inv[i], np.eye(2), atol=1e-12)
    assert not np.isfinite(task.J_inv[1]).all() or np.abs(task.J_inv[1]).max() > 1e12


def test_measurements_survive_the_next_one():
    _robots, space, q, v, desired = bound("xyz", 1)
    task = measure(space, q, v, desired)
    kept = [part.copy() for part in (task.x, task.e, task.x_dot, task.J, task.J_dot, task.J_inv)]
    measure(space, q + 1, v - 1, desired)
    for now, then in zip((task.x, task.e, task.x_dot, task.J, task.J_dot, task.J_inv), kept, strict=True):
        np.testing.assert_array_equal(now, then)


def test_coordinates_have_names_and_units():
    arm = load_robot("a460")
    assert CartesianSpace("zx").labels([arm]) == ("z", "x") and CartesianSpace().unit == "m"
    assert JointSpace().labels([arm]) == arm.joint_names == ("joint1", "joint2", "joint3")
    assert JointSpace().labels([rod_arm((1, 1), (1, 1)), load_robot("asr_twodof")]) == ("joint 1", "joint 2")
    assert JointSpace().unit == "rad" and units_of(JointSpace(), [arm]) == ("rad",) * 3


@pytest.mark.parametrize("axes", ["", "xw", "xx", "XY", 3, None, ["x", "y"]])
def test_axes_that_are_none_are_refused(axes):
    with refused(InputError, "axes"):
        CartesianSpace(axes)


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan, np.inf, "large"])
def test_a_limit_of_the_condition_number_is_a_positive_number(limit):
    with refused(InputError, "max_condition"):
        CartesianSpace("xy", max_condition=limit)


def test_arms_with_too_few_joints_are_named():
    arm = load_robot("planar2r")
    members = [Member(arm, Hold([0.3, 0.3, 0.0]), [0.0, 1.0])] * 2
    with refused(InputError, "CartesianSpace('xyz')"):
        Cell(members, Coupling.pair(), CartesianSpace("xyz"))


def test_joint_space_needs_the_same_number_of_joints():
    members = [Member(load_robot("planar2r"), Hold([0.0, 1.0])), Member(load_robot("a460"), Hold([0, 0, 0]))]
    with refused(InputError, "joint space"):
        Cell(members, Coupling.pair())
