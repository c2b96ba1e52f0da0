"""The section of the page in which MuJoCo computes the plants again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..show.legends import plain
from ..show.panels import power_of_ten
from ..show.plots import new_figure, style
from ..show.style import ACCENT, robot_color
from .judge import AGREEMENT, Agreement
from .report import Section, Table, Text, as_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "An independent judge"
#: smaller differences are drawn here: below rounding there is nothing to see
FLOOR = 1e-18


def judge_section(cells: Sequence[Agreement], folder: Path) -> Section:
    """Runs by Pinocchio against the same by MuJoCo; without any, a sentence on what is missing.

    Args:
        cells: how far the two agree, for each cell.
        folder: where the figure goes.
    """
    if not cells:
        missing = "MuJoCo is not installed, so this comparison was not made: pip install 'synctrl[mujoco]'."
        return Section(TITLE, (Text(missing, "note"),))
    words = (
        "The same controller drives the same robots once more, with accelerations by MuJoCo. It reads the "
        "URDF with its own parser: of Pinocchio's numbers it gets none but the vector of gravity. Integrator "
        "and steps are the same, and there is no friction."
    )
    caption = "Differences of the errors, relative to the largest error of each run."
    head = ("cell", "length, s", "largest difference of e", "of ε", f"within {AGREEMENT:g}")
    rows = tuple(
        (
            cell.title,
            f"{cell.t[-1]:g}",
            f"{cell.tracking.max():.1e}",
            f"{cell.sync.max():.1e}",
            "yes" if cell.agrees else "NO",
        )
        for cell in cells
    )
    return Section(
        TITLE, (Text(words), as_picture(differences(cells), folder / "judge", caption), Table(head, rows))
    )


def differences(cells: Sequence[Agreement]) -> Figure:
    """Relative differences of tracking and synchronization errors over time, a line per cell."""
    with style():
        figure, panels = new_figure(3.2, 1, 2, width=8.4, sharey=True)
        for panel, kind in zip(panels[0], ("tracking", "sync"), strict=True):
            for k, cell in enumerate(cells):
                values = np.maximum(getattr(cell, kind), FLOOR)
                panel.semilogy(cell.t, values, color=robot_color(k), label=plain(cell.title))
            panel.axhline(AGREEMENT, color=ACCENT, linestyle="--", linewidth=1.0, label="asked for")
            panel.set_xlabel("time, s")
            panel.yaxis.set_major_formatter(power_of_ten)
            panel.margins(x=0)
        panels[0, 0].set_ylabel("difference / largest error")
        panels[0, 0].set_title("tracking error e", loc="left")
        panels[0, 1].set_title("synchronization error ε", loc="left")
        figure.legend(handles=panels[0, 0].get_lines(), loc="outside lower center", ncols=3)
    return figure
