"""Figures that any run has, and all of them by name: torques, paths over time, estimates, and the gallery."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..checks import choice, finite_number
from ..errors import InputError, SynctrlError
from ..simulation.result import Result
from . import plots
from .legends import columns_that_fit, fitted, legend, legend_rows, plain
from .panels import GAP, LEFT, LEGEND, RIGHT, TITLE, WIDTH, stacked_panels
from .runs import check_run
from .style import DESIRED, PALETTE, line_style, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: heights of panels, inches
PANEL, COORDINATE = 1.5, 1.1
#: a limit is drawn where torques come as close to it as this share
NEAR = 0.5
#: how many estimates of a robot are drawn: those that move most
MOST_ESTIMATES = 6


class Curves(NamedTuple):
    """What one panel shows over time.

    Attributes:
        title: above it.
        label: of the vertical axis.
        values: (T, k).
        names: what the legend calls the k curves.
        levels: values that are drawn as a dashed line in the colour of each curve, if any.
    """

    title: str
    label: str
    values: np.ndarray
    names: list[str]
    levels: list[tuple[float, ...]]


def torques(result: Result, *, width: float = WIDTH) -> Figure:
    """Torques that the controller asks for: a panel for each robot and unit, a colour for each joint.

    The legend has the limits of the robots' descriptions; they are drawn, dashed, where torques come near.

    Args:
        result: the run.
        width: of the figure, inches.
    """
    check_run(result, "tau")
    curves = []
    for i, robot in enumerate(result.info["robots"]):
        limits = robot.get("torque_limits") or [None] * len(robot["joints"])
        for unit, columns in plots.columns_by_unit(result.units("tau")[i]).items():
            curves.append(
                Curves(
                    result.names[i],
                    f"{'force' if unit == 'N' else 'torque'}, {unit}",
                    result.tau[:, i, columns],
                    [_limited(robot["joints"][k], limits[k]) for k in columns],
                    [_near(result.tau[:, i, k], limits[k]) for k in columns],
                )
            )
    return _figure(result, curves, width)


def estimates(result: Result, *, width: float = WIDTH) -> Figure:
    """Estimates that move most, a panel for each robot, with true values dashed that are not far off.

    Args:
        result: the run.
        width: of the figure, inches.

    Raises:
        InputError: nothing is estimated.
    """
    check_run(result, "theta_hat")
    if not result.theta_hat.shape[2]:
        raise InputError("expected parameters that are estimated, found none", subject="result")
    curves = []
    for i, robot in enumerate(result.info["robots"]):
        theta_hat = result.theta_hat[:, i, : len(robot["parameters"])]
        moved = np.sort(np.argsort(-np.ptp(theta_hat, axis=0), kind="stable")[:MOST_ESTIMATES])
        count = len(robot["parameters"])
        title = f"{result.names[i]}, {len(moved)} of {count} estimates" if count else result.names[i]
        names, true = ([robot[key][k] for k in moved] for key in ("parameters", "theta"))
        levels = _within_reach(theta_hat[:, moved], true)
        curves.append(Curves(title, "SI units", theta_hat[:, moved], names, levels))
    return _figure(result, curves, width)


def paths(result: Result, *, width: float = WIDTH) -> Figure:
    """Coordinates of all robots over time, a panel for each: actual, and desired as dark dash-dot lines.

    Args:
        result: the run.
        width: of the figure, inches.
    """
    from matplotlib.lines import Line2D

    check_run(result, "x", "x_desired")
    names = result.info["axes"]
    with plots.style():
        handles: list[Any] = [
            Line2D([], [], color=robot_color(i), label=plain(name)) for i, name in enumerate(result.names)
        ]
        handles.append(Line2D([], [], color=DESIRED, linestyle="-.", linewidth=1.1, label="desired"))
        above = [LEGEND * legend_rows(handles, width) + TITLE, *[TITLE] * (len(names) - 1)]
        figure, panels = stacked_panels([COORDINATE] * len(names), above, width)
        for k, panel in enumerate(panels):
            panel.set_title(plots.titled(names[k], width), loc="left")
            panel.set_ylabel(plots.draw_coordinate(panel, result, range(len(result.names)), k))
            plots.shade_disturbances(panel, result)
        legend(figure, handles)
    return figure


def _figure(result: Result, curves: Sequence[Curves], width: float) -> Figure:
    """A panel for each group of curves, with a title and a legend of its own."""
    room = width - LEFT - RIGHT
    with plots.style():
        rows = [-(-len(c.names) // columns_that_fit([plain(n) for n in c.names], room)) for c in curves]
        above = [GAP + TITLE + LEGEND * count for count in rows]
        figure, panels = stacked_panels([PANEL] * len(curves), above, width)
        for panel, shown in zip(panels, curves, strict=True):
            handles = _draw(panel, result, shown)
            plots.shade_disturbances(panel, result)
            panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), **fitted(handles, room))
            y = 1 + LEGEND * legend_rows(handles, room) / PANEL  # above the legend
            panel.set_title(plots.titled(shown.title, width), loc="left", y=y)
            panel.set_ylabel(shown.label)
    return figure


def _draw(panel: Axes, result: Result, shown: Curves) -> list[Any]:
    lines = []
    for k, name in enumerate(shown.names):
        color, look = robot_color(k), line_style(k // len(PALETTE))  # another line where colours repeat
        lines += panel.plot(result.t, shown.values[:, k], ls=look, color=color, label=plain(name))
        for level in shown.levels[k]:
            panel.axhline(level, ls=(0, (5, 3)), color=color, linewidth=0.9)
    return lines


def _limited(name: str, limit: float | None) -> str:
    return name if limit is None else f"{name}, ±{limit:g}"


def _within_reach(values: np.ndarray, levels: Sequence[float]) -> list[tuple[float, ...]]:
    """Levels that are no farther from all values, (T, k), than these are apart."""
    low, high = values.min(initial=0.0), values.max(initial=0.0)
    return [(level,) if 2 * low - high <= level <= 2 * high - low else () for level in levels]


def _near(tau: np.ndarray, limit: float | None) -> tuple[float, ...]:
    """The limits, above and below, to which a torque comes near."""
    if limit is None or not limit > 0:
        return ()
    return tuple(sign * limit for sign in (1, -1) if (sign * tau).max() > NEAR * limit)


#: the figures that have a name, in the order in which they are shown
FIGURES: Mapping[str, Callable[..., Figure]] = MappingProxyType(
    {
        "tracking_error": plots.tracking_errors,
        "sync_error": plots.sync_errors,
        "torque": torques,
        "path": paths,
        "estimates": estimates,
    }
)
#: the narrowest figure in which all words have their place, inches
NARROWEST = 3.0


class Gallery(dict[str, "Figure"]):
    """Figures by name.

    Attributes:
        missing: what is not shown, by name, and why.
    """

    def __init__(self, title: str) -> None:
        super().__init__()
        self.title = title
        self.missing: dict[str, str] = {}

    def save(self, folder: str | Path) -> list[Path]:
        """Write every figure as `<name>.png` and `<name>.svg` into a folder, which is made.

        Raises:
            ResultError: a file cannot be written.
        """
        return [file for name, figure in self.items() for file in plots.save(figure, Path(folder) / name)]

    def _repr_html_(self) -> str:
        """All figures for a notebook, and what is missing."""
        pictures = "".join(
            f'<img alt="{escape(name)}" style="max-width: 100%" src="data:image/png;base64,{_png(figure)}">'
            for name, figure in self.items()
        )
        words = "".join(f"<p>{escape(line)}</p>" for line in self._missing_lines())
        return f"<div>{pictures}{words}</div>"

    def _missing_lines(self) -> list[str]:
        return [f"Not shown: {name}: {reason}" for name, reason in self.missing.items()]

    def __repr__(self) -> str:
        return "\n".join([f"Figures of '{self.title}': {', '.join(self)}", *self._missing_lines()])


def gallery(result: Result, *names: str, width: float = WIDTH) -> Gallery:
    """The figures of a run.

    Args:
        result: the run.
        names: which ones, see `FIGURES`; by default all. What a run does not have is then left out and named
            in `missing`.
        width: of all figures, inches.

    Raises:
        InputError: an unknown name, a figure that was asked for by name and cannot be drawn, none that can,
            or a width below `NARROWEST`.
    """
    if not finite_number("width", width) >= NARROWEST:
        raise InputError.expected(f"at least {NARROWEST:g} inches", width, "width")
    found = Gallery(str(result.info["title"]))
    for name in names or FIGURES:
        try:
            found[name] = FIGURES[choice("figure", name, tuple(FIGURES))](result, width=width)
        except SynctrlError as error:
            if names or (len(found.missing) + 1 == len(FIGURES)):
                raise
            found.missing[name] = str(error)
    unknown = [robot["name"] for robot in result.info["robots"] if "torque_limits" not in robot]
    if "torque" in found and unknown:
        found.missing["torque limits"] = f"the result does not say those of {', '.join(unknown)}"
    return found


def _png(figure: Figure) -> str:
    pixels = BytesIO()
    with plots.style():
        figure.savefig(pixels, format="png")
    return base64.b64encode(pixels.getvalue()).decode()
