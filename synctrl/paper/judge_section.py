"""The section of the page in which MuJoCo computes the plants again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..show.plots import save
from .judge import AGREEMENT, Comparison
from .judge_plots import differences
from .report import Picture, Section, Table, Text

TITLE = "An independent judge"


def judge_section(comparisons: Sequence[Comparison], folder: Path) -> Section:
    """Runs by Pinocchio against the same by MuJoCo; without any, a sentence on what is missing.

    Args:
        comparisons: one per cell.
        folder: where the figure goes.
    """
    if not comparisons:
        words = "MuJoCo is not installed, so this comparison was not made: pip install 'synctrl[mujoco]'."
        return Section(TITLE, (Text((words,), "note"),))
    _, svg = save(differences(comparisons), folder / "judge")
    rows = [
        (
            c.title,
            f"{c.t[-1]:g}",
            f"{c.tracking.max():.1e}",
            f"{c.sync.max():.1e}",
            "yes" if c.agrees else "NO",
        )
        for c in comparisons
    ]
    return Section(
        TITLE,
        (
            Text(
                (
                    "The same controller drives the same robots once more, with accelerations by MuJoCo. It "
                    "reads the URDF with its own parser: of Pinocchio's numbers it gets none but the vector "
                    "of gravity. Integrator and steps are the same, and there is no friction.",
                )
            ),
            Picture(svg, "Differences of the errors, relative to the largest error of each run."),
            Table(
                ("cell", "length, s", "largest difference of e", "of ε", f"within {AGREEMENT:g}"), tuple(rows)
            ),
        ),
    )
