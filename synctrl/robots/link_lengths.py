"""Bounds of the tip's Jacobian and of its derivatives by lengths of links, for all joint positions at once.

A joint that turns moves the tip by its distance from the axis: at most that of the next joint from the axis,
and from there on all offsets from joint to joint. A joint that slides moves the tip by 1, and lengthens the
offset to the next one by as much as its limits allow. So, with the column J_k of joint k and j before k,

    |J_k| <= a_k,    |dJ_k/dq_j|, |dJ_j/dq_k|, |dJ_j/dq_j| <= a_k, a_k and a_j if joint j turns, else 0

because dJ_k/dq_j = z_j x J_k = dJ_j/dq_k with the axis z_j. Of axes, dz_k/dq_j = z_j x z_k alone is not 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .mechanism import joint_limits
from .model import subspace
from .robot import Robot


@dataclass(frozen=True, eq=False)
class ColumnBounds:
    """Bounds of a tip's Jacobian wherever the joints are; 0 for joints that do not move the tip.

    Attributes:
        linear: of the tip's velocity for each joint's, (nv,), m or 1; infinite before slides without limits.
        angular: of its angular velocity, (nv,), 1 for a joint that turns.
        bending: of the derivative along joint j of the linear column k, (nv, nv) with j the row.
        turning: the same for the angular columns.
    """

    linear: np.ndarray
    angular: np.ndarray
    bending: np.ndarray
    turning: np.ndarray


def column_bounds(robot: Robot, tool: float = 0.0) -> ColumnBounds:
    """Bounds of the Jacobian of a robot's tip.

    Args:
        robot: the robot.
        tool: the point that counts is up to so far from the tip, m.
    """
    (linear, angular), (bending, turning) = np.zeros((2, robot.nv)), np.zeros((2, robot.nv, robot.nv))
    chain, beyond = list(_chain(robot)), tool
    for k, axis, offsets in reversed(chain):
        angular[k] = float(axis.any())
        linear[k] = _longest(offsets - np.outer(offsets @ axis, axis)) + beyond if axis.any() else 1.0
        beyond += _longest(offsets)
    order = [k for k, _, _ in chain]
    for place, j in enumerate(order):
        later = order[place:]
        if angular[j]:
            bending[j, later] = bending[later, j] = linear[later]
            turning[j, later[1:]] = angular[later[1:]]
    return ColumnBounds(linear, angular, bending, turning)


def _chain(robot: Robot) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """From base to tip, each joint that moves it: its number, its axis, and the offset to what comes next.

    The axis is in the joint's frame, (3,), and 0 if it slides; so is the offset, (1 or 2, 3), the extremes of
    what it may be where the joint itself slides.
    """
    model, tip, limits = robot.model, robot.model.frames[robot.tip_id], joint_limits(robot)
    joints = list(model.supports[tip.parentJoint])[1:]
    for joint, following in zip(joints, [*joints[1:], 0], strict=True):
        place = model.jointPlacements[following] if following else tip.placement
        motion, k = subspace(model, joint), joint - 1
        slid = [limits.lower[k], limits.upper[k]] if motion[:3].any() else [0.0]
        with np.errstate(invalid="ignore"):  # 0 times infinity
            yield k, motion[3:], place.translation + np.outer(slid, motion[:3])


def _longest(offsets: np.ndarray) -> float:
    """Length of the longest of some vectors, (..., 3): of all between two, too, for a length is convex."""
    return float(np.linalg.norm(offsets, axis=-1).max()) if np.isfinite(offsets).all() else np.inf
