"""Where the tips of many robots with one mechanism are, each in a state of its own: numbers side by side.

Pinocchio passes one robot, or one forest, per call. Where thousands of equal robots are asked at once, each
operation of numpy serves all of them, and no model and no scratch memory of theirs is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .mechanism import Mechanism, MechanismJoint


class TipPlaces(NamedTuple):
    """Positions, (k, 3), and rotations, (k, 3, 3), of tips, and their Jacobians, (k, 6, nv), in world axes.

    The Jacobians are those of the linear velocity, then of the angular one.
    """

    position: np.ndarray
    rotation: np.ndarray
    jacobian: np.ndarray


def tip_places(fixed: Mechanism, rotation: np.ndarray, position: np.ndarray, q: np.ndarray) -> TipPlaces:
    """Places of the tips of k robots with one mechanism.

    Args:
        fixed: their mechanism.
        rotation, position: of the placement of the first joint of each, (k, 3, 3) and (k, 3), m.
        q: joint positions, (k, nv).
    """
    frames: list[tuple[np.ndarray, np.ndarray]] = []
    for joint, angle in zip(fixed.joints, q.T, strict=True):
        R, p = frames[joint.parent] if joint.parent >= 0 else (rotation, position)
        p, R = p + R @ joint.translation, R @ joint.rotation
        if joint.turns:
            R = R @ _turned(joint.axis, angle)
        else:
            p = p + (R @ joint.axis) * angle[:, None]
        frames.append((R, p))
    R, p = frames[fixed.tip_parent]
    tip, J = p + R @ fixed.tip_translation, np.zeros((len(q), 6, q.shape[1]))
    k = fixed.tip_parent
    while k >= 0:  # from the tip to the base: other joints do not move it
        _fill(J[..., k], fixed.joints[k], *frames[k], tip)
        k = fixed.joints[k].parent
    return TipPlaces(tip, R @ fixed.tip_rotation, J)


def _turned(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about one axis, (3,), by angles, (k,): (k, 3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1 - c) * (K @ K)


def _fill(column: np.ndarray, joint: MechanismJoint, R: np.ndarray, p: np.ndarray, tip: np.ndarray) -> None:
    """Write how a joint at p moves a tip into a column of its Jacobian, (k, 6)."""
    axis = R @ joint.axis
    if joint.turns:
        column[:, :3], column[:, 3:] = np.cross(axis, tip - p), axis
    else:
        column[:, :3] = axis
