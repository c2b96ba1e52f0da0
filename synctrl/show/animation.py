"""The paper's cells in motion: four planar arms, and two A460 with their payload."""

from __future__ import annotations

import numpy as np

from ..checks import positive_number
from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .arms import add_bars, add_disturbances, arms_scene, error_color, tip_positions
from .runs import check_run, frame_indices, shown_experiment
from .scene import Scene
from .style import DESIRED, robot_color

LINE = 0.008  # m
THIN, THICK = 0.006, 0.022  # m, radius of a bar without and with the largest synchronization error
BALL = 0.016  # m, radius of a tip
PAYLOAD = (0.5, 0.08, 0.05)  # m
PLANAR_TIMES, PAIR_TIMES = 10.0, 20.0  # how much larger tracking errors are drawn
FPS = 30.0
#: arrays of a run that its scene is made of
DRAWN = "x", "x_desired", "sync_error", "q", "disturbance"


def planar_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Planar arms with their desired paths, and bars between the tips of robots that are compared.

    A bar grows and turns red with the synchronization error of its robots, see `add_bars`. A thin bar in the
    colour of its robot leads from where a tip should be to where it would be if its error were
    `PLANAR_TIMES` as large.

    Args:
        result: a run in Cartesian space along x and y.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run. Animations that are
            compared share it.
        fps: frames per second.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    if result.info["axes"] != ["x", "y"]:
        found = result.info["axes"]
        raise InputError(
            f"expected tips along x and y, found {', '.join(found)}", subject="result", found=found
        )
    share, limit = _share(result, limit)
    caption = (
        f"Bars between compared tips: synchronization error, thick and red from {_shown(result, limit)}. "
        f"Thin bars at the tips: tracking error, {PLANAR_TIMES:g} times as large. Dark lines: desired paths."
    )
    frames = frame_indices(result, fps)
    scene = arms_scene(
        result, experiment, frames, fps, caption, [robot_color(i) for i in range(len(result.names))]
    )
    robots = shown_experiment(result, experiment).cell.robots
    height = float(robots[0].tip_position(result.q[0, 0, : robots[0].nv])[2])
    tips, desired = (_with_height(x[frames], height) for x in (result.x, result.x_desired))
    shown = share[frames]
    add_bars(scene, "error", result.info["pairs"], tips, THIN + shown * (THICK - THIN), shown)
    _add_tracking(scene, result, desired, tips, PLANAR_TIMES)
    add_disturbances(scene, result, robots, frames)
    return scene


def payload_pair_scene(
    result: Result, experiment: Experiment | None = None, limit: float | None = None, fps: float = FPS
) -> Scene:
    """Two arms that carry a level payload between their wrists.

    The payload is drawn, not simulated: a box midway between the wrists and along the line through them. It
    turns red with the synchronization error. A thin bar in the colour of its robot leads from where a wrist
    should be to where it would be if its error were `PAIR_TIMES` as large.

    Args:
        result: a run of two robots in joint space.
        experiment: what made it; needed for a result loaded from a file.
        limit: synchronization error that is fully red; by default the largest of the run.
        fps: frames per second.

    Raises:
        InputError: a run of other robots or in another space, or one without its experiment.
    """
    check_run(result, *DRAWN)
    if result.x.shape[1] != 2 or result.info["task_unit"] != "rad":
        raise InputError(
            "expected two robots in joint space, found "
            f"{result.x.shape[1]} with coordinates in {result.info['task_unit']}",
            subject="result",
        )
    share, limit = _share(result, limit)
    caption = (
        f"The payload is drawn, not simulated; fully red from {_shown(result, limit)} of synchronization "
        f"error. Thin bars at the wrists: tracking error, {PAIR_TIMES:g} times as large. "
        "Dark lines: desired paths."
    )
    frames = frame_indices(result, fps)
    scene = arms_scene(result, experiment, frames, fps, caption)
    robots = shown_experiment(result, experiment).cell.robots
    wrists, desired = (tip_positions(robots, q[frames]) for q in (result.q, result.x_desired))
    color = error_color(share[frames].max(axis=1))
    middle, along = wrists.mean(axis=1), wrists[:, 1] - wrists[:, 0]
    scene.add_box("payload", PAYLOAD, middle, color, quaternion=_turned(along))
    _add_tracking(scene, result, desired, wrists, PAIR_TIMES)
    add_disturbances(scene, result, robots, frames)
    return scene


def _add_tracking(scene: Scene, result: Result, desired: np.ndarray, tips: np.ndarray, times: float) -> None:
    """Desired paths, and tracking errors drawn larger than they are; positions are (T, n, 3)."""
    for i, name in enumerate(result.names):
        scene.add_line(f"desired path of {name}", desired[:, i], DESIRED, LINE)
        far = desired[:, i] + times * (tips[:, i] - desired[:, i])
        scene.add_segment(f"error of {name}", desired[:, i], far, THIN, robot_color(i))
        scene.add_sphere(f"end of error of {name}", BALL, far, robot_color(i))


def _share(result: Result, limit: float | None) -> tuple[np.ndarray, float]:
    """Size of every synchronization error as a share of the limit, (T, p), and the limit."""
    size = np.linalg.norm(result.sync_error, axis=2)
    limit = float(size.max()) or 1.0 if limit is None else positive_number("limit", limit)
    return np.clip(size / limit, 0, 1), limit


def _shown(result: Result, size: float) -> str:
    """A synchronization error for the caption: degrees for rad, else its own unit."""
    unit = result.unit("sync_error")
    return f"{np.rad2deg(size):.2g} deg" if unit == "rad" else f"{size:.2g} {unit}"


def _with_height(xy: np.ndarray, z: float) -> np.ndarray:
    return np.concatenate([xy, np.full((*xy.shape[:-1], 1), z)], axis=-1)


def _turned(along: np.ndarray) -> np.ndarray:
    """Quaternions x, y, z, w, (T, 4), that turn the x axis along a direction, (T, 3), by the shortest way."""
    direction = along / np.linalg.norm(along, axis=1, keepdims=True)
    x = np.broadcast_to([1.0, 0.0, 0.0], direction.shape)
    quaternion = np.column_stack([np.cross(x, direction), 1 + (x * direction).sum(axis=1)])
    return quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
