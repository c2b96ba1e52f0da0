"""Figure 8: arms in the plane, seen from above."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from ..robots.robot import Robot
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .legends import plain
from .plots import new_figure, style
from .runs import check_axes, check_run, shown_experiment
from .style import DESIRED, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SOFT = "#8a929c"
PALE = 0.28


def cell_layout(result: Result, experiment: Experiment | None = None) -> Figure:
    """Where the arms stand, how far they reach, what path each is given, and the distances they keep.

    Left, the circles about the origin on which the tips start; right, the arms at the start (pale) and at the
    end of the run.

    Args:
        result: a run in Cartesian space along x and y.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: a run in another space, or one without its experiment.
    """
    check_run(result, "x", "x_desired", "q")
    check_axes(result, "x", "y")
    experiment = shown_experiment(result, experiment)
    with style():
        figure, panels = new_figure(5.4, columns=2, width=8.8, gridspec_kw={"width_ratios": (0.4, 1.0)})
        _draw_surroundings(panels[0, 0], result)
        _draw_cell(panels[0, 1], result, experiment.cell.robots)
        figure.legend(loc="outside upper right", ncols=4)
    return figure


def _draw_surroundings(panel: Axes, result: Result) -> None:
    """The origin, the circles about it, and where on them the robots start."""
    start = result.x_desired[0]
    for radius in _radii(result):
        _draw_circle(panel, np.zeros(2), radius, color=DESIRED, linewidth=0.9, dashes=(6, 4))
        panel.annotate(f"{radius:.4g} m", (0, radius), (0, 4), textcoords="offset points", ha="center")
    for i, point in enumerate(start):
        panel.plot(*np.array([np.zeros(2), point]).T, color=SOFT, linewidth=0.7)
        panel.plot(*point, "o", color=robot_color(i), markersize=7)
    panel.plot(0, 0, "+", color=DESIRED, markersize=9)
    panel.annotate("origin", (0, 0), (6, -12), textcoords="offset points")
    _frame(panel, np.vstack([start, np.zeros((1, 2)), [[0, max(_radii(result))]]]), 0.6)
    panel.set_title("circles about the origin", loc="left")


def _draw_cell(panel: Axes, result: Result, robots: tuple[Robot, ...]) -> None:
    bases = []
    for i, robot in enumerate(robots):
        chain = _draw_arm(panel, robot, result.q[0, i, : robot.nv], i, PALE)
        _draw_arm(panel, robot, result.q[-1, i, : robot.nv], i, 1.0)
        base, reach = chain[0], np.linalg.norm(np.diff(chain, axis=0), axis=1).sum()
        _draw_circle(panel, base, reach, color=robot_color(i), linewidth=0.9, linestyle=":")
        panel.plot(*result.x_desired[:, i].T, color="black", linewidth=2.0, zorder=4)
        look: Any = {"textcoords": "offset points", "ha": "right", "color": robot_color(i)}
        panel.annotate(plain(result.names[i]), base, (-12, -4), **look)
        bases.append(base)
    for compared in result.info["pairs"]:
        for a, b in combinations(result.x[-1, compared], 2):
            _draw_distance(panel, a, b)
    for radius in _radii(result):
        _draw_circle(panel, np.zeros(2), radius, color=DESIRED, linewidth=0.9, dashes=(6, 4))
    panel.plot([], [], color="black", linewidth=2.0, label="desired paths")
    panel.plot([], [], color=DESIRED, linewidth=0.9, dashes=(6, 4), label="circles")
    panel.plot([], [], ":", color=SOFT, linewidth=0.9, label="reach")
    panel.plot([], [], color=SOFT, linewidth=0.8, label="distances at the end")
    _frame(panel, np.vstack([*bases, *result.x[0], *result.x[-1]]), 0.2)
    panel.set_title("the arms at the start (pale) and at the end", loc="left")


def _draw_arm(panel: Axes, robot: Robot, q: np.ndarray, index: int, alpha: float) -> np.ndarray:
    """Base, joints and tip as a line, seen from above; returns them, (nv + 1, 2)."""
    joints = [robot.with_tip(frame).tip_position(q) for frame in robot.joint_frames]
    points, color = np.array([*joints, robot.tip_position(q)])[:, :2], robot_color(index)
    panel.plot(*points.T, "-", color=color, linewidth=5, alpha=0.6 * alpha, solid_joinstyle="round")
    panel.plot(*points[1:-1].T, "o", color=color, markersize=6, alpha=alpha)
    panel.plot(*points[0], "s", color="#4a525c", markersize=9, zorder=3)
    panel.plot(*points[-1], "o", color="white", markeredgecolor=color, markersize=6, alpha=alpha, zorder=5)
    return points


def _draw_circle(panel: Axes, center: np.ndarray, radius: float, **look: Any) -> None:
    angle = np.linspace(0, 2 * np.pi, 400)
    panel.plot(center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle), zorder=1, **look)


def _draw_distance(panel: Axes, a: np.ndarray, b: np.ndarray) -> None:
    """A thin line with its length, written where the arms leave room for it."""
    panel.plot(*np.array([a, b]).T, color=SOFT, linewidth=0.8, zorder=1)
    low, high = sorted((a, b), key=lambda point: point[1])
    steep = abs(high[1] - low[1]) > abs(high[0] - low[0])
    place = low + (0.22 if steep else 0.5) * (high - low)
    box = {"fc": "white", "ec": "none", "pad": 1.5}
    panel.annotate(f"{np.linalg.norm(a - b):.3f} m", place, ha="center", va="center", fontsize=8, bbox=box)


def _radii(result: Result) -> list[float]:
    """Radii of the circles about the origin on which the desired paths start, each once."""
    return sorted({round(float(np.linalg.norm(x)), 6) for x in result.x_desired[0]})


def _frame(panel: Axes, points: np.ndarray, room: float) -> None:
    low, high = points.min(axis=0) - room, points.max(axis=0) + room
    panel.set(aspect="equal", xlabel="x, m", ylabel="y, m", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
