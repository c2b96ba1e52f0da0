"""Rotations, pose trajectories and the full-pose space: group laws and derivatives."""

from __future__ import annotations

import pickle

import numpy as np
import pinocchio as pin
import pytest
from flows import derivative, desired_flow, joint_flow, tumbling
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import (
    Attached,
    AxisRotation,
    Circle,
    FunctionOrientation,
    Hold,
    PoseSpace,
    PoseTrajectory,
    load_robot,
)
from synctrl.errors import InputError, TrajectoryError
from synctrl.tasks import rotations
from synctrl.tasks.rotations import exp, left_jacobian_inverse, left_jacobian_inverse_dot, log, skew

UR5, PANDA = load_robot("ur5"), load_robot("panda")

seeds = st.integers(0, 10_000)
times = st.floats(0, 5)
units = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def vectors(largest: float):
    """Rotation vectors of all lengths, the very small ones too."""
    lengths = st.one_of(
        st.floats(0, largest), st.floats(0, 1e-3), st.sampled_from([0.0, 1e-9, 1e-5, 0.999999, 1.0])
    )
    return st.builds(lambda n, a: np.array(n) / np.linalg.norm(n) * min(a, largest), units, lengths)


@given(phi=vectors(6.0))
def test_exp_is_pinocchios_and_a_rotation(phi):
    np.testing.assert_allclose(exp(phi), pin.exp3(phi), atol=1e-14)
    np.testing.assert_allclose(exp(phi) @ exp(phi).T, np.eye(3), atol=1e-14)


@given(phi=vectors(np.pi - 1e-6))
def test_log_undoes_exp(phi):
    np.testing.assert_allclose(log(exp(phi)), phi, rtol=1e-12, atol=1e-14)


@given(n=units, off=st.floats(-1e-7, 1e-7))
def test_exp_undoes_log_at_half_a_turn_and_next_to_it(n, off):
    R = exp((np.pi + off) * np.array(n) / np.linalg.norm(n))
    assert np.linalg.norm(log(R)) <= np.pi + 1e-12
    np.testing.assert_allclose(exp(log(R)), R, atol=1e-14)


@given(phi=st.lists(vectors(3.0), min_size=4, max_size=4))
def test_stacks_are_treated_row_by_row(phi):
    stack = np.array(phi).reshape(2, 2, 3)
    for function in (exp, skew, left_jacobian_inverse, lambda p: log(exp(p))):
        rows = [[function(p) for p in row] for row in stack]
        np.testing.assert_allclose(function(stack), rows, atol=1e-14)


@given(phi=vectors(np.pi - 0.1), w=vectors(2.0))
def test_the_left_jacobian_gives_the_derivative_of_the_logarithm(phi, w):
    """phi' = Jl^-1 w for a turn with w in world axes, and Jr^-1 = (Jl^-1)^T for one in the body's axes."""
    left = derivative(lambda t: log(exp(t * w) @ exp(phi)), 0.0)
    right = derivative(lambda t: log(exp(phi) @ exp(t * w)), 0.0)
    np.testing.assert_allclose(left_jacobian_inverse(phi) @ w, left, atol=1e-9)
    np.testing.assert_allclose(left_jacobian_inverse(phi).T @ w, right, atol=1e-9)


@given(phi=vectors(5.5))
def test_the_left_jacobian_is_pinocchios(phi):
    np.testing.assert_allclose(np.linalg.inv(left_jacobian_inverse(phi)).T, pin.Jexp3(phi), atol=1e-9)


@given(phi=vectors(4.0), phi_dot=vectors(2.0))
def test_the_derivative_of_the_left_jacobian_is_that_of_finite_differences(phi, phi_dot):
    numeric = derivative(lambda t: left_jacobian_inverse(phi + t * phi_dot), 0.0)
    np.testing.assert_allclose(left_jacobian_inverse_dot(phi, phi_dot), numeric, atol=1e-9)


@given(angle=st.floats(1.0, 6.0))
def test_the_series_have_the_digits_of_the_closed_form_where_that_has_them_all(angle):
    """b = 1/a^2 - cot(a/2)/(2a) and b'/a, along any axis."""
    half = angle / 2
    b = 1 / angle**2 - 0.5 / (angle * np.tan(half))
    slope = (0.5 / (angle * np.tan(half)) + 0.25 / np.sin(half) ** 2 - 2 / angle**2) / angle**2
    found = rotations._coefficients(angle * np.array([0.6, 0.0, -0.8]))
    np.testing.assert_allclose(np.ravel(found), (b, slope), rtol=2e-13)


