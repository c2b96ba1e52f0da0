"""Figures of runs: colour = robot, line style = axis, units as people read them.

Every function returns a matplotlib `Figure` made without pyplot, so nothing global is touched; `save` writes
it as PNG and SVG, the same bytes every time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.metrics import row_names
from ..errors import InputError, ResultError
from ..simulation.result import Result
from .style import ACCENT, DESIRED, display, line_style, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 6.4  # inches
DPI = 150

_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.7,
    "axes.edgecolor": "#8a929c",
    "xtick.color": "#4a525c",
    "ytick.color": "#4a525c",
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "svg.hashsalt": "synctrl",
    "svg.fonttype": "path",
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
}


@contextmanager
def style() -> Iterator[None]:
    """This package's look, for the figures made inside; what was set before comes back after."""
    from matplotlib import rc_context, rcParamsDefault

    plain: Any = {k: v for k, v in rcParamsDefault.items() if k != "backend"}
    with rc_context(plain), rc_context(_STYLE):
        yield


def new_figure(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, np.ndarray]:
    """A figure of the page's width and its axes, (rows, columns); to be called within `style`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def save(figure: Figure, stem: str | Path) -> tuple[Path, Path]:
    """Write a figure as `<stem>.png` and `<stem>.svg`; the same figure gives the same bytes.

    Raises:
        ResultError: a file cannot be written.
    """
    png, svg = Path(f"{stem}.png"), Path(f"{stem}.svg")
    try:
        png.parent.mkdir(parents=True, exist_ok=True)
        with style():
            figure.savefig(png, metadata={"Software": None})
            figure.savefig(svg, metadata={"Date": None, "Creator": None})
    except OSError as error:
        raise ResultError(f"cannot write the figure '{stem}': {error.strerror or error}") from error
    return png, svg


# -- figures of the paper ---------------------------------------------------------------------------------


def joint_trajectories(result: Result, robot: int) -> Figure:
    """Actual (solid) and desired (dash-dot) joint angles of one robot, a panel per joint."""
    unit, factor = display(result.unit("x"))
    axes_names = result.info["axes"]
    with style():
        figure, panels = new_figure(1.55 * len(axes_names) + 0.5, len(axes_names), sharex=True)
        for k, panel in enumerate(panels[:, 0]):
            actual, desired = factor * result.x[:, robot, k], factor * result.x_desired[:, robot, k]
            panel.plot(result.t, actual, color=robot_color(robot), label="actual")
            panel.plot(result.t, desired, "-.", color=DESIRED, linewidth=1.1, label="desired")
            panel.set_ylabel(f"{axes_names[k]}, {unit}")
            panel.margins(x=0)
        panels[-1, 0].set_xlabel("time, s")
        panels[0, 0].set_title(result.names[robot], loc="left")
        _legend(figure, panels[0, 0].get_lines())
    return figure


def tracking_errors(result: Result, limit: float | None = None) -> Figure:
    """Tracking errors of all robots in one panel.

    Args:
        result: the run.
        limit: the panel shows -limit to limit, in the unit of the errors; by default what it needs. Figures
            that are compared share it, see `common_limit`.
    """
    return _errors(result, "tracking_error", "tracking error e", limit)


def sync_errors(result: Result, limit: float | None = None) -> Figure:
    """Synchronization errors of all pairs; an error has the colour of the first robot of its pair.

    Where the run fills little of the common scale set by `limit`, a second panel magnifies it.
    """
    return _errors(result, "sync_error", "synchronization error ε", limit)


def common_limit(kind: str, *results: Result) -> float:
    """The scale that figures of an error share when their runs are compared: 1.05 times the largest."""
    return 1.05 * max(_largest(result, kind) for result in results)


# -- work shared by the figures ---------------------------------------------------------------------------

#: below this share of the common scale an error gets a magnified panel
SMALL = 0.4


def _errors(result: Result, kind: str, what: str, limit: float | None) -> Figure:
    own = 1.05 * _largest(result, kind)
    scales = [limit or own] + ([own] if limit and own < SMALL * limit else [])
    unit, factor = display(result.unit(kind))
    with style():
        figure, panels = new_figure(2.9 if len(scales) == 1 else 4.6, len(scales), sharex=True)
        for panel, scale in zip(panels[:, 0], scales, strict=True):
            _error_lines(panel, result, kind, factor)
            _mark_disturbances(panel, result)
            panel.set_ylim(-factor * scale, factor * scale)
            panel.set_ylabel(f"{what}, {unit}" if len(scales) == 1 else f"{what.split()[-1]}, {unit}")
            panel.margins(x=0)
        if len(scales) == 2:
            panels[0, 0].set_title(f"{what}, the scale of its counterpart", loc="left")
            panels[1, 0].set_title(f"the same magnified, ×{scales[0] / scales[1]:.2g}", loc="left")
        panels[-1, 0].set_xlabel("time, s")
        _legend(figure, [*_row_handles(result, kind), *_axis_handles(result)])
    return figure


def _error_lines(panel: Axes, result: Result, kind: str, factor: float) -> None:
    e = getattr(result, kind)
    for a in range(e.shape[2]):
        for k in range(e.shape[1]):
            color = _row_color(result, kind, k)
            panel.plot(result.t, factor * e[:, k, a], line_style(a), color=color)


def _row_color(result: Result, kind: str, row: int) -> str:
    if kind == "sync_error" and e_rows(result, kind) == 1:
        return DESIRED  # one pair belongs to both robots
    return robot_color(row if kind == "tracking_error" else result.info["pairs"][row][0])


def e_rows(result: Result, kind: str) -> int:
    """Number of rows of an error: robots or pairs."""
    return int(getattr(result, kind).shape[1])


def _row_handles(result: Result, kind: str) -> list[Any]:
    from matplotlib.lines import Line2D

    names = row_names(result, kind)
    if kind == "sync_error":
        names = [f"ε$_{{{name.split(':')[0]}}}$" for name in names]
    return [
        Line2D([], [], color=_row_color(result, kind, k), linewidth=2.4, label=name)
        for k, name in enumerate(names)
    ]


def _axis_handles(result: Result) -> list[Any]:
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color="#555555", ls=line_style(a), label=name)
        for a, name in enumerate(result.info["axes"])
    ]


def _legend(figure: Figure, handles: Sequence[Any]) -> None:
    columns = min(len(handles), 6)
    figure.legend(handles=list(handles), loc="outside upper right", ncols=columns, handlelength=2.4)


def _mark_disturbances(panel: Axes, result: Result) -> None:
    for window in result.info.get("disturbances", ()):
        panel.axvspan(window["start"], window["stop"], color=ACCENT, alpha=0.10, linewidth=0)
        panel.annotate(
            f"torque on {result.names[window['robot']]}",
            (window["stop"], 0.97),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            va="top",
            fontsize=8,
            color=ACCENT,
            bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1},
        )


def _largest(result: Result, kind: str) -> float:
    e = getattr(result, kind)
    if not e.size:
        raise InputError(f"run '{result.info['title']}': nothing was logged, so there is nothing to draw")
    return float(np.abs(e).max()) or 1.0
