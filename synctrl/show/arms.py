"""What scenes of arms have in common: arms, plain links, and marks that redden with their errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio as pin

from ..checks import positive_number
from ..robots.model import SLIDES, subspace
from ..robots.robot import Robot
from ..simulation.result import Result
from ..tasks.rotations import from_quaternion
from .meshes import MeshLibrary
from .nodes import towards
from .scene import Scene
from .style import ColorLike, read_color, robot_color

#: colour and radius, m, of the mark of a torque from outside
TORQUE, PUSH = "#e0a100", 0.075
#: colours of a mark without and with the largest synchronization error, told apart by lightness too
CALM, ALARM = np.array([0.76, 0.79, 0.83]), np.array([0.70, 0.0, 0.11])


#: radius of a link and of a joint, and half the length of a rod that slides, as shares of the robot's reach
LINK, JOINT, ROD = 0.03, 0.045, 0.4
#: what a robot of no extent is drawn as large as, m
SMALLEST = 0.2


def arms_scene(
    result: Result,
    robots: Sequence[Robot],
    frames: np.ndarray,
    fps: float,
    caption: str = "",
    colors: Sequence[str] | None = None,
    meshes: MeshLibrary | None = None,
) -> Scene:
    """A scene with the arms of a run; those without shapes as balls and capsules in the colour of the robot.

    Args:
        result: the run.
        robots: its robots.
        frames: indices of the logged instants that are shown.
        fps: frames per second.
        caption: a line below the title.
        colors: one for each arm; by default those of its parts.
        meshes: the mesh files that were read for other scenes.
    """
    title = str(result.info["title"])
    scene = Scene(fps=fps, title=title[:1].upper() + title[1:], caption=caption, meshes=meshes)
    for i, robot in enumerate(robots):
        q = np.array([robot.configuration(row) for row in result.q[frames, i, : robot.nv]])
        visual = robot.visual if has_shapes(robot) else skeleton(robot, robot_color(i))
        color = None if colors is None else colors[i]
        scene.add_robot(result.names[i], robot.model, visual, q, color)
        scene.add_legend(result.names[i], robot_color(i))
        if robot.document is not None:
            scene.add_hidden(result.names[i], (mesh.filename or "" for mesh in robot.document.hidden))
    return scene


def has_shapes(robot: Robot) -> bool:
    """Whether a robot has shapes to show."""
    return robot.visual is not None and robot.visual.ngeoms > 0


def add_disturbances(scene: Scene, result: Result, robots: Sequence[Robot], frames: np.ndarray) -> None:
    """A ball around the first joint of a robot while a torque acts on it from outside."""
    for i, name in enumerate(result.names):
        acts = np.abs(result.disturbance[:, i]).max(axis=1) > 0
        if acts.any():
            base = robots[i].model.jointPlacements[1].translation
            scene.add_sphere(f"torque on {name}", PUSH * acts[frames], base, TORQUE)
            scene.add_legend(f"torque on {name}", TORQUE)


def tip_positions(robots: Sequence[Robot], q: np.ndarray) -> np.ndarray:
    """Positions of the tips, (T, n, 3), m, of joint positions, (T, n, nv)."""
    return np.array(
        [[robot.tip_position(row[: robot.nv]) for robot, row in zip(robots, qs, strict=True)] for qs in q]
    )


def add_bars(
    scene: Scene,
    result: Result,
    name: str,
    robots: Sequence[int],
    tips: np.ndarray,
    radius: np.ndarray | float,
    color: np.ndarray,
) -> None:
    """Bars between the tips, (T, n, 3), m, of robots that are compared.

    Two robots have one bar from tip to tip. More than two that are compared all at once, as by
    `Coupling.sum`, have one each, from the middle of their tips.
    """
    start = tips[:, robots[0]] if len(robots) == 2 else tips[:, robots].mean(axis=1)
    for end in robots[1:] if len(robots) == 2 else robots:
        scene.add_segment(f"{name}, to {result.names[end]}", start, tips[:, end], radius, color)


def error_share(result: Result, limit: float | None) -> tuple[np.ndarray, float]:
    """Size of every synchronization error as a share of the limit, (T, p), and the limit."""
    size = np.linalg.norm(result.sync_error, axis=2)
    limit = float(size.max()) or 1.0 if limit is None else positive_number("limit", limit)
    return np.clip(size / limit, 0, 1), limit


def error_color(share: np.ndarray, calm: np.ndarray = CALM) -> np.ndarray:
    """Colours, (..., 3), of marks for errors from 0 to 1, (...)."""
    return calm + share[..., None] * (ALARM - calm)


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
