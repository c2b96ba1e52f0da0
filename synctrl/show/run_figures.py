"""Figures that any run has, and all of them by name: torques, paths over time, estimates, and the gallery."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import choice
from ..errors import InputError, SynctrlError
from ..simulation.result import Result
from . import plots
from .assembly_figures import CURVES, assembly_figure, has
from .consistency_plots import consistency
from .curves import Curves, curves_figure
from .legends import legend, legend_rows, plain
from .look import NARROWEST, in_look, look_of
from .lyapunov_plots import lyapunov_terms
from .network_figures import traffic
from .panels import LEGEND, TITLE, stacked_panels
from .phase_figures import phase_portraits
from .runs import check_run
from .spectrum_figures import spectra
from .style import DESIRED, robot_color
from .tip_figures import tip_paths

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "FIGURES",
    "NARROWEST",
    "OF_TASKS",
    "ON_REQUEST",
    "Gallery",
    "estimates",
    "gallery",
    "paths",
    "torque_curves",
    "torques",
]

#: height of a panel, inches
COORDINATE = 1.1
#: a limit is drawn where torques come as close to it as this share
NEAR = 0.5
#: how many estimates of a robot are drawn: those that move most
MOST_ESTIMATES = 6


def torques(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Torques that the controller asks for: a panel for each robot and unit, a colour for each joint.

    The legend has the limits of the robots' descriptions; they are drawn, dashed, where torques come near.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.
    """
    return curves_figure(result, torque_curves(result), width, style)


def torque_curves(result: Result) -> list[Curves]:
    """The panels of `torques`, for one run."""
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
    return curves


def estimates(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Estimates that move most, a panel for each robot, with true values dashed that are not far off.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.

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
    return curves_figure(result, curves, width, style)


def paths(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Coordinates of all robots over time, a panel for each: actual, and desired as dark dash-dot lines.

    Args:
        result: the run.
        width, style: of the figure, see `look.look_of`.
    """
    check_run(result, "x", "x_desired")
    return in_look(style, width, partial(_coordinates, result))


def _coordinates(result: Result, width: float) -> Figure:
    from matplotlib.lines import Line2D

    names = result.info["axes"]
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


#: the figures of any run, by name, in the order in which they are shown
FIGURES: Mapping[str, Callable[..., Figure]] = MappingProxyType(
    {
        "tracking_error": plots.tracking_errors,
        "sync_error": plots.sync_errors,
        "torque": torques,
        "path": paths,
        "estimates": estimates,
    }
)
#: those of runs that log what they show
OF_TASKS: Mapping[str, Callable[..., Figure]] = MappingProxyType(
    {"traffic": traffic, **{name: partial(assembly_figure, name=name) for name in CURVES}}
)
#: those that are drawn when they are asked for by name, for they take long or are not always wanted
ON_REQUEST: Mapping[str, Callable[..., Figure]] = MappingProxyType(
    {
        "tip_path": tip_paths,
        "phase_portrait": phase_portraits,
        "spectrum": spectra,
        "consistency": consistency,
        "lyapunov": lyapunov_terms,
    }
)


class Gallery(dict[str, "Figure"]):
    """Figures by name.

    Attributes:
        missing: what is not shown, by name, and why.
        formats: in which they are written.
    """

    def __init__(self, title: str, formats: Sequence[str] = ("png", "svg")) -> None:
        super().__init__()
        self.title = title
        self.formats = tuple(formats)
        self.missing: dict[str, str] = {}

    def save(self, folder: str | Path, formats: Sequence[str] | None = None) -> list[Path]:
        """Write every figure as `<name>.png` and so on into a folder, which is made.

        Args:
            folder: where.
            formats: "png", "svg", "pdf"; by default PNG and SVG, and of the style "ieee" PDF and PNG.

        Raises:
            InputError: an unknown format.
            ResultError: a file cannot be written.
        """
        formats = self.formats if formats is None else formats
        return [
            file for name, figure in self.items() for file in plots.save(figure, Path(folder) / name, formats)
        ]

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


def gallery(result: Result, *names: str, width: float | None = None, style: str | None = None) -> Gallery:
    """The figures of a run.

    Args:
        result: the run.
        names: which ones, see `FIGURES`, `OF_TASKS` and `ON_REQUEST`; by default all of the first, and of the
            second those that the run has. Of the first, what a run does not have is left out and named in
            `missing`.
        width, style: of all figures, see `look.look_of`.

    Raises:
        InputError: an unknown name, a figure that was asked for by name and cannot be drawn, none that can,
            an unknown style, or a width in which words have no place.
    """
    found = Gallery(str(result.info["title"]), look_of(style, width).formats)
    known = {**FIGURES, **OF_TASKS, **ON_REQUEST}
    asked = names or (*FIGURES, *(name for name in OF_TASKS if _shows(result, name)))
    for name in asked:
        try:
            found[name] = known[choice("figure", name, tuple(known))](result, width=width, style=style)
        except SynctrlError as error:
            if names or (len(found.missing) + 1 == len(FIGURES)):
                raise
            found.missing[name] = str(error)
    unknown = [robot["name"] for robot in result.info["robots"] if "torque_limits" not in robot]
    if "torque" in found and unknown:
        found.missing["torque limits"] = f"the result does not say those of {', '.join(unknown)}"
    return found


def _shows(result: Result, name: str) -> bool:
    """Whether a run has what one of `OF_TASKS` shows."""
    return "message_age" in result.outputs if name == "traffic" else has(result, name)


def _png(figure: Figure) -> str:
    pixels = BytesIO()
    figure.savefig(pixels, format="png")
    return base64.b64encode(pixels.getvalue()).decode()
