"""One robot as it was read: a scene to turn, and a picture with its joints named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..robots.mechanism import joint_limits
from ..robots.model import SLIDES, joint_poses, subspace
from ..robots.robot import Robot
from .arms import SMALLEST, has_shapes, reach, skeleton
from .legends import plain
from .meshes import MeshLibrary
from .plots import new_figure, style
from .raster import picture, triangles_of
from .scene import Scene
from .style import ACCENT, robot_color

if TYPE_CHECKING:
    import pinocchio as pin
    from matplotlib.figure import Figure

#: of the picture, inches and pixels per inch
WIDTH, HEIGHT, DPI = 6.4, 4.8, 120
#: from where it is seen, degrees: around and above
AROUND, ABOVE = 35.0, 20.0
#: the share of the width that the robot has, and that of the height; names stand beside it
ROOM, TALL = 0.68, 0.9
#: length of an axis and radius of its line in the scene, as shares of the reach
AXIS, LINE = 0.22, 0.006
#: colour of the axes
JOINTS = "#0072b2"


def middle(robot: Robot) -> np.ndarray:
    """Joint positions in the middle of every range, 0 where there is none, (nv,), rad or m."""
    limits = joint_limits(robot)
    known = np.isfinite(limits.lower) & np.isfinite(limits.upper)
    return 0.5 * np.where(known, limits.lower, 0.0) + 0.5 * np.where(known, limits.upper, 0.0)


def robot_scene(robot: Robot, q: ArrayLike | None = None) -> Scene:
    """A robot at joint positions q, (nv,), by default the middle of their ranges, with its joints' axes.

    Raises:
        InputError: q of another size.
    """
    q = middle(robot) if q is None else finite_array("q", q, (robot.nv,))
    scene = Scene(title=robot.name, caption=_caption(robot))
    scene.add_robot(robot.name, robot.model, _visual(robot), robot.configuration(q))
    if robot.document is not None:
        scene.add_hidden(robot.name, (mesh.filename or "" for mesh in robot.document.hidden))
    size = max(reach(robot), SMALLEST)
    for name, ends in zip(robot.joint_names, _lines(robot, q), strict=True):
        scene.add_line(f"axis of {name}", ends, JOINTS, LINE * size)
    scene.add_sphere(f"tip: {robot.tip}", 0.02 * size, robot.tip_position(q), ACCENT)
    scene.add_legend("axes of joints", JOINTS)
    scene.add_legend(f"tip: {robot.tip}", ACCENT)
    return scene


def _caption(robot: Robot) -> str:
    words = f"{robot.nv} joints, tip {robot.tip}; joints are in the middle of their ranges."
    return words if has_shapes(robot) else f"{words} Without shapes that can be shown, as plain links."


def _visual(robot: Robot) -> pin.GeometryModel:
    return robot.visual if has_shapes(robot) else skeleton(robot, robot_color(0))


def _lines(robot: Robot, q: np.ndarray) -> np.ndarray:
    """The two ends of what is drawn as the axis of every joint, (nv, 2, 3), in the world, m."""
    half = 0.5 * AXIS * max(reach(robot), SMALLEST)
    poses = joint_poses(robot.model, robot.configuration(q)[None])[0]
    found = []
    for k in range(1, robot.model.njoints):
        motion = subspace(robot.model, k)
        own = motion[3:] if np.any(motion[3:]) else motion[:3]
        axis = half * _turned(poses[k, 3:], own)
        found.append((poses[k, :3] - axis, poses[k, :3] + axis))
    return np.array(found)


def _turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A vector turned by a quaternion x y z w, (3,)."""
    twice = 2 * np.cross(quaternion[:3], vector)
    return vector + quaternion[3] * twice + np.cross(quaternion[:3], twice)


# -- the picture -------------------------------------------------------------------------------------------


