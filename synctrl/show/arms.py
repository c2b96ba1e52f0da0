"""What animations of arms have in common: the arms, and marks that redden with synchronization errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .runs import shown_experiment
from .scene import Scene
from .style import robot_color

#: colours of a mark without and with the largest synchronization error, told apart by lightness too
CALM, ALARM = np.array([0.76, 0.79, 0.83]), np.array([0.70, 0.0, 0.11])


def arms_scene(
    result: Result,
    experiment: Experiment | None,
    frames: np.ndarray,
    fps: float,
    caption: str,
    colors: Sequence[str] | None = None,
) -> Scene:
    """A scene with the arms of a run.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.
        frames: indices of the logged instants that are shown.
        fps: frames per second.
        caption: a line below the title.
        colors: one for each arm; by default those of its parts.

    Raises:
        InputError: no experiment, or a robot without shapes.
    """
    title = str(result.info["title"])
    scene = Scene(fps=fps, title=title[:1].upper() + title[1:], caption=caption)
    for i, robot in enumerate(shown_experiment(result, experiment).cell.robots):
        if robot.visual is None:
            raise InputError(f"robot '{robot.name}' has no shapes to show")
        q = np.array([robot.configuration(row) for row in result.q[frames, i, : robot.nv]])
        color = None if colors is None else colors[i]
        scene.add_robot(result.names[i], robot.model, robot.visual, q, color)
        scene.add_legend(result.names[i], robot_color(i))
        if robot.document is not None:
            scene.add_hidden(result.names[i], (mesh.filename or "" for mesh in robot.document.hidden))
    return scene


def add_bars(
    scene: Scene,
    name: str,
    compared: Sequence[Sequence[int]],
    tips: np.ndarray,
    radii: np.ndarray,
    share: np.ndarray,
) -> None:
    """Bars between the tips of robots that are compared, which redden with the synchronization error.

    Two robots have one bar from tip to tip. More than two that are compared all at once, as by
    `Coupling.sum`, have one each, from the middle of their tips.

    Args:
        scene: where they are added.
        name: of the bars, to which their numbers are added.
        compared: the robots of each of p synchronization errors, counted from 0.
        tips: positions of the tips, (T, n, 3), m.
        radii: of the bars of each error over time, (T, p), m.
        share: the errors from 0, no error, to 1, fully red, (T, p).
    """
    for k, robots in enumerate(compared):
        bars = {f"{name} {k + 1}": (tips[:, robots[0]], tips[:, robots[-1]])}
        if len(robots) > 2:
            middle = tips[:, robots].mean(axis=1)
            bars = {f"{name} {k + 1}, robot {i + 1}": (middle, tips[:, i]) for i in robots}
        for bar, (start, end) in bars.items():
            scene.add_segment(bar, start, end, radii[:, k], error_color(share[:, k]))


def error_color(share: np.ndarray) -> np.ndarray:
    """Colours, (..., 3), of marks for errors from 0 to 1, (...)."""
    return CALM + share[..., None] * (ALARM - CALM)
