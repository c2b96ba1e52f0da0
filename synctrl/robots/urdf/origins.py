"""Where things stand in a URDF: `<origin>`, by roll, pitch and yaw, or since URDF 1.1 by a quaternion."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from .document import ZERO, Pose, Vector
from .xml import Element

FARTHEST = 1e6
"""In m: double precision places what is farther away to no better than a nanometre, and no arm is there."""
_UNIT = 1e-3


def read_origin(element: Element) -> Pose:
    """The placement that the `<origin>` of an element states; the identity without one.

    Raises:
        RobotError: numbers that are none, places beyond measure, or two orientations in one.
    """
    origin = element.optional("origin")
    if origin is None:
        return Pose()
    origin.know((), ("xyz", "rpy", "quat_xyzw"))
    xyz = origin.numbers("xyz", 3, ZERO)
    if max(map(abs, xyz)) > FARTHEST:
        origin.refuse(f"xyz of at most {FARTHEST:g} m", " ".join(f"{x:g}" for x in xyz))
    if "quat_xyzw" not in origin.attributes:
        return Pose(xyz, origin.numbers("rpy", 3, ZERO))
    if "rpy" in origin.attributes:
        origin.refuse("rpy or quat_xyzw", "both")
    return Pose(xyz, _turned(origin))


def _turned(origin: Element) -> Vector:
    """Roll, pitch and yaw of a quaternion."""
    quaternion = origin.numbers("quat_xyzw", 4)
    length = math.hypot(*quaternion)
    if length < _UNIT:
        origin.refuse("a quaternion of length 1", f"one of length {length:g}")
    if abs(length - 1) > _UNIT:
        origin.note("assumed", f"the quaternion has length {length:g}; its direction is taken")
    rotation = pin.Quaternion(*np.roll(np.array(quaternion) / length, 1)).matrix()
    return Pose.of(pin.SE3(rotation, np.zeros(3))).rpy
