"""Errors that count where a point slides on what a robot carries, and tools that ride there."""

from __future__ import annotations

import numpy as np
import pytest
from flows import derivative, desired_flow, joint_flow
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import Hold, PoseSpace, PoseTrajectory, load_robot
from synctrl.errors import InputError
from synctrl.tasks.measurement import Tips
from synctrl.tasks.rotations import exp, log
from synctrl.tasks.sliding import Carrier, Rider, SlidingSpace

UR5, PANDA = load_robot("ur5"), load_robot("panda")
SEEDS, TIMES = st.integers(0, 10_000), st.floats(0.1, 4.9)


# -- bodies that carry, and tools that ride ---------------------------------------------------------------


@settings(max_examples=10)
@given(seed=SEEDS, t=TIMES)
def test_a_rider_is_where_the_frame_on_the_moving_body_is_and_its_derivatives_are_those_of_differences(
    seed, t
):
    rng = np.random.default_rng(seed)
    body, frame = desired_flow(rng, 6), desired_flow(rng, 6)
    rider, R = Rider(body, frame), body.orientation(t).R
    x, x_dot, x_ddot = rider(t)
    np.testing.assert_allclose(R.T @ (x[:3] - body.position(t).x), frame.position(t).x, atol=1e-12)
    np.testing.assert_allclose(R.T @ exp(x[3:]), frame.orientation(t).R, atol=1e-12)
    np.testing.assert_allclose(derivative(lambda t: rider(t).x[:3], t), x_dot[:3], atol=1e-8)
    np.testing.assert_allclose(derivative(lambda t: rider(t).x_dot, t), x_ddot, atol=1e-8)
    turned = derivative(lambda t: exp(rider(t).x[3:]), t)
    np.testing.assert_allclose(turned, np.cross(x_dot[3:], exp(x[3:]), axisb=0, axisc=0), atol=1e-8)


# -- errors that count where a point slides ---------------------------------------------------------------


def sliding(seed: int):
    """What a UR5 and a Panda that carry measure along a smooth motion, over time; and its parts."""
    rng = np.random.default_rng(seed)
    robots, space = [UR5, PANDA], SlidingSpace()
    bound, q = space.bind(robots), joint_flow(rng, robots)
    carriers = [Carrier(desired_flow(rng, 6), desired_flow(rng, 6)) for _ in robots]

    def measure(t: float, frames: float = 1.0):
        times = np.array([t])
        rows = [np.concatenate((c(times), frames * space.further(c, times)))[:, 0] for c in carriers]
        return bound.measure(np.stack((q(t), q.dot(t))), np.stack(rows, axis=1))

    return measure, q, carriers


@settings(max_examples=10)
@given(seed=SEEDS, t=TIMES)
def test_errors_count_at_the_frame_on_the_body_however_that_is_turned_there(seed, t):
    measure, q, carriers = sliding(seed)
    task = measure(t)
    for i, (robot, carrier) in enumerate(zip((UR5, PANDA), carriers, strict=True)):
        tip = robot.tip_pose(q(t)[i, : robot.nv])
        rho, G = carrier.frame.position(t).x, carrier.frame.orientation(t).R
        wanted = Rider(PoseTrajectory(carrier.position, carrier.orientation), carrier.frame)(t).x
        np.testing.assert_allclose(task.x[i, :3], tip.translation, atol=1e-12)
        actual = tip.translation + tip.rotation @ rho
        np.testing.assert_allclose(task.e[i, :3], wanted[:3] - actual, atol=1e-12)
        turn = log(exp(wanted[3:]) @ (tip.rotation @ G).T)
        np.testing.assert_allclose(task.e[i, 3:], turn, atol=1e-11)


@settings(max_examples=15)
@given(seed=SEEDS, t=TIMES)
def test_the_drift_and_its_rate_are_taken_from_what_is_desired(seed, t):
    """e' = (xd' - b) - J v, and the rate of xd' - b is xd'' - b'; all by differences."""
    measure = sliding(seed)[0]
    task = measure(t)
    if np.linalg.norm(task.e[:, 3:], axis=1).max() > 2.8:
        return
    np.testing.assert_allclose(task.e_dot, derivative(lambda t: measure(t).e, t), atol=1e-7)
    np.testing.assert_allclose(task.e_dot, task.xd_dot - task.x_dot, atol=1e-12)
    np.testing.assert_allclose(task.xd_ddot, derivative(lambda t: measure(t).xd_dot, t), atol=1e-7)
    np.testing.assert_allclose(task.J_dot, derivative(lambda t: measure(t).J, t), atol=1e-7)


@settings(max_examples=10)
@given(seed=SEEDS, t=TIMES)
def test_the_velocity_of_the_sliding_point_is_j_v_and_the_drift(seed, t):
    measure, q, carriers = sliding(seed)
    tips = Tips([UR5, PANDA])

    def point(t: float) -> np.ndarray:
        (p, _), R, *_ = tips.poses(q(t), q.dot(t))
        return p + np.matvec(R, [carrier.frame.position(t).x for carrier in carriers])

    R = tips.poses(q(t), q.dot(t))[1]
    drift = np.matvec(R, [carrier.frame.position(t).x_dot for carrier in carriers])
    np.testing.assert_allclose(derivative(point, t), measure(t).x_dot[:, :3] + drift, atol=1e-8)


@settings(max_examples=10)
@given(seed=SEEDS, t=TIMES)
def test_a_sliding_point_makes_no_arm_singular_and_none_regular(seed, t):
    measure = sliding(seed)[0]
    slid, still = (measure(t, frames).J[0] for frames in (1.0, 0.0))
    assert not np.allclose(slid, still)
    assert np.linalg.det(slid[:, :6]) == pytest.approx(np.linalg.det(still[:, :6]), rel=1e-9, abs=1e-12)


@settings(max_examples=5)
@given(seed=SEEDS, t=TIMES)
def test_where_nothing_slides_all_is_as_in_pose_space(seed, t):
    measure, q, carriers = sliding(seed)
    desired = np.stack([np.stack(carrier(t)) for carrier in carriers], axis=1)
    plain = PoseSpace().bind([UR5, PANDA]).measure(np.stack((q(t), q.dot(t))), desired)
    task = measure(t, frames=0.0)
    for name in ("motion", "error", "rates", "J", "J_dot", "J_inv"):
        np.testing.assert_allclose(getattr(task, name), getattr(plain, name), atol=1e-13)
    assert not SlidingSpace().further(desired_flow(np.random.default_rng(0), 6), np.zeros(3)).any()


def test_a_desired_motion_that_does_not_say_what_slides_is_refused():
    q = np.ones((2, 2, 6))
    with refused(InputError, "desired motion of a sliding point", found="3 rows"):
        SlidingSpace().bind([UR5, UR5]).measure(q, np.zeros((3, 2, 6)))


@pytest.mark.parametrize("kind", [Carrier, Rider])
def test_what_carries_or_rides_has_two_poses(kind):
    pose, other = PoseTrajectory(Hold([0.0, 0.0, 0.0])), Hold([0.0] * 6)
    with refused(InputError, "body"):
        kind(other, pose)
    with refused(InputError, "frame"):
        kind(pose, other)
    assert kind(pose, pose).breaks == ()
