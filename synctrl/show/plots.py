"""Figures of runs: colour = robot, line style = axis, units as people read them.

Every function returns a matplotlib `Figure` made without pyplot, so nothing global is touched; `save` writes
it as PNG and SVG, the same bytes every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from ..analysis.metrics import ERRORS
from ..checks import choice, finite_array, index
from ..errors import InputError
from ..renamed import names_elsewhere
from ..simulation.result import Result
from . import legends
from .legends import plain
from .look import LABEL_SIZE, TITLE_SIZE, in_look, new_figure, save, save_svg, style
from .panels import GAP, LEFT, LEGEND, RIGHT, TITLE, stacked_panels
from .runs import check_run
from .style import ACCENT, DESIRED, display, line_style, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "common_limits",
    "joint_trajectories",
    "new_figure",
    "save",
    "save_svg",
    "style",
    "sync_errors",
    "tracking_errors",
]

# -- figures of the paper ---------------------------------------------------------------------------------


def joint_trajectories(
    result: Result, robot: int, *, width: float | None = None, style: str | None = None
) -> Figure:
    """Actual (solid) and desired (dash-dot) coordinates of one robot, a panel per axis.

    Args:
        result: the run; in joint space its coordinates are those of the joints.
        robot: which robot, counted from 0.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: there is no such robot.
    """
    check_run(result, "x", "x_desired")
    index("robot", robot, len(result.names))
    return in_look(style, width, partial(_joints, result, robot))


def _joints(result: Result, robot: int, width: float) -> Figure:
    names = result.info["axes"]
    above = [LEGEND + TITLE, *[GAP] * (len(names) - 1)]
    figure, panels = stacked_panels([COORDINATE] * len(names), above, width)
    for k, panel in enumerate(panels):
        unit = draw_coordinate(panel, result, [robot], k)
        room = 72 * COORDINATE - legends.text_width(f", {unit}", LABEL_SIZE)
        panel.set_ylabel(f"{legends.shortened(plain(names[k]), room, LABEL_SIZE)}, {unit}")
    panels[0].set_title(titled(result.names[robot], width), loc="left")
    legends.legend(figure, panels[0].get_lines())
    return figure


def tracking_errors(
    result: Result,
    limits: tuple[float, float] | None = None,
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """Tracking errors of all robots, in one panel for each unit.

    Where the run fills little of the limits, a second panel magnifies it.

    Args:
        result: the run.
        limits: lowest and highest value shown, in the unit of the errors; by default what the run needs.
            Figures that are compared share them, see `common_limits`.
        width, style: of the figure, see `look.look_of`.
    """
    return in_look(style, width, partial(_errors, result, "tracking_error", "tracking error e", limits))


def sync_errors(
    result: Result,
    limits: tuple[float, float] | None = None,
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """Synchronization errors of all pairs, in one panel for each unit; see `pair_colors`.

    `limits`, `width` and `style` are as for `tracking_errors`.
    """
    what = "synchronization error ε"
    return in_look(style, width, partial(_errors, result, "sync_error", what, limits))


def common_limits(kind: str, *results: Result) -> tuple[float, float]:
    """Limits that figures of an error share when their runs are compared: all that the runs need.

    Args:
        kind: "tracking_error" or "sync_error".
        results: the runs.

    Returns:
        The lower and the upper one, in the unit of the error.

    Raises:
        InputError: another kind, or no run.
    """
    choice("kind", kind, ERRORS)
    own = [_needed(result, kind) for result in results]
    if not own:
        raise InputError("expected at least one run, found none", subject="results")
    return min(low for low, _ in own), max(high for _, high in own)


# -- work shared by the figures ---------------------------------------------------------------------------

#: below this share of the common limits an error gets a magnified panel
SMALL = 0.4
#: heights of the panel of a coordinate, of errors, and of magnified errors, inches
COORDINATE, PANEL, MAGNIFIED = 1.3, 2.1, 1.5


class _Part(NamedTuple):
    """What a panel shows of an error: the columns of one unit, in a range, and how much it is magnified."""

    unit: str
    columns: list[int]
    low: float
    high: float
    times: float = 1.0


def _errors(result: Result, kind: str, what: str, limits: tuple[float, float] | None, width: float) -> Figure:
    parts = _parts(result, kind, limits)
    handles = [*legends.row_handles(result, kind), *legends.axis_handles(result)]
    handles += legends.disturbance_handles(result)
    room = [GAP if part.times == 1 else TITLE for part in parts]
    above = [LEGEND * legends.legend_rows(handles, width) + GAP, *room[1:]]
    heights = [PANEL if part.times == 1 else MAGNIFIED for part in parts]
    figure, panels = stacked_panels(heights, above, width)
    for panel, part in zip(panels, parts, strict=True):
        _draw_errors(panel, result, kind, what, part)
    legends.legend(figure, handles)
    return figure


def _parts(result: Result, kind: str, limits: tuple[float, float] | None) -> list[_Part]:
    check_run(result, kind)
    parts = []
    for unit, columns in columns_by_unit(result.units(kind)[0]).items():
        own = _needed(result, kind, columns)
        low, high = own if limits is None else _read_limits(limits)
        times = (high - low) / (own[1] - own[0])
        parts += [_Part(unit, columns, low, high)]
        parts += [_Part(unit, columns, *own, times)] if SMALL * times > 1 else []
    return parts


def columns_by_unit(units: Sequence[str]) -> dict[str, list[int]]:
    """Which columns are in which unit."""
    return {unit: [k for k, own in enumerate(units) if own == unit] for unit in dict.fromkeys(units)}


def _draw_errors(panel: Axes, result: Result, kind: str, what: str, part: _Part) -> None:
    """All lines, each narrower than the one below it, so that lines that coincide are all seen."""
    unit, factor = display(part.unit)
    e = factor * getattr(result, kind)
    panel.axhline(0.0, color="#8a929c", linewidth=0.7, zorder=1)
    for a in part.columns:
        for k, width in enumerate(legends.line_widths(e.shape[1])):
            color = legends.row_color(result, kind, k)
            panel.plot(result.t, e[:, k, a], ls=line_style(a), color=color, linewidth=width, zorder=2 + k)
    shade_disturbances(panel, result)
    panel.set_ylim(factor * part.low, factor * part.high)
    panel.set_ylabel(f"{what if part.times == 1 else what.split()[-1]}, {unit}")
    if part.times > 1:
        panel.set_title(f"the same, on 1/{part.times:.2g} of the range", loc="left")


def draw_coordinate(panel: Axes, result: Result, robots: Sequence[int], k: int) -> str:
    """Actual and desired values of a coordinate of some robots; returns the unit in which they are drawn."""
    unit, factor = display(result.units("x")[robots[0]][k])
    for i, width in zip(robots, legends.line_widths(len(robots)), strict=True):
        actual, desired = factor * result.x[:, i, k], factor * result.x_desired[:, i, k]
        panel.plot(result.t, actual, color=robot_color(i), linewidth=width, label="actual")
        panel.plot(result.t, desired, "-.", color=DESIRED, linewidth=1.1, label="desired")
    return unit


def shade_disturbances(panel: Axes, result: Result) -> None:
    """Shade the windows in which torques act from outside."""
    for window in legends.disturbance_windows(result):
        panel.axvspan(window["start"], window["stop"], color=ACCENT, alpha=0.12, linewidth=0)


def titled(name: str, width: float) -> str:
    """A name as the title of the panels of a figure, `width` inches wide."""
    return legends.shortened(plain(name), 72 * (width - LEFT - RIGHT), TITLE_SIZE)


def _read_limits(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = finite_array("limits", limits, (2,))
    if not low < high:
        words = f"expected the lower one first, found {low:g} and {high:g}"
        raise InputError(words, subject="limits", found=(low, high))
    return float(low), float(high)


def _needed(result: Result, kind: str, columns: Sequence[int] | None = None) -> tuple[float, float]:
    """Lowest and highest value of an error, zero among them, with some room."""
    check_run(result, kind)
    e = getattr(result, kind)
    e = e if columns is None else e[:, :, columns]
    low, high = min(float(e.min()), 0.0), max(float(e.max()), 0.0)
    room = 0.06 * (high - low) or 1.0
    return low - room, high + room


__getattr__ = names_elsewhere(__name__, ".legends", "WIDE", "NARROW")
