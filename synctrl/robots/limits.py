"""What a robot's joints are made for: ranges, speeds and torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .robot import Robot

#: models made by hand have such numbers where there is no limit
UNLIMITED = 1e300


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of the joints of one robot; infinite where there is none.

    Attributes:
        lower, upper: range of the positions, (nv,), rad or m; infinite for joints that turn without end.
        velocity: largest speed, (nv,), rad/s or m/s.
        torque: largest torque, (nv,), N·m or N.
    """

    lower: np.ndarray
    upper: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray


def joint_limits(robot: Robot) -> JointLimits:
    """The limits that a robot's description states."""
    model = robot.model
    lower, upper = np.full((2, robot.nv), [[-np.inf], [np.inf]])
    for joint in model.joints[1:]:
        if joint.nq == 1:  # a joint that turns without end has two numbers, and no range
            lower[joint.idx_v] = model.lowerPositionLimit[joint.idx_q]
            upper[joint.idx_v] = model.upperPositionLimit[joint.idx_q]
    limits = (lower, upper, np.array(model.velocityLimit), np.array(model.effortLimit))
    return JointLimits(*(np.where(np.abs(limit) < UNLIMITED, limit, _infinite(limit)) for limit in limits))


def _infinite(limit: np.ndarray) -> np.ndarray:
    return np.copysign(np.inf, limit)
