"""A figure of how far two judges of the physics are apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..show.legends import plain
from ..show.panels import power_of_ten
from ..show.plots import new_figure, style
from ..show.style import ACCENT, robot_color
from .judge import AGREEMENT, Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: smaller differences are drawn here: below rounding there is nothing to see
FLOOR = 1e-18


def differences(comparisons: Sequence[Comparison]) -> Figure:
    """Relative differences of tracking and synchronization errors over time, a line per cell."""
    with style():
        figure, panels = new_figure(3.2, 1, 2, width=8.4, sharey=True)
        for panel, kind in zip(panels[0], ("tracking", "sync"), strict=True):
            for k, comparison in enumerate(comparisons):
                values = np.maximum(getattr(comparison, kind), FLOOR)
                panel.semilogy(comparison.t, values, color=robot_color(k), label=plain(comparison.title))
            panel.axhline(AGREEMENT, color=ACCENT, linestyle="--", linewidth=1.0, label="asked for")
            panel.set_xlabel("time, s")
            panel.yaxis.set_major_formatter(power_of_ten)
            panel.margins(x=0)
        panels[0, 0].set_ylabel("difference / largest error")
        panels[0, 0].set_title("tracking error e", loc="left")
        panels[0, 1].set_title("synchronization error ε", loc="left")
        figure.legend(handles=panels[0, 0].get_lines(), loc="outside lower center", ncols=3)
    return figure
