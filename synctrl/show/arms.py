"""What animations of arms have in common: the arms, and marks that redden with synchronization errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..robots.robot import Robot
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .runs import shown_experiment
from .scene import Scene
from .skeleton import skeleton
from .style import robot_color

#: colour and radius, m, of the mark of a torque from outside
TORQUE, PUSH = "#e0a100", 0.075
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
        InputError: no experiment.
    """
    scene = titled_scene(result, fps, caption)
    add_arms(scene, result, shown_experiment(result, experiment).cell.robots, frames, colors)
    return scene


def titled_scene(result: Result, fps: float, caption: str) -> Scene:
    """A scene with nothing in it, under the title of a run."""
    title = str(result.info["title"])
    return Scene(fps=fps, title=title[:1].upper() + title[1:], caption=caption)


def add_arms(
    scene: Scene,
    result: Result,
    robots: Sequence[Robot],
    frames: np.ndarray,
    colors: Sequence[str] | None = None,
) -> None:
    """The arms of a run; those without shapes as balls and capsules in the colour of the robot."""
    for i, robot in enumerate(robots):
        q = np.array([robot.configuration(row) for row in result.q[frames, i, : robot.nv]])
        visual = robot.visual if has_shapes(robot) else skeleton(robot, robot_color(i))
        color = None if colors is None else colors[i]
        scene.add_robot(result.names[i], robot.model, visual, q, color)
        scene.add_legend(result.names[i], robot_color(i))
        if robot.document is not None:
            scene.add_hidden(result.names[i], (mesh.filename or "" for mesh in robot.document.hidden))


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
