"""Robots that were placed from one have in common what does not depend on where they stand, and no more."""

from __future__ import annotations

import numpy as np
import pytest

from synctrl import Robot, load_robot
from synctrl.robots.mechanism import joint_limits, mechanism

ROBOTS = ("planar2r", "ur5", "panda")
PLACE = {"xyz": (0.4, -3.0, 0.2), "rpy": (0.3, -0.5, 1.1)}


def alone(robot: Robot) -> Robot:
    """The same robot, which has nothing in common with others."""
    return Robot(robot.model, robot.tip, name=robot.name)


def answers(robot: Robot, seed: int) -> list[np.ndarray]:
    """What a robot says of itself in a random state."""
    q, v, a, v_ref = np.random.default_rng(seed).uniform(-1, 1, (4, robot.nv))
    pose, J, J_dot = robot.tip_kinematics(q, v)
    found = [pose.translation.copy(), pose.rotation.copy(), J.copy(), J_dot.copy()]
    found += [robot.mass_matrix(q), robot.coriolis_matrix(q, v), robot.gravity(q)]
    found += [robot.inverse_dynamics(q, v, a), robot.forward_dynamics(q, v, a)]
    return [*found, robot.regressor(q, v, v_ref, a).copy()]


@pytest.mark.parametrize("name", ROBOTS)
def test_what_a_placed_robot_says_does_not_depend_on_the_robots_that_it_came_from(name):
    here = load_robot(name)
    there = here.placed(**PLACE)
    between = [answers(robot, seed) for seed in range(3) for robot in (here, there)]
    apart = [answers(alone(robot), seed) for seed in range(3) for robot in (here, there)]
    for found, expected in zip(between, apart, strict=True):
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ROBOTS)
def test_matrices_of_one_robot_stay_what_they_are_while_another_one_is_asked(name):
    here = load_robot(name)
    there, q, v = here.placed(**PLACE), np.full(here.nv, 0.3), np.full(here.nv, -0.2)
    _, *kept = here.tip_kinematics(q, v)
    kept += [here.regressor(q, v, v, v), here.jacobian(q), here.mass_matrix(q)]
    copies = [array.copy() for array in kept]
    answers(there, 0)
    for array, copy in zip(kept, copies, strict=True):
        np.testing.assert_array_equal(array, copy)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_placed_robot_has_the_mechanism_and_the_limits_of_the_one_it_came_from(name):
    here = load_robot(name)
    there = here.placed(**PLACE)
    assert mechanism(there)[0] is mechanism(here)[0]
    assert joint_limits(there) is joint_limits(here)
    expected, place = mechanism(alone(there))
    assert mechanism(there)[0].key() == expected.key()
    np.testing.assert_array_equal(mechanism(there)[1].homogeneous, place.homogeneous)
    assert not np.array_equal(mechanism(here)[1].homogeneous, place.homogeneous)


def test_other_tips_rotors_and_bodies_are_no_longer_the_same_mechanism():
    robot = load_robot("ur5")
    mechanism(robot), joint_limits(robot)
    heavier = robot.with_parameters(1.5 * robot.inertial_parameters)
    for other in (robot.with_tip("wrist_2_link"), robot.with_armature(0.1), heavier, robot.weightless()):
        expected = mechanism(alone(other))[0].key()
        assert mechanism(other)[0].key() == expected
    assert mechanism(robot.with_armature(0.1))[0].key() != mechanism(robot)[0].key()


def test_limits_that_are_shared_cannot_be_changed():
    for array in vars(joint_limits(load_robot("ur5"))).values():
        with pytest.raises(ValueError):
            array[0] = 1.0
