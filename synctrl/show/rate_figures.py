"""The figure of Theorem C: how the rate of small errors depends on how fast robots learn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.exponential_rate import RatesOverGamma
from ..checks import instance
from .plots import new_figure, style
from .style import robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: of the figure with one panel, and of a panel more, inches
HEIGHT, WIDTH, COLUMN = 3.2, 5.2, 4.0
#: rates below this share of Lambda would lie on the axis, and get a logarithmic one
FLAT = 0.05


def rates_figure(found: Mapping[str, RatesOverGamma]) -> Figure:
    """Rate over Gamma, the best one marked, a panel for each motion.

    A dotted line shows Lambda where a common motion of the errors falls no faster than that, whatever Gamma.
    Where all rates are far below it the axis is logarithmic.

    Args:
        found: by what a panel shows.

    Raises:
        InputError: no mapping, such as the rates alone.
    """
    instance("found", found, Mapping, "a mapping from titles to rates, as in {'two arms': rates}")
    with style():
        columns = len(found)
        figure, axes = new_figure(HEIGHT, 1, columns, width=WIDTH + COLUMN * (columns - 1))
        for k, (panel, (title, rates)) in enumerate(zip(axes[0], found.items(), strict=True)):
            _panel(panel, rates, robot_color(k))
            panel.set_title(title)
        axes[0][0].set_ylabel("rate of small errors, 1/s")
    return figure


def _panel(panel: Axes, rates: RatesOverGamma, color: str) -> None:
    best = int(np.argmax(rates.rates))
    panel.plot(rates.factors, rates.rates, color=color, marker=".", ms=4)
    panel.plot([rates.best], [rates.rates[best]], ls="", marker="o", ms=9, mfc="none", mec="#222222", mew=1.6)
    told = f"best: {rates.rates[best]:.3g} 1/s at {rates.best:.3g} Γ"
    panel.annotate(
        told, (0.02, 0.98), xycoords="axes fraction", ha="left", va="top", fontsize=8, annotation_clip=False
    )
    if np.isfinite(rates.limit):
        panel.axhline(rates.limit, color="#222222", ls=":", lw=1.0)
        panel.annotate(
            "Λ", (1.0, rates.limit), (3, 0), ("axes fraction", "data"), "offset points", va="center"
        )
    panel.set(xscale="log", xlabel="Γ, as a multiple of the cell's own")
    top = max(rates.rates.max(), rates.limit if np.isfinite(rates.limit) else 0.0)
    if 0 < rates.rates.max() < FLAT * top:
        low = rates.rates[rates.rates > 0].min()
        panel.set_yscale("log")
        panel.set_ylim(low / 2, top * (top / low) ** 0.2)
    else:
        panel.set_ylim(0.0, 1.2 * top)
