"""Robots without shapes: capsules from joint to joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from ..robots.model import SLIDES, subspace
from ..robots.robot import Robot
from ..tasks.rotations import from_quaternion
from .colors import ColorLike, read_color
from .rotations import towards

#: radius of a link and of a joint, and half the length of a rod that slides, as shares of the robot's reach
LINK, JOINT, ROD = 0.03, 0.045, 0.4
#: what a robot of no extent is drawn as large as, m
SMALLEST = 0.2


def skeleton(robot: Robot, color: ColorLike) -> pin.GeometryModel:
    """Shapes of a robot that has none: balls where joints turn, rods where they slide, capsules between."""
    shapes, size = pin.GeometryModel(), max(reach(robot), SMALLEST)
    rgba = np.array(read_color("color", color))
    for k, (joint, placement, geometry) in enumerate(_parts(robot, size)):
        part = pin.GeometryObject(f"part {k + 1}", joint, 0, placement, geometry)
        part.meshColor = rgba
        shapes.addGeometryObject(part)
    return shapes


def reach(robot: Robot) -> float:
    """How far a robot reaches from its first joint at most, m; slides count as at 0."""
    return float(sum(np.linalg.norm(way) for joint, way in _ways(robot) if joint))


def _parts(robot: Robot, size: float) -> Iterator[tuple[int, pin.SE3, object]]:
    import coal

    for joint, unit in enumerate(robot.joint_units, start=1):
        yield joint, pin.SE3.Identity(), coal.Sphere(JOINT * size)
        if unit == SLIDES:
            rod = ROD * size * subspace(robot.model, joint)[:3]
            yield joint, _along(-rod, rod), coal.Cylinder(0.4 * LINK * size, 2 * ROD * size)
    for joint, way in _ways(robot):
        if joint and np.linalg.norm(way) > 0:
            yield joint, _along(np.zeros(3), way), coal.Capsule(LINK * size, float(np.linalg.norm(way)))


def _ways(robot: Robot) -> Iterator[tuple[int, np.ndarray]]:
    """A joint, and the way from its origin to that of a next one, or to the tip, in its frame, m."""
    model = robot.model
    for child in range(1, model.njoints):
        yield model.parents[child], model.jointPlacements[child].translation
    tip = model.frames[robot.tip_id]
    yield tip.parentJoint, tip.placement.translation


def _along(start: np.ndarray, end: np.ndarray) -> pin.SE3:
    """The frame midway between two points whose z axis leads from one to the other."""
    R = from_quaternion(towards((end - start)[None]))[0]
    return pin.SE3(R, 0.5 * (start + end))
