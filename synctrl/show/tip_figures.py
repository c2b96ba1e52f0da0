"""Where the tips went: their paths in the plane, or in space as seen from above and from the front."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .arms import tip_positions
from .cell_scene import desired_tips, robots_of
from .legends import legend, legend_rows, plain, shortened
from .look import TITLE_SIZE, in_look
from .panels import GRID_RIGHT, LEGEND, panel_grid
from .runs import check_run
from .style import DESIRED, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: so many instants of a run are drawn
INSTANTS = 1500
#: paths that leave their plane by less, as a share of what they span, are drawn in it
FLAT = 1e-3
#: room for a panel with its margins, inches, and around a path within its panel, as a share of the longest
LEAST, ROOM = 1.95, 0.08


class View(NamedTuple):
    """What is seen from a side: which coordinates, and what the side is called."""

    right: int
    up: int
    side: str


ABOVE, FRONT = View(0, 1, "above"), View(0, 2, "front")


def tip_paths(
    result: Result,
    experiment: Experiment | None = None,
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """Paths of the tips in the world, m, and where they should go, dash-dot: a panel for each robot.

    All panels have the same scale. Paths that leave a plane are seen from above and from the front.

    Args:
        result: the run, in any space; desired paths are drawn where the space says where they are.
        experiment: what made it, for results whose robots cannot be made again.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: a robot that cannot be made again, by name.
    """
    check_run(result, "q", "x", "x_desired")
    robots = robots_of(result, experiment)
    rows = np.unique(np.linspace(0, len(result.t) - 1, INSTANTS).astype(int))
    tips = tip_positions(robots, result.q[rows])
    wanted = desired_tips(result, robots, rows, tips)
    return in_look(style, width, partial(_grid, result, tips, wanted))


def _grid(result: Result, tips: np.ndarray, wanted: np.ndarray | None, width: float) -> Figure:
    drawn = tips if wanted is None else np.concatenate([tips, wanted])
    views = (ABOVE,) if _flat(drawn) else (ABOVE, FRONT)
    span = (1 + 2 * ROOM) * max(float(np.ptp(drawn, axis=0).max()), 1e-3)
    handles = _handles(wanted is not None)
    count = len(result.names) * len(views)
    above = LEGEND * legend_rows(handles, width)
    figure, panels = panel_grid(count, LEAST, None, above, width, len(views))
    room = 72 * (panels[0].get_position().width * width + GRID_RIGHT)
    for k, panel in enumerate(panels):
        i, view = divmod(k, len(views))
        _draw(panel, tips[:, i], None if wanted is None else wanted[:, i], views[view], robot_color(i))
        _frame(panel, drawn[:, i], views[view], span)
        title = plain(result.names[i]) if len(views) == 1 else f"{plain(result.names[i])}, {views[view].side}"
        panel.set_title(shortened(title, room, TITLE_SIZE), loc="left")
    legend(figure, handles)
    return figure


def _flat(points: np.ndarray) -> bool:
    """Whether all paths, (T, n, 3), m, stay in planes of equal height."""
    spans = np.ptp(points, axis=0)
    return bool(spans[:, 2].max() <= FLAT * spans[:, :2].max())


def _draw(panel: Axes, tip: np.ndarray, wanted: np.ndarray | None, view: View, color: str) -> None:
    panel.plot(tip[:, view.right], tip[:, view.up], color=color, linewidth=2.0)
    if wanted is not None:
        panel.plot(wanted[:, view.right], wanted[:, view.up], "-.", color=DESIRED, linewidth=1.1)
    panel.plot(tip[:1, view.right], tip[:1, view.up], **_START)


def _frame(panel: Axes, points: np.ndarray, view: View, span: float) -> None:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    right, up = middle[view.right], middle[view.up]
    panel.set(xlim=(right - span / 2, right + span / 2), ylim=(up - span / 2, up + span / 2))
    panel.set(xlabel=f"{'xyz'[view.right]}, m", ylabel=f"{'xyz'[view.up]}, m")


_START: Any = {
    "marker": "o",
    "color": "white",
    "markeredgecolor": DESIRED,
    "markersize": 5,
    "linestyle": "none",
}


def _handles(wanted: bool) -> list[Any]:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color="#777777", linewidth=2.0, label="actual")]
    if wanted:
        handles.append(Line2D([], [], color=DESIRED, linestyle="-.", linewidth=1.1, label="desired"))
    return [*handles, Line2D([], [], label="start", **_START)]