def robot_picture(robot: Robot, q: ArrayLike | None = None) -> Figure:
    """A figure of a robot at joint positions q, (nv,), by default the middle of their ranges.

    Joints have their axes and names; a ball is the tip.

    Raises:
        InputError: q of another size.
        RobotError: a shape cannot be drawn.
    """
    q = middle(robot) if q is None else finite_array("q", q, (robot.nv,))
    triangles, colors = _surface(robot, q)
    lines = _lines(robot, q)
    view = _View(np.concatenate([triangles.reshape(-1, 3), lines.reshape(-1, 3)]))
    width, height = int(WIDTH * DPI), int(HEIGHT * DPI)
    made = picture(view.seen(triangles), colors, width, height)
    with style():
        figure, axes = new_figure(HEIGHT, width=WIDTH)
        figure.set_layout_engine("none")
        figure.set_dpi(DPI)
        panel = axes[0, 0]
        panel.set_position((0, 0, 1, 1))
        panel.set_axis_off()
        panel.imshow(made, extent=(0, width, 0, height), interpolation="none")
        panel.set_xlim(0, width)
        panel.set_ylim(0, height)
        _mark(panel, robot, lines, view.seen(robot.tip_position(q)), view)
        panel.text(0.02 * width, 0.96 * height, plain(robot.name), fontsize=11, va="top", fontweight="bold")
    return figure


class _View:
    """How the world is seen: all of some points, (k, 3), m, in the left part of the picture."""

    def __init__(self, points: np.ndarray):
        around, above = np.radians([AROUND, ABOVE])
        right = np.array([-np.sin(around), np.cos(around), 0.0])
        out = np.array([np.cos(around) * np.cos(above), np.sin(around) * np.cos(above), np.sin(above)])
        self._axes = np.array([right, np.cross(out, right), out])
        flat = points @ self._axes.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        width, height = WIDTH * DPI, HEIGHT * DPI
        spans = np.maximum(high - low, 1e-6)
        self.scale = float(min(ROOM * width / spans[0], TALL * height / spans[1]))
        place = np.array([0.03 + ROOM / 2, 0.5]) * (width, height)
        self._shift = np.append(place - self.scale * (low + high)[:2] / 2, 0.0)

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Pixels to the right, pixels up, and depth, of points, (..., 3), m."""
        return self.scale * (points @ self._axes.T) + self._shift


def _surface(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of a robot in the world, (f, 3, 3), m, and their colours, (f, 3)."""
    poses, meshes = joint_poses(robot.model, robot.configuration(q)[None])[0], MeshLibrary()
    triangles, colors = [np.zeros((0, 3, 3))], [np.zeros((0, 3))]
    for geometry in _visual(robot).geometryObjects:
        pose = poses[geometry.parentJoint]
        for solid in meshes.shapes(geometry):
            corners = triangles_of(solid)
            triangles.append(_turned_all(pose[3:], corners) + pose[:3])
            colors.append(np.tile(solid.color[:3], (len(corners), 1)))
    return np.concatenate(triangles), np.concatenate(colors)


def _turned_all(quaternion: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points turned by a quaternion x y z w, (..., 3)."""
    matrix = np.array([_turned(quaternion, unit) for unit in np.eye(3)]).T
    return points @ matrix.T


def _mark(panel: Any, robot: Robot, lines: np.ndarray, tip: np.ndarray, view: _View) -> None:
    """The axes of the joints and the tip, with their names."""
    ends = view.seen(lines)[..., :2]
    for line in ends:
        panel.plot(*line.T, color=JOINTS, lw=1.2, solid_capstyle="round")
    panel.plot(*tip[:2], "o", color=ACCENT, ms=5)
    slides = [unit == SLIDES for unit in robot.joint_units]
    names = [f"{name}{' (slides)' * s}" for name, s in zip(robot.joint_names, slides, strict=True)]
    points = np.array([*ends.mean(axis=1), tip[:2]])
    _name(panel, [*names, f"tip: {robot.tip}"], points, [*[JOINTS] * len(names), ACCENT])


def _name(panel: Any, names: Sequence[str], points: np.ndarray, colors: Sequence[str]) -> None:
    """Names in a column on the right, each with a line to what it names."""
    width, height = WIDTH * DPI, HEIGHT * DPI
    order = np.argsort(-points[:, 1], kind="stable")
    gap = min(0.07, 0.84 / max(len(names) - 1, 1))
    heights = 0.5 + gap * (0.5 * (len(names) - 1) - np.arange(len(names)))
    for k, y in zip(order, heights * height, strict=True):
        x = 0.75 * width
        panel.plot([points[k, 0], x - 6], [points[k, 1], y], color=colors[k], lw=0.5, alpha=0.6)
        short = names[k] if len(names[k]) <= 30 else f"{names[k][:29]}…"
        panel.text(x, y, plain(short), va="center", fontsize=7.5, color=colors[k])
