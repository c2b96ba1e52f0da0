"""What is adapted: theta (50), the printed Y, and own linear maps."""

from __future__ import annotations

import numpy as np
import paper_model as paper
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import rod_arm, seeds
from refusals import refused

from synctrl import FullParameters, LinearParameters, load_robot
from synctrl.errors import InputError
from synctrl.robots.parameters import planar_two_link_parameters, theta_50

ARM = load_robot("planar2r")
some = st.floats(0.1, 3.0)


@given(some, some, some, some)
@settings(max_examples=20)
def test_theta_is_equation_fifty(m1, m2, l1, l2):
    np.testing.assert_allclose(theta_50([m1, m2], [l1, l2]), paper.theta(m1, l1, m2, l2), rtol=1e-14)


def test_theta_of_table_three():
    # 1/3 + 1, 1/3 and 1/2 times 1 kg (0.3 m)^2
    np.testing.assert_allclose(planar_two_link_parameters(ARM).theta, [0.12, 0.03, 0.045], rtol=1e-14)


@given(seeds)
@settings(max_examples=40)
def test_the_regressor_is_the_printed_y_entry_by_entry(seed):
    q, v, v_ref, a_ref = np.random.default_rng(seed).uniform(-3, 3, (4, 2))
    Y = planar_two_link_parameters(ARM).regressor(q, v, v_ref, a_ref)
    printed = paper.printed_regressor(a_ref[None], v_ref[None], q[None], v[None])[0]
    np.testing.assert_allclose(Y, printed, rtol=0, atol=1e-11)


@given(some, some, some, some, seeds)
@settings(max_examples=30)
def test_theta_describes_arms_of_any_uniform_rods(m1, m2, l1, l2, seed):
    robot = rod_arm((m1, m2), (l1, l2))
    parameters = planar_two_link_parameters(robot, (m1, m2), (l1, l2))
    q, v, v_ref, a_ref = np.random.default_rng(seed).uniform(-3, 3, (4, 2))
    expected = robot.mass_matrix(q) @ a_ref + robot.coriolis_matrix(q, v) @ v_ref
    torque = parameters.regressor(q, v, v_ref, a_ref) @ parameters.theta
    np.testing.assert_allclose(torque, expected, rtol=1e-10, atol=1e-10)


@given(seeds)
@settings(max_examples=20)
def test_the_map_does_not_change_when_the_base_moves_in_its_plane(seed):
    rng = np.random.default_rng(seed)
    placed = ARM.placed((*rng.uniform(-5, 5, 2), 0.0), (0.0, 0.0, rng.uniform(-3, 3)))
    state = rng.uniform(-3, 3, (4, 2))
    here, there = planar_two_link_parameters(ARM), planar_two_link_parameters(placed)
    np.testing.assert_allclose(here.regressor(*state), there.regressor(*state), rtol=0, atol=1e-11)


def test_an_own_map_of_full_size_is_the_full_one():
    robot = load_robot("a460")
    own = LinearParameters(robot, np.eye(30), robot.inertial_parameters, robot.inertial_parameter_names)
    state = np.random.default_rng(2).uniform(-2, 2, (4, 3))
    np.testing.assert_allclose(own.regressor(*state), FullParameters(robot).regressor(*state), atol=1e-14)


def test_a_share_of_the_truth_is_a_single_parameter():
    robot = load_robot("a460")
    share = LinearParameters(robot, robot.inertial_parameters[:, None], [1.0], ["share"])
    q, v, a = np.random.default_rng(2).uniform(-2, 2, (3, 3))
    np.testing.assert_allclose(share.regressor(q, v, v, a)[:, 0], robot.inverse_dynamics(q, v, a), atol=1e-11)


def wrong_length():
    return planar_two_link_parameters(ARM, lengths=(0.31, 0.3))


def wrong_mass():
    return planar_two_link_parameters(ARM, masses=(1.0, 1.1))


def under_gravity():
    return planar_two_link_parameters(ARM.placed(rpy=(np.pi / 2, 0, 0)))


def missing_rows():
    return LinearParameters(ARM, np.eye(19, 3), np.ones(3), "abc")


def too_many_columns():
    return LinearParameters(ARM, np.eye(20, 4), np.ones(3), "abc")


def too_few_names():
    return LinearParameters(ARM, planar_two_link_parameters(ARM).matrix, theta_50([1, 1], [0.3, 0.3]), "ab")


def not_finite():
    return LinearParameters(ARM, np.full((20, 3), np.nan), np.ones(3), "abc")


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (wrong_length, "matrix"),
        (wrong_mass, "matrix"),
        (under_gravity, "matrix"),
        (missing_rows, "matrix"),
        (too_many_columns, "matrix"),
        (too_few_names, "names"),
        (not_finite, "matrix"),
    ],
)
def test_a_map_that_does_not_describe_the_robot_is_refused(make, subject):
    with refused(InputError, subject):
        make()
