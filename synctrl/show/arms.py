"""What animations of arms have in common: the arms, and the colours of marks that redden with an error."""

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
    return scene


def error_color(share: np.ndarray) -> np.ndarray:
    """Colours, (..., 3), of marks for errors from 0 to 1, (...)."""
    return CALM + share[..., None] * (ALARM - CALM)
