"""The paper's cells in motion: four planar arms, and two A460 with their payload."""

from __future__ import annotations

import numpy as np

from ..checks import positive_number
from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .scene import Scene
from .style import robot_color

GOOD, BAD = np.array([0.10, 0.62, 0.35]), np.array([0.80, 0.10, 0.10])
LINE = 0.004  # m
THIN, THICK = 0.006, 0.022  # m, radius of a bar without and with the largest synchronization error
PAYLOAD = (0.5, 0.08, 0.05)  # m
FPS = 30.0


def planar_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Planar arms with their desired paths, and a bar between the tips of every pair that is compared.

    A bar grows and turns from green to red with the synchronization error of its pair.

    Args:
        result: a run in Cartesian space along x and y.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run. Animations that are
            compared share it.
        fps: frames per second.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    if result.x.shape[2] != 2:
        raise InputError(f"result: expected tips along x and y, found {result.x.shape[2]} coordinates")
    share, limit = _share(result, limit)
    caption = (
        "Lines: desired paths. Bars between neighbouring tips grow and turn red with their synchronization "
        f"error; fully red from {limit:.2g} {result.unit('sync_error')}."
    )
    frames = _frames(result, fps)
    scene, height = _robots(result, experiment, frames, fps, caption)
    tips = _with_height(result.x[frames], height)
    for i, name in enumerate(result.names):
        path = _with_height(result.x_desired[frames, i], height)
        scene.add_line(f"desired path of {name}", path, robot_color(i), LINE)
        scene.add_sphere(f"tip of {name}", 0.02, tips[:, i], robot_color(i))
        scene.add_legend(name, robot_color(i))
    for k, (a, b) in enumerate(result.info["pairs"]):
        color, radius = _bar(share[frames, k])
        scene.add_segment(f"error {k + 1}", tips[:, a], tips[:, b], radius, color)
    return scene


def payload_pair_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Two arms that carry a level payload between their wrists.

    The payload is drawn, not simulated: a box midway between the wrists and along the line through them. It
    turns from green to red with the synchronization error.

    Args:
        result: a run of two robots.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run.
        fps: frames per second.

    Raises:
        InputError: a run of another number of robots, or one without its experiment.
    """
    if result.x.shape[1] != 2:
        raise InputError(f"result: expected two robots, found {result.x.shape[1]}")
    share, limit = _share(result, limit)
    shown, scale = (np.rad2deg(limit), "deg") if result.unit("sync_error") == "rad" else (limit, "")
    caption = (
        "The payload is drawn, not simulated. It turns red with the synchronization error; fully red from "
        f"{shown:.2g} {scale}."
    )
    frames = _frames(result, fps)
    scene, _ = _robots(result, experiment, frames, fps, caption)
    robots = _experiment(result, experiment).cell.robots
    wrists = [
        np.array([robot.tip_position(q) for q in result.q[frames, i, : robot.nv]])
        for i, robot in enumerate(robots)
    ]
    for i, name in enumerate(result.names):
        scene.add_line(f"path of {name}", wrists[i], robot_color(i), LINE)
        scene.add_legend(name, robot_color(i))
    middle, along = 0.5 * (wrists[0] + wrists[1]), wrists[1] - wrists[0]
    color, _ = _bar(share[frames].max(axis=1))
    scene.add_box("payload", PAYLOAD, middle, color, quaternion=_turned(along))
    return scene


def _experiment(result: Result, experiment: Experiment | None) -> Experiment:
    found = experiment or result.experiment
    if found is None:
        raise InputError("experiment: expected the one that made this result, which was loaded from a file")
    return found


def _robots(
    result: Result, experiment: Experiment | None, frames: np.ndarray, fps: float, caption: str
) -> tuple[Scene, float]:
    """A scene with the robots, and the height of the first one's tip."""
    scene = Scene(fps=fps, title=str(result.info["title"]), caption=caption)
    robots = _experiment(result, experiment).cell.robots
    for i, robot in enumerate(robots):
        if robot.visual is None:
            raise InputError(f"robot '{robot.name}' has no shapes to show")
        q = np.array([robot.configuration(row) for row in result.q[frames, i, : robot.nv]])
        scene.add_robot(result.names[i], robot.model, robot.visual, q)
    return scene, float(robots[0].tip_position(result.q[0, 0, : robots[0].nv])[2])


def _frames(result: Result, fps: float) -> np.ndarray:
    """Indices of the instants that are shown."""
    times = np.arange(0.0, result.t[-1], 1 / positive_number("fps", fps))
    return np.clip(np.searchsorted(result.t, times), 0, len(result.t) - 1)


def _share(result: Result, limit: float | None) -> tuple[np.ndarray, float]:
    """Size of every synchronization error as a share of the limit, (T, p), and the limit."""
    size = np.linalg.norm(result.sync_error, axis=2)
    limit = float(size.max()) or 1.0 if limit is None else positive_number("limit", limit)
    return np.clip(size / limit, 0, 1), limit


def _bar(share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Colour, (T, 3), and radius, (T,), of a mark for an error from 0 to 1."""
    return GOOD + share[:, None] * (BAD - GOOD), THIN + share * (THICK - THIN)


def _with_height(xy: np.ndarray, z: float) -> np.ndarray:
    return np.concatenate([xy, np.full((*xy.shape[:-1], 1), z)], axis=-1)


def _turned(along: np.ndarray) -> np.ndarray:
    """Quaternions x, y, z, w, (T, 4), that turn the x axis along a direction, (T, 3), by the shortest way."""
    direction = along / np.linalg.norm(along, axis=1, keepdims=True)
    x = np.broadcast_to([1.0, 0.0, 0.0], direction.shape)
    quaternion = np.column_stack([np.cross(x, direction), 1 + (x * direction).sum(axis=1)])
    return quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
