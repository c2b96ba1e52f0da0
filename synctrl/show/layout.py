"""Figure 8: arms in the plane, seen from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..robots.robot import Robot
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .plots import new_figure, style
from .style import DESIRED, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def cell_layout(result: Result, experiment: Experiment | None = None) -> Figure:
    """Arms at the start (pale) and at the end of a run, their desired paths, and the distances they keep.

    Args:
        result: a run in Cartesian space along x and y.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    experiment = experiment or result.experiment
    if experiment is None or result.x.shape[2] != 2:
        raise InputError("result: expected a planar run with its experiment, found another or none")
    with style():
        figure, panels = new_figure(5.6)
        panel = panels[0, 0]
        for i, robot in enumerate(experiment.cell.robots):
            _draw_arm(panel, robot, result.q[0, i], i, alpha=0.25)
            _draw_arm(panel, robot, result.q[-1, i], i, alpha=1.0)
            panel.plot(*result.x_desired[:, i].T, color=DESIRED, linewidth=1.0, linestyle="-.")
            _name_arm(panel, robot, result, i)
        for i, j in result.info["pairs"]:
            _draw_distance(panel, result.x[-1, i], result.x[-1, j])
        panel.plot([], [], color=DESIRED, linewidth=1.0, linestyle="-.", label="desired paths")
        panel.plot([], [], color="#8a929c", linewidth=0.8, label="distances at the end")
        panel.set(aspect="equal", xlabel="x, m", ylabel="y, m")
        panel.margins(0.08)
        figure.legend(loc="outside upper right", ncols=2)
    return figure


def _draw_arm(panel: Axes, robot: Robot, q: np.ndarray, index: int, alpha: float) -> None:
    """Base, joints and tip as a line."""
    points = _chain(robot, q)
    color = robot_color(index)
    panel.plot(points[:, 0], points[:, 1], "-", color=color, linewidth=5, alpha=0.6 * alpha)
    panel.plot(points[:-1, 0], points[:-1, 1], "o", color=color, markersize=6, alpha=alpha)
    panel.plot(*points[0, :2], "s", color="#4a525c", markersize=9, alpha=alpha, zorder=1)
    panel.plot(*points[-1, :2], "o", color="white", markeredgecolor=color, markersize=5, alpha=alpha)


def _chain(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Origins of the joints, and the tip, (nv + 1, 3)."""
    joints = [robot.with_tip(name).tip_position(q) for name in robot.joint_names]
    return np.array([*joints, robot.tip_position(q)])


def _name_arm(panel: Axes, robot: Robot, result: Result, i: int) -> None:
    x, y, _ = _chain(robot, result.q[0, i])[0]
    panel.annotate(
        result.names[i], (x, y), (0, -14), textcoords="offset points", ha="center", color=robot_color(i)
    )


def _draw_distance(panel: Axes, a: np.ndarray, b: np.ndarray) -> None:
    """A thin line with its length, written where the arms leave room for it."""
    panel.plot(*np.array([a, b]).T, color="#8a929c", linewidth=0.8, zorder=0)
    low, high = sorted((a, b), key=lambda point: point[1])
    steep = abs(high[1] - low[1]) > abs(high[0] - low[0])
    place = low + (0.22 if steep else 0.5) * (high - low)
    box = {"fc": "white", "ec": "none", "pad": 1.5}
    panel.annotate(f"{np.linalg.norm(a - b):.3f} m", place, ha="center", va="center", fontsize=8, bbox=box)
