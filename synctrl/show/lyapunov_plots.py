"""Figures of the proof: V and its terms, V' and its terms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.lyapunov import ENERGIES, POWERS, THEOREM, Growth, Lyapunov
from .plots import new_figure, style
from .style import ACCENT, DESIRED, PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: terms that never exceed this share of the largest are left out
VISIBLE = 1e-9
#: powers below this share of the largest are drawn on a linear scale
LINEAR = 1e-4


def lyapunov_figure(record: Lyapunov) -> Figure:
    """V with its terms above, on a logarithmic scale, and V' with its terms below, signs kept.

    Args:
        record: of `synctrl.analysis.lyapunov.lyapunov`.
    """
    with style():
        figure, panels = new_figure(5.6, 2, sharex=True)
        _energies(panels[0, 0], record)
        _powers(panels[1, 0], record)
        for panel in panels[:, 0]:
            panel.margins(x=0)
            panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2)
    return figure


def growth_mark(figure: Figure, growth: Growth) -> Figure:
    """Mark the first instant at which V grows in a figure of `lyapunov_figure`, and name the term."""
    for panel in figure.axes:
        panel.axvline(growth.time, color=ACCENT, linewidth=1.0, linestyle=":")
    figure.axes[0].annotate(
        f"V grows: {growth.term}",
        (growth.time, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(4, 0),
        textcoords="offset points",
        fontsize=8,
        color=ACCENT,
    )
    return figure


def _energies(panel: Axes, record: Lyapunov) -> None:
    panel.set_yscale("log")
    floor = VISIBLE * float(record.V.max())
    for name, color in _visible(record.energy, ENERGIES, floor):
        panel.plot(record.t, np.maximum(record.energy[name], floor), color=color, label=name)
    panel.plot(record.t, record.V, color=DESIRED, linewidth=2.0, label="V", zorder=1)
    panel.set_ylim(bottom=floor)
    panel.set_ylabel("V and its terms")


def _powers(panel: Axes, record: Lyapunov) -> None:
    largest = float(np.abs(list(record.power.values())).max())
    floor = VISIBLE * largest
    panel.set_yscale("symlog", linthresh=max(LINEAR * largest, float(record.rounding.max()), 1e-300))
    for name, color in _visible(record.power, POWERS, floor):
        inside = "-" if name in THEOREM else "--"
        panel.plot(record.t, record.power[name], inside, color=color, label=name)
    panel.plot(record.t, record.V_dot, color=DESIRED, linewidth=2.0, label="V'", zorder=1)
    panel.axhline(0.0, color="#8a929c", linewidth=0.8)
    panel.set_ylabel("V' and its terms, 1/s")
    panel.set_xlabel("time, s")


def _visible(terms: Mapping[str, np.ndarray], names: tuple[str, ...], floor: float) -> list[tuple[str, str]]:
    """Names of the terms that can be seen, each with the colour it has in all figures."""
    return [
        (name, PALETTE[k % len(PALETTE)]) for k, name in enumerate(names) if np.abs(terms[name]).max() > floor
    ]
