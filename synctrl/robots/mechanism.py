"""Mechanism: the numbers of a robot's model that do not change during a run, wherever it stands.

These numbers become constants of generated code, so robots that agree in them share it. Where a robot stands,
and what its bodies weigh, differs from robot to robot and is an input of the code. What its joints are made
for, their ranges, speeds and torques, is here too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from ..errors import RobotError
from ..renamed import names_elsewhere
from .model import subspace
from .robot import Robot

#: numbers this close to 0, 1 or -1 in fixed placements are taken as such, so that terms with them vanish
SNAP = 1e-15


@dataclass(frozen=True, eq=False)
class MechanismJoint:
    """One joint: parent body (-1: the base), fixed placement in it, axis, and whether it turns or slides."""

    parent: int
    rotation: np.ndarray
    translation: np.ndarray
    axis: np.ndarray
    turns: bool
    armature: float


@dataclass(frozen=True, eq=False)
class Mechanism:
    """What of a robot's model does not depend on where it stands."""

    joints: tuple[MechanismJoint, ...]
    tip_parent: int
    tip_translation: np.ndarray
    tip_rotation: np.ndarray

    @cached_property
    def name(self) -> str:
        """A text that is equal for equal mechanisms."""
        return repr(self.key())

    def key(self) -> list[Any]:
        """Plain data that is equal for equal mechanisms."""
        joints = [
            [j.parent, j.rotation.tolist(), j.translation.tolist(), j.axis.tolist(), j.turns, j.armature]
            for j in self.joints
        ]
        return [joints, self.tip_parent, self.tip_translation.tolist(), self.tip_rotation.tolist()]


def mechanism(robot: Robot) -> tuple[Mechanism, pin.SE3]:
    """A robot's mechanism, and the placement of its first joint in the world.

    Robots that were placed from one robot have one mechanism in common.

    Raises:
        RobotError: several joints on the base, or a tip on the base.
    """
    if "mechanism" not in robot.alike:
        robot.alike["mechanism"] = _mechanism(robot)
    fixed, first = robot.alike["mechanism"]
    if "base" not in robot.kept:
        base = robot.model.jointPlacements[first]
        robot.kept["base"] = pin.SE3(_snap(base.rotation), base.translation)
    return fixed, robot.kept["base"]


def _mechanism(robot: Robot) -> tuple[Mechanism, int]:
    """What does not depend on where a robot stands, and which joint is on its base."""
    model = robot.model
    tip = model.frames[robot.tip_id]
    roots = [j for j in range(1, model.njoints) if model.parents[j] == 0]
    if len(roots) != 1 or tip.parentJoint == 0:
        raise RobotError(
            "the compiled engine needs one joint on the base and a tip that moves, "
            f"found {len(roots)} joints on the base and tip '{robot.tip}'; use engine='pinocchio'",
            subject=f"robot '{robot.name}'",
            found=(len(roots), robot.tip),
        )
    joints = tuple(_joint(model, j, first=j == roots[0]) for j in range(1, model.njoints))
    placement = tip.placement
    fixed = Mechanism(joints, tip.parentJoint - 1, _snap(placement.translation), _snap(placement.rotation))
    return fixed, roots[0]


def _joint(model: pin.Model, j: int, first: bool) -> MechanismJoint:
    motion = subspace(model, j)
    turns = bool(np.any(motion[3:]))
    placement = pin.SE3.Identity() if first else model.jointPlacements[j]
    return MechanismJoint(
        model.parents[j] - 1,
        _snap(placement.rotation),
        _snap(placement.translation),
        _snap(motion[3:] if turns else motion[:3]),
        turns,
        float(model.armature[j - 1]),
    )


def _snap(values: np.ndarray) -> np.ndarray:
    values = np.array(values, dtype=float)
    for exact in (-1.0, 0.0, 1.0):
        values[np.abs(values - exact) < SNAP] = exact
    return values


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
    """The limits that a robot's description states; robots that were placed from one have them in common."""
    if "limits" not in robot.alike:
        robot.alike["limits"] = _joint_limits(robot)
    found: JointLimits = robot.alike["limits"]
    return found


def _joint_limits(robot: Robot) -> JointLimits:
    model = robot.model
    lower, upper = np.full((2, robot.nv), [[-np.inf], [np.inf]])
    for joint in model.joints[1:]:
        if joint.nq == 1:  # a joint that turns without end has two numbers, and no range
            lower[joint.idx_v] = model.lowerPositionLimit[joint.idx_q]
            upper[joint.idx_v] = model.upperPositionLimit[joint.idx_q]
    limits = (lower, upper, np.array(model.velocityLimit), np.array(model.effortLimit))
    found = [np.where(np.abs(x) < UNLIMITED, x, np.copysign(np.inf, x)) for x in limits]
    for array in found:
        array.flags.writeable = False
    return JointLimits(*found)


__getattr__ = names_elsewhere(__name__, ".mechanism", Joint="MechanismJoint")
