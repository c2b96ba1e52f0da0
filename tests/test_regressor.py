"""The Slotine-Li regressor: Y pi = M a_ref + C v_ref + g, against the matrices themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot, seeds

from synctrl import FullParameters, Robot, load_robot

ROBOTS = {name: load_robot(name) for name in ("planar2r", "a460")}


def assert_is_the_regressor(robot: Robot, seed: int) -> None:
    q, v, v_ref, a_ref = np.random.default_rng(seed).uniform(-2, 2, (4, robot.nv))
    expected = robot.mass_matrix(q) @ a_ref + robot.coriolis_matrix(q, v) @ v_ref + robot.gravity(q)
    torque = robot.regressor(q, v, v_ref, a_ref) @ robot.inertial_parameters
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-10 * max(1, np.abs(expected).max()))


@given(seeds, st.integers(1, 7), st.booleans())
@settings(max_examples=60)
def test_the_regressor_of_a_random_robot(seed, joints, chain):
    assert_is_the_regressor(random_robot(seed, joints, chain), seed)


@pytest.mark.parametrize("name", ROBOTS)
@given(seed=seeds)
@settings(max_examples=25)
def test_the_regressor_of_a_ready_robot(name, seed):
    assert_is_the_regressor(ROBOTS[name], seed)


@given(seeds)
@settings(max_examples=15)
def test_the_regressor_of_a_robot_on_a_turned_base(seed):
    xyz, rpy = np.random.default_rng(seed).uniform(-2, 2, (2, 3))
    assert_is_the_regressor(ROBOTS["a460"].placed(xyz, rpy), seed)


@given(seeds, st.integers(1, 6))
@settings(max_examples=20)
def test_the_regressor_knows_nothing_of_the_true_parameters(seed, joints):
    robot = random_robot(seed, joints)
    arguments = np.random.default_rng(seed).uniform(-2, 2, (4, joints))
    other = robot.with_parameters(1.7 * robot.inertial_parameters)
    np.testing.assert_array_equal(robot.regressor(*arguments), other.regressor(*arguments))


@given(seeds, st.integers(1, 6))
@settings(max_examples=20)
def test_v_and_v_ref_may_change_places(seed, joints):
    # C(q, v) v_ref = C(q, v_ref) v is what the two calls rely on
    robot = random_robot(seed, joints)
    q, v, v_ref, a_ref = np.random.default_rng(seed).uniform(-2, 2, (4, joints))
    here, there = robot.regressor(q, v, v_ref, a_ref), robot.regressor(q, v_ref, v, a_ref)
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-12 * (1 + np.abs(here).max()))


@given(seeds, st.integers(1, 6))
@settings(max_examples=20)
def test_a_body_moves_no_joint_that_does_not_carry_it(seed, joints):
    robot = random_robot(seed, joints)
    Y = robot.regressor(*np.random.default_rng(seed).uniform(-2, 2, (4, joints)))
    for joint in range(joints):
        carried = {b - 1 for b in robot.model.subtrees[joint + 1]}
        for body in set(range(joints)) - carried:
            np.testing.assert_array_equal(Y[joint, 10 * body : 10 * body + 10], 0)


def test_all_parameters_together_are_the_robots_own():
    robot = ROBOTS["a460"]
    parameters = FullParameters(robot)
    arguments = np.random.default_rng(0).uniform(-2, 2, (4, 3))
    assert len(parameters.names) == 30 == len(set(parameters.names))
    np.testing.assert_array_equal(parameters.theta, robot.inertial_parameters)
    np.testing.assert_array_equal(parameters.regressor(*arguments), robot.regressor(*arguments))
