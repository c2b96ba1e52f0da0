"""Spectra of errors and torques: what swings, how fast and by how much."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..analysis.metrics import row_names
from ..errors import InputError
from ..simulation.result import Result
from . import plots
from .legends import legend, legend_rows, pair_symbols, plain, row_color
from .look import in_look
from .panels import LEGEND, TITLE, power_of_ten, stacked_panels
from .runs import check_run
from .style import display, robot_color

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: the fewest instants of which there is a spectrum, and by how much their distances may differ, as a share
FEWEST, EVEN = 16, 1e-6
#: amplitudes below this share of the largest are not shown
VISIBLE = 1e-6
#: height of a panel, inches
PANEL = 1.7


class _Panel(NamedTuple):
    """Amplitudes, (frequencies, rows), what they are of, their unit, and a colour for each row."""

    title: str
    unit: str
    amplitudes: np.ndarray
    colors: list[str]


def spectrum(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes by frequency of signals, less their means, in a window of Hann.

    Args:
        t: instants, evenly spaced, (T,), s.
        values: (T, ...).

    Returns:
        Frequencies above zero, (F,), Hz, and amplitudes, (F, ...), in the unit of the values: a swing of
        amplitude A at one of the frequencies has A there.

    Raises:
        InputError: fewer than `FEWEST` instants, or instants that are not evenly spaced.
    """
    steps = np.diff(t)
    if len(t) < FEWEST:
        raise InputError.expected(f"at least {FEWEST} instants", len(t), "t")
    if np.ptp(steps) > EVEN * steps.mean() or steps.mean() <= 0:
        raise InputError("expected instants at equal distances", subject="t", found=float(np.ptp(steps)))
    window = np.hanning(len(t) + 1)[:-1].reshape(-1, *[1] * (values.ndim - 1))
    swings = np.fft.rfft(window * (values - values.mean(axis=0)), axis=0)
    return np.fft.rfftfreq(len(t), float(steps.mean()))[1:], 2.0 / window.sum() * np.abs(swings[1:])


def spectra(result: Result, *, width: float | None = None, style: str | None = None) -> Figure:
    """Amplitudes of errors and torques by frequency, a panel for each in each unit, see `spectrum`.

    A line for each robot or pair: the root of the sum of squares over its coordinates or joints.

    Args:
        result: the run, logged at equal distances.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: too few instants, or instants that are not evenly spaced.
    """
    check_run(result, "tracking_error", "sync_error", "tau")
    frequencies = spectrum(result.t, result.t)[0]
    panels = [*_errors(result, "tracking_error", "tracking error"), *_torques(result)]
    if result.info["pairs"]:
        panels[-1:-1] = _errors(result, "sync_error", "synchronization error")
    return in_look(style, width, partial(_stacked, result, frequencies, panels))


def _errors(result: Result, kind: str, what: str) -> list[_Panel]:
    e, rows = getattr(result, kind), len(row_names(result, kind))
    colors = [row_color(result, kind, k) for k in range(rows)]
    found = []
    for unit, columns in plots.columns_by_unit(result.units(kind)[0]).items():
        shown, factor = display(unit)
        amplitudes = np.linalg.norm(spectrum(result.t, factor * e[:, :, columns])[1], axis=2)
        found.append(_Panel(what, shown, amplitudes, colors))
    return found


def _torques(result: Result) -> list[_Panel]:
    by_robot = [plots.columns_by_unit(units) for units in result.units("tau")]
    found = []
    for unit in dict.fromkeys(unit for columns in by_robot for unit in columns):
        rows = [k for k, columns in enumerate(by_robot) if unit in columns]
        sizes = [
            np.linalg.norm(spectrum(result.t, result.tau[:, k, by_robot[k][unit]])[1], axis=1) for k in rows
        ]
        what = "force" if unit == "N" else "torque"
        found.append(_Panel(what, unit, np.array(sizes).T, [robot_color(k) for k in rows]))
    return found


def _stacked(result: Result, frequencies: np.ndarray, shown: list[_Panel], width: float) -> Figure:
    handles = _handles(result)
    above = [LEGEND * legend_rows(handles, width) + TITLE, *[TITLE] * (len(shown) - 1)]
    figure, panels = stacked_panels([PANEL] * len(shown), above, width)
    for panel, each in zip(panels, shown, strict=True):
        panel.set(xscale="log", yscale="log", ylabel=f"amplitude, {each.unit}")
        for row, color in zip(each.amplitudes.T, each.colors, strict=True):
            panel.plot(frequencies, row, color=color, linewidth=1.1)
        largest = float(each.amplitudes.max()) or 1.0
        least = max(float(each.amplitudes.min()), VISIBLE * largest)
        panel.set_ylim(least / 2, 2 * largest)
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_formatter(power_of_ten)
            axis.set_minor_formatter("")
        panel.set_title(each.title, loc="left")
    panels[-1].set_xlabel("frequency, Hz")
    legend(figure, handles)
    return figure


def _handles(result: Result) -> list[Any]:
    """Robots, and pairs where they are more than one: a single one has no colour of its own."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=robot_color(i), label=plain(name)) for i, name in enumerate(result.names)]
    if len(result.info["pairs"]) > 1:
        colors = [row_color(result, "sync_error", k) for k in range(len(result.info["pairs"]))]
        marks = zip(colors, pair_symbols(result), strict=True)
        handles += [Line2D([], [], color=color, linewidth=2.4, label=symbol) for color, symbol in marks]
    return handles
