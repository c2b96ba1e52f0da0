"""How far estimates are from being those of no body, drawn over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..analysis.consistency import Consistency
from .plots import new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def consistency_figure(consistency: Consistency) -> Figure:
    """The smallest eigenvalue of every estimated body over time, a panel per robot."""
    with style():
        figure, axes = new_figure(2.9, 1, len(consistency.names), sharey=True)
        for panel, name, values in zip(axes[0], consistency.names, consistency.smallest, strict=True):
            for k, eigenvalue in enumerate(values.T, start=1):
                panel.plot(consistency.t, eigenvalue, label=f"body {k}")
            panel.axhline(0.0, color="#b3001b", lw=0.9, ls="--")
            panel.set(title=name, xlabel="t, s")
        axes[0, 0].set_ylabel("smallest eigenvalue")
        axes[0, 0].legend()
    return figure
