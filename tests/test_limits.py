"""Limits of the robots' descriptions: leaving them is reported, and torque is cut off on request."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from synctrl import Cell, Coupling, Cubic, Experiment, Gains, Member, Result, Robot, load_robot
from synctrl.robots.documents import planar_arm
from synctrl.robots.mechanism import joint_limits
from synctrl.robots.urdf import describe
from synctrl.robots.urdf.document import Limit
from synctrl.simulation.limits import applied_torque, limit_report

TORQUE, SPEED, RANGE = 2.0, 1.5, (-0.2, 0.9)
GAINS = Gains(Lambda=8.0, beta=4.0, K_r=0.5, K_eps=2.0, Gamma=0.05)


def arm(torque: float = TORQUE, speed: float = SPEED) -> Robot:
    """Three rods with narrow limits; the last joint turns without end."""
    document = planar_arm([0.4, 0.3, 0.2], [2.0, 1.0, 1.0])
    limit = Limit(torque, speed, *RANGE)
    joints = [replace(j, limit=limit) if j.moves else j for j in document.joints]
    joints[2] = replace(joints[2], type="continuous", limit=Limit(torque, speed))
    description = describe(replace(document, joints=tuple(joints)))
    return Robot(description.model, description.tip, document=description.document)


def pair(robot: Robot, saturate: bool = False) -> Experiment:
    """Two arms that move a radian in half a second, more than they are made for."""
    path = Cubic([0.0, 0.2, 0.0], [1.0, 0.8, 1.5], 0.5)
    members = [Member(robot, path, theta_hat0=(0.4 + 0.2 * i) * robot.inertial_parameters) for i in range(2)]
    return Experiment(Cell(members, Coupling.pair()), GAINS, 0.6, saturate=saturate)


def test_the_limits_of_a_robot_are_those_of_its_document() -> None:
    robot = arm()
    limits = joint_limits(robot)
    np.testing.assert_array_equal(limits.lower, [RANGE[0], RANGE[0], -np.inf])
    np.testing.assert_array_equal(limits.upper, [RANGE[1], RANGE[1], np.inf])
    np.testing.assert_array_equal(limits.velocity, SPEED)
    np.testing.assert_array_equal(limits.torque, TORQUE)


@pytest.mark.parametrize("name", ["a460_full", "ur5", "panda", "kinova"])
def test_limits_are_in_the_order_of_the_joints(name: str) -> None:
    robot = load_robot(name)
    limits = joint_limits(robot)
    joints = {joint.name: joint for joint in robot.document.moving_joints}
    for k, joint in enumerate(joints[name] for name in robot.joint_names):
        assert limits.torque[k] == joint.limit.effort
        assert limits.velocity[k] == joint.limit.velocity
        if joint.type == "continuous":
            assert (limits.lower[k], limits.upper[k]) == (-np.inf, np.inf)
        else:
            assert (limits.lower[k], limits.upper[k]) == (joint.limit.lower, joint.limit.upper)


def outside(result: Result, kind: str, robot: int, joint: int) -> np.ndarray:
    """Whether a joint is outside a limit at every logged instant, (T,)."""
    limits = joint_limits(arm())
    if kind == "position":
        q = result.q[:, robot, joint]
        return (q < limits.lower[joint]) | (q > limits.upper[joint])
    values, limit = {"velocity": (result.v, SPEED), "torque": (result.tau, TORQUE)}[kind]
    return np.abs(values[:, robot, joint]) > limit


@pytest.mark.parametrize("options", [{}, {"engine": "compiled"}])
def test_every_instant_outside_a_limit_is_in_a_reported_interval_and_no_other(options: dict) -> None:
    result = pair(arm()).simulate(**options)
    reported = result.info["limits"]
    assert {entry["kind"] for entry in reported} == {"position", "velocity", "torque"}
    for kind in ("position", "velocity", "torque"):
        for robot in range(2):
            for joint in range(3):
                inside = np.zeros(len(result.t), dtype=bool)
                for entry in reported:
                    if (entry["kind"], entry["robot"], entry["joint"]) == (kind, robot, joint):
                        inside |= (result.t >= entry["start"]) & (result.t <= entry["stop"])
                np.testing.assert_array_equal(inside, outside(result, kind, robot, joint))


def test_an_interval_says_which_limit_and_what_was_reached() -> None:
    cell = pair(arm()).cell
    t = np.arange(5.0)
    q = np.zeros((5, 2, 3))
    q[1:4, 1, 0] = (-0.3, -0.5, -0.25)
    q[3:, 0, 1] = 1.0
    still = np.zeros_like(q)
    position = {"kind": "position", "unit": "rad"}
    assert limit_report(cell, t, q, still, still) == [
        {**position, "robot": 1, "joint": 0, "start": 1, "stop": 3, "limit": -0.2, "reached": -0.5},
        {**position, "robot": 0, "joint": 1, "start": 3, "stop": 4, "limit": 0.9, "reached": 1.0},
    ]


def test_a_run_within_all_limits_reports_none() -> None:
    slow = Cubic([0.0, 0.2, 0.0], [0.1, 0.3, 0.1], 1.0)
    robot = arm(torque=100.0)
    members = [Member(robot, slow, theta_hat0=robot.inertial_parameters) for _ in range(2)]
    assert Experiment(Cell(members, Coupling.pair()), GAINS, 0.2).simulate().info["limits"] == []


def test_a_saturated_plant_accelerates_as_under_the_limits() -> None:
    experiment = pair(arm(), saturate=True)
    result = experiment.simulate(0.1)
    applied = applied_torque(result)
    assert np.abs(result.tau).max() > TORQUE
    np.testing.assert_array_equal(applied, np.clip(result.tau, -TORQUE, TORQUE))
    robot = experiment.cell.robots[0]
    k = int(np.abs(result.tau).max(axis=(1, 2))[1:-1].argmax()) + 1
    rate = (result.v[k + 1] - result.v[k - 1]) / (result.t[k + 1] - result.t[k - 1])
    for i in range(2):
        expected = robot.forward_dynamics(result.q[k, i], result.v[k, i], applied[k, i])
        unlimited = robot.forward_dynamics(result.q[k, i], result.v[k, i], result.tau[k, i])
        assert np.abs(rate[i] - expected).max() < 0.1 * np.abs(unlimited - expected).max()


@pytest.mark.parametrize("options", [{"control_period": 1e-3}, {"integrator": "RK45"}, {"plant": "mujoco"}])
def test_saturation_acts_however_the_run_is_made(options: dict) -> None:
    plain, cut = (pair(arm(), saturate).simulate(0.1, dt=1e-3, **options) for saturate in (False, True))
    expected = pair(arm(), saturate=True).simulate(0.1, dt=1e-3)
    effect = np.abs(plain.q - cut.q).max()
    assert effect > 1e-3
    assert np.abs(cut.q - expected.q).max() < 0.25 * effect


def test_saturation_that_is_never_reached_changes_nothing() -> None:
    strong = arm(torque=1e4)
    np.testing.assert_array_equal(
        pair(strong, saturate=True).simulate(0.1).q, pair(strong, saturate=False).simulate(0.1).q
    )


def test_without_saturation_the_applied_torque_is_the_commanded_one() -> None:
    result = pair(arm()).simulate(0.1)
    np.testing.assert_array_equal(applied_torque(result), result.tau)


def test_the_report_survives_saving(tmp_path) -> None:
    result = pair(arm(), saturate=True).simulate(0.1)
    loaded = Result.load(result.save(tmp_path / "run.npz"))
    assert loaded.info["limits"] == result.info["limits"] != []
    np.testing.assert_array_equal(applied_torque(loaded), applied_torque(result))
