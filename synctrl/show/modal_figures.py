"""Figures of Theorem B: weighted errors inside their bounds, a panel for each eigenvalue of S^T S."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..analysis.modal import ModalBounds
from .legends import legend
from .panels import LEGEND, TITLE, power_of_ten, stacked_panels
from .plots import style
from .style import DESIRED, PALETTE, display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: height of a panel, inches, and the most of them
PANEL, MOST = 1.35, 6
#: share of the largest bound where axes begin, and where at the lowest, to show a run that is smaller
VISIBLE, LOWEST = 1e-5, 1e-9
#: how far below the largest value of a run axes begin at least
BELOW = 0.1
#: where bands begin, below all that is seen
TINY = 1e-300
#: eigenvalues that differ by less than this share are one
EQUAL = 1e-9


def modal_figure(bounds: ModalBounds) -> Figure:
    """|w| of the modes of each eigenvalue over time, inside its bound with the r of the run, and a priori.

    A cell with many eigenvalues shows the lowest ones, which have the largest gains.

    Args:
        bounds: of `synctrl.analysis.modal_bounds`.
    """
    values = bounds.filter.eigenvalues
    firsts = np.flatnonzero(np.diff(values, prepend=-1.0) > EQUAL * max(1.0, values.max()))
    groups = np.split(np.arange(values.size), firsts[1:])[:MOST]
    with style():
        above = [LEGEND + TITLE, *[TITLE] * (len(groups) - 1)]
        figure, panels = stacked_panels([PANEL] * len(groups), above)
        tops = [_panel(*each, bounds) for each in zip(panels, groups, strict=True)]
        top = max(tops) or 1.0
        peaks = [float(np.max(panel.get_lines()[0].get_ydata())) for panel in panels]
        low = max(min(VISIBLE * top, BELOW * min(peaks)), LOWEST * top)
        for panel in panels:
            panel.set_ylim(low, 2 * top)
        legend(figure, panels[0].get_legend_handles_labels()[0])
    return figure


def _panel(panel: Axes, modes: np.ndarray, bounds: ModalBounds) -> float:
    """Draw the modes of one eigenvalue, and tell the largest value."""
    unit, factor = display(bounds.unit)
    h2, apart = bounds.filter.h2[modes], np.abs(bounds.free[:, modes])
    bands = {"bound with the r of the run": factor * _size(apart + h2 * bounds.rho[:, modes])}
    if bounds.rho_a_priori is not None:
        bands = {"a priori bound": factor * _size(apart + h2 * bounds.rho_a_priori[modes])} | bands
    panel.set_yscale("log", nonpositive="clip")
    for (label, band), alpha in zip(reversed(bands.items()), (0.35, 0.15), strict=False):
        panel.fill_between(bounds.t, TINY, band, color=PALETTE[0], alpha=alpha, lw=0, label=label)
    panel.plot(bounds.t, factor * _size(bounds.w[:, modes]), color=DESIRED, label="run")
    panel.set_ylabel(f"|w|, {unit}")
    panel.yaxis.set_major_formatter(power_of_ten)
    panel.set_title(_title(bounds, modes), loc="left")
    return float(max(band.max() for band in bands.values()))


def _title(bounds: ModalBounds, modes: np.ndarray) -> str:
    """Eigenvalue and gain of a panel."""
    value, gain = bounds.filter.eigenvalues[modes[0]], bounds.filter.gain[modes].max()
    kind = f"differences, λ = {value:.3g}" if value else "common mode, λ = 0"
    return f"{kind}: gain {gain:.3g} s"


def _size(modes: np.ndarray) -> np.ndarray:
    """Norm over modes and axes, (T,)."""
    return np.sqrt((modes**2).sum(axis=(1, 2)))
