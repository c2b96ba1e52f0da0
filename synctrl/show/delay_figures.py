"""The figure of how much delay and loss cells take: one panel for each cell and each receiver."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..analysis.delay_map import DelayMap
from .plots import new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.colors import SymLogNorm
    from matplotlib.figure import Figure

#: where colours end, and where they begin to tell factors of two, 1/s
FASTEST, SLOWEST = 8.0, 0.5
#: of the figure, and of one row of panels, inches
WIDTH, ROW = 9.6, 2.7


def delay_map_figure(maps: Mapping[str, Mapping[str, DelayMap]]) -> Figure:
    """Growth over delay and loss, blue where small errors fall and red where they grow.

    A black line goes between the two, where both are there.

    Args:
        maps: by what a row of panels shows, and in it by what a panel shows.
    """
    from matplotlib.colors import SymLogNorm

    norm = SymLogNorm(SLOWEST, vmin=-FASTEST, vmax=FASTEST, base=2)
    with style():
        columns = max(len(row) for row in maps.values())
        figure, axes = new_figure(ROW * len(maps), len(maps), columns, width=WIDTH, sharex=True, sharey=True)
        for panels, (name, row) in zip(axes, maps.items(), strict=True):
            for panel, (title, found) in zip(panels, row.items(), strict=False):
                colours = _panel(panel, found, norm)
                panel.set_title(f"{title}, {name}")
            panels[0].set_ylabel("messages lost, %")
        for panel in axes[-1]:
            panel.set_xlabel("delay, ms")
        bar = figure.colorbar(colours, ax=axes, aspect=40, extend="both", label="growth of small errors, 1/s")
        bar.ax.yaxis.set_major_formatter("{x:g}")
        bar.ax.minorticks_off()
    return figure


def _panel(panel: Axes, found: DelayMap, norm: SymLogNorm) -> QuadMesh:
    delays, losses, growth = 1e3 * found.delays, 100 * found.losses, found.growth.T
    colours = panel.pcolormesh(
        delays, losses, growth, shading="nearest", cmap="RdBu_r", norm=norm, edgecolors="face"
    )
    if growth.min() < 0 < growth.max():
        panel.contour(delays, losses, growth, [0.0], colors="black", linewidths=1.6)
    return colours
