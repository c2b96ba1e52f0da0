"""Phase portraits of tracking errors: the error and its rate."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..simulation.result import Result
from .legends import legend, legend_rows, plain, shortened
from .look import TITLE_SIZE, in_look
from .panels import GRID_RIGHT, LEGEND, panel_grid
from .runs import check_run
from .style import DESIRED, display, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: room for a panel with its margins, and its height, inches
LEAST, HEIGHT = 1.95, 1.4


def phase_portraits(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Tracking error and its rate, a panel for each coordinate; a ring marks the start of each robot.

    Dashed is the line e' = -Λ e, along which errors vanish once the law has its way. Rates are differences of
    logged errors.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: fewer than three instants, of which there are no rates.
    """
    check_run(result, "tracking_error")
    if len(result.t) < 3:
        raise InputError.expected("at least three instants", len(result.t), f"run '{result.info['title']}'")
    if not (np.diff(result.t) > 0).all():
        raise InputError("expected instants that are apart from one another", subject="result, t")
    rates = np.gradient(result.tracking_error, result.t, axis=0, edge_order=2)
    return in_look(style, width, partial(_grid, result, rates))


def _grid(result: Result, rates: np.ndarray, width: float) -> Figure:
    handles, names = _handles(result), result.info["axes"]
    figure, panels = panel_grid(len(names), LEAST, HEIGHT, LEGEND * legend_rows(handles, width), width)
    room = 72 * (panels[0].get_position().width * width + GRID_RIGHT)
    for a, panel in enumerate(panels):
        unit, factor = display(result.units("tracking_error")[0][a])
        e, rate = factor * result.tracking_error[:, :, a], factor * rates[:, :, a]
        for i in range(e.shape[1]):
            panel.plot(e[:, i], rate[:, i], color=robot_color(i), linewidth=1.2)
            panel.plot(
                e[:1, i], rate[:1, i], "o", color="white", markeredgecolor=robot_color(i), markersize=4.5
            )
        _draw_line(panel, e, _slope(result.info["gains"], a))
        panel.set(xlabel=f"e, {unit}", ylabel=f"rate of e, {unit}/s")
        panel.set_title(shortened(plain(names[a]), room, TITLE_SIZE), loc="left")
    legend(figure, handles)
    return figure


def _draw_line(panel: Axes, e: np.ndarray, slope: float | None) -> None:
    """The line e' = -Λ e, as far as errors reach, in the limits that the errors have."""
    if slope is not None:
        limits = panel.get_xlim(), panel.get_ylim()
        ends = np.array([min(float(e.min()), 0.0), max(float(e.max()), 0.0)])
        panel.plot(ends, -slope * ends, "--", color=DESIRED, linewidth=0.9, zorder=1)
        panel.set(xlim=limits[0], ylim=limits[1])


def _slope(gains: Mapping[str, Any], axis: int) -> float | None:
    """Λ of a coordinate; None if it is not one number for it."""
    found = np.asarray(gains.get("Lambda", np.nan), dtype=float)
    if found.ndim == 1 and axis < len(found):
        found = found[axis]
    return float(found) if found.ndim == 0 and np.isfinite(found) else None


def _handles(result: Result) -> list[Any]:
    from matplotlib.lines import Line2D

    robots = [Line2D([], [], color=robot_color(i), label=plain(name)) for i, name in enumerate(result.names)]
    if all(_slope(result.info["gains"], a) is None for a in range(len(result.info["axes"]))):
        return robots
    return [*robots, Line2D([], [], color=DESIRED, linestyle="--", linewidth=0.9, label="e' = −Λ e")]