# -- desired motion --------------------------------------------------------------------------------------


def orientations(seed: int) -> dict:
    rng = np.random.default_rng(seed)
    R0, R1 = (exp(phi) for phi in rng.uniform(-2, 2, (2, 3)))
    return {
        "fixed": AxisRotation.fixed(R0),
        "between": AxisRotation.between(R0, R1, 2.0),
        "steady": AxisRotation.steady(R0, rng.uniform(0.1, 1, 3), 1.3),
        "function": tumbling(rng),
    }


def check_pose_derivatives(trajectory, t: float) -> None:
    """x' = velocity and [w] = R' R^T, w in world axes; x'' their derivative."""
    x, x_dot, x_ddot = trajectory(t)
    R_dot = derivative(lambda t: exp(trajectory(t).x[3:]), t)
    np.testing.assert_allclose(R_dot, skew(x_dot[3:]) @ exp(x[3:]), atol=1e-8)
    np.testing.assert_allclose(x_dot[:3], derivative(lambda t: trajectory(t).x[:3], t), atol=1e-8)
    np.testing.assert_allclose(x_ddot, derivative(lambda t: trajectory(t).x_dot, t), atol=1e-7)


@pytest.mark.parametrize("kind", ["fixed", "between", "steady", "function"])
@settings(max_examples=20)
@given(seed=seeds, t=times)
def test_velocity_and_acceleration_of_pose_trajectories_are_derivatives(kind, seed, t):
    trajectory = PoseTrajectory(Circle([0, 0, 1], 0.3, 0.7), orientations(seed)[kind])
    if not any(abs(t - b) < 0.01 for b in trajectory.breaks):
        check_pose_derivatives(trajectory, t)


@settings(max_examples=20)
@given(seed=seeds, t=times)
def test_velocity_and_acceleration_of_attached_frames_are_derivatives(seed, t):
    rng = np.random.default_rng(seed)
    body = desired_flow(rng, 6)
    check_pose_derivatives(Attached(body, rng.uniform(-1, 1, 3), exp(rng.uniform(-1, 1, 3))), t)


@settings(max_examples=20)
@given(seed=seeds, t=times)
def test_an_attached_frame_keeps_its_place_on_the_body(seed, t):
    rng = np.random.default_rng(seed)
    body, d, G = desired_flow(rng, 6), rng.uniform(-1, 1, 3), exp(rng.uniform(-1, 1, 3))
    x, b = Attached(body, d, G)(t).x, body(t).x
    np.testing.assert_allclose(exp(b[3:]).T @ (x[:3] - b[:3]), d, atol=1e-12)
    np.testing.assert_allclose(exp(b[3:]).T @ exp(x[3:]), G, atol=1e-12)


def test_the_turn_between_two_orientations_starts_and_ends_there_at_rest():
    R0, R1 = exp(np.array([0.3, -1.0, 0.2])), exp(np.array([-0.5, 0.1, 1.4]))
    turn = AxisRotation.between(R0, R1, 2.0)
    for t, R in ((0.0, R0), (2.0, R1), (3.0, R1)):
        np.testing.assert_allclose(turn(t).R, R, atol=1e-12)
        np.testing.assert_allclose(turn(t).w, 0, atol=1e-12)


@settings(max_examples=20)
@given(seed=seeds)
def test_pose_trajectories_of_many_times_are_those_of_each_time(seed):
    t = np.linspace(0, 3, 5)
    for orientation in orientations(seed).values():
        body = PoseTrajectory(Circle([0, 0, 1], 0.3, 0.7), orientation)
        for trajectory in (body, Attached(body, [1, 2, 3], exp(np.ones(3)))):
            for part, rows in zip(trajectory(t), zip(*map(trajectory, t), strict=True), strict=True):
                np.testing.assert_allclose(part, rows, atol=1e-14)


