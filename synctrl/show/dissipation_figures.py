"""The figure of Theorem A: where the energy of V went, below the most that it can be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..analysis.dissipation import Dissipation
from .panels import GAP, LEGEND, stacked_panels
from .plots import style
from .style import ACCENT, DESIRED, PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: heights of the two panels, inches
HEIGHTS = (2.0, 1.4)
#: what is stacked, from below, with its colour
KEPT = (("V", PALETTE[0]), ("X²", PALETTE[1]), ("Z²", PALETTE[2]))


def dissipation_figure(found: Dissipation) -> Figure:
    """V + X^2 + Z^2 over time below the most that Theorem A lets it be, and X below its bound.

    Where the theorem does not reach there are no bounds.

    Args:
        found: of `synctrl.analysis.dissipation`.
    """
    with style():
        figure, (energies, velocities) = stacked_panels(HEIGHTS, [GAP + LEGEND] * 2)
        _energies(energies, found)
        _velocities(velocities, found)
        for panel in (energies, velocities):
            panel.set_ylim(bottom=0.0)
            panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderaxespad=0.2)
    return figure


def _energies(panel: Axes, found: Dissipation) -> None:
    terms = (found.V, found.damped, found.lost)
    names, colors = zip(*KEPT, strict=True)
    panel.stackplot(found.t, *terms, labels=names, colors=colors, alpha=0.35, linewidth=0.0)
    panel.plot(found.t, np.sum(terms, axis=0), color=DESIRED, label="sum")
    panel.axhline(found.V0, color=DESIRED, linewidth=0.8, linestyle=":", label="V(0)")
    _bound(panel, found, found.bound**2)
    panel.set_ylabel("energy, N·m")


def _velocities(panel: Axes, found: Dissipation) -> None:
    panel.plot(found.t, np.sqrt(np.maximum(found.damped, 0.0)), color=PALETTE[1], label="X")
    panel.plot(found.t, np.sqrt(np.maximum(found.acted, 0.0)), color=PALETTE[3], label="D")
    _bound(panel, found, found.bound)
    panel.set_ylabel("X and D, √(N·m)")


def _bound(panel: Axes, found: Dissipation, bound: np.ndarray) -> None:
    if found.reason is None:
        panel.plot(found.t, bound, color=ACCENT, linestyle="--", label="at most")