@pytest.mark.parametrize("name", ["fixed", "between", "steady"])
def test_turns_about_an_axis_can_be_sent_to_another_process(name):
    turn = orientations(3)[name]
    times = np.linspace(0.0, 3.0, 7)
    for one, other in zip(turn(times), pickle.loads(pickle.dumps(turn))(times), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("subject", "make"),
    {
        "angle": lambda: AxisRotation(np.eye(3), (0, 0, 1), 0.3),
        "position": lambda: PoseTrajectory([0.0, 0.0, 0.0]),
        "orientation": lambda: PoseTrajectory(Hold([0, 0, 0]), np.eye(3)),
        "rotation": lambda: FunctionOrientation(np.eye(3), np.zeros(3), np.zeros(3)),
        "breaks": lambda: FunctionOrientation(lambda t: np.eye(3), np.zeros, np.zeros, ["soon"]),
    }.items(),
)
def test_what_is_no_part_of_a_pose_trajectory_is_refused_by_name(subject, make):
    with refused(InputError, subject):
        make()


def test_malformed_pose_trajectories_are_refused():
    with refused(InputError, "position", found=2):
        PoseTrajectory(Hold([0, 0]))
    with refused(InputError, "start"):
        AxisRotation.fixed(2 * np.eye(3))
    with refused(InputError, "start"):
        AxisRotation.fixed(-np.eye(3))
    with refused(InputError, "length of axis"):
        AxisRotation.steady(np.eye(3), (0, 0, 0), 1.0)
    with refused(InputError, "angle", found=2):
        AxisRotation(np.eye(3), (0, 0, 1), Hold([0, 0]))
    with refused(InputError, "body"):
        Attached(Hold([0, 0, 0]))
    zero = np.zeros(3)
    with refused(TrajectoryError, "velocity", found=(2,)):
        FunctionOrientation(lambda t: np.eye(3), lambda t: zero[:2], lambda t: zero)


# -- the space -------------------------------------------------------------------------------------------


def pose_motion(seed: int):
    """The measurement of a UR5 and a Panda as a function of time along a smooth motion."""
    rng = np.random.default_rng(seed)
    robots = [UR5, PANDA]
    bound, q = PoseSpace().bind(robots), joint_flow(rng, robots)
    desired = [desired_flow(rng, 6) for _ in robots]

    def measure(t: float):
        xd = [np.stack(part) for part in zip(*(d(t) for d in desired), strict=True)]
        return bound.measure(np.stack((q(t), q.dot(t))), np.stack(xd))

    return measure, q, desired


@settings(max_examples=20)
@given(seed=seeds, t=times)
def test_the_pose_error_is_the_turn_to_the_desired_orientation_in_world_axes(seed, t):
    measure, q, desired = pose_motion(seed)
    for i, robot in enumerate((UR5, PANDA)):
        pose = robot.tip_pose(q(t)[i, : robot.nv])
        e, xd = measure(t).e[i], desired[i](t).x
        np.testing.assert_allclose(pose.translation + e[:3], xd[:3], atol=1e-12)
        np.testing.assert_allclose(exp(e[3:]) @ pose.rotation, exp(xd[3:]), atol=1e-12)
        np.testing.assert_allclose(exp(measure(t).x[i, 3:]), pose.rotation, atol=1e-12)


@settings(max_examples=20)
@given(seed=seeds, t=times)
def test_derivatives_of_the_pose_measurement_are_those_of_finite_differences(seed, t):
    measure = pose_motion(seed)[0]
    task = measure(t)
    assume(np.linalg.norm(task.e[:, 3:], axis=1).max() < 2.8)
    e_dot = task.xd_dot - task.x_dot
    np.testing.assert_allclose(e_dot, derivative(lambda t: measure(t).e, t), atol=1e-7)
    np.testing.assert_allclose(task.xd_ddot, derivative(lambda t: measure(t).xd_dot, t), atol=1e-7)
    np.testing.assert_allclose(task.J_dot, derivative(lambda t: measure(t).J, t), atol=1e-7)


@settings(max_examples=20)
@given(seed=seeds)
def test_inverse_kinematics_sees_the_same_error_and_jacobian(seed):
    measure, q, desired = pose_motion(seed)
    for i, robot in enumerate((UR5, PANDA)):
        e, J = PoseSpace().miss(robot, desired[i](1.0).x, q(1.0)[i, : robot.nv])
        np.testing.assert_allclose(e, measure(1.0).e[i], atol=1e-13)
        np.testing.assert_allclose(J, measure(1.0).J[i, :, : robot.nv], atol=1e-13)
