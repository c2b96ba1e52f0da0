"""What legends of figures over time show: rows as colours, axes as line styles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.metrics import row_names
from ..checks import printable
from ..simulation.result import Result
from .style import DESIRED, line_style, robot_color

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: widths of the first and of the last line of a figure, points
WIDE, NARROW = 3.0, 1.3
_INDEX = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def line_widths(rows: int) -> np.ndarray:
    """Widths of so many lines that may cover one another: the first are the widest."""
    return np.linspace(WIDE, NARROW, rows) if rows > 1 else np.array([1.4])


def row_color(result: Result, kind: str, row: int) -> str:
    """Colour of a row of `tracking_error` or `sync_error`."""
    if kind == "tracking_error":
        return robot_color(row)
    pairs = result.info["pairs"]
    return robot_color(pairs[row][0]) if len(pairs) > 1 else DESIRED  # a single pair belongs to both robots


def row_handles(result: Result, kind: str) -> list[Any]:
    """What a legend shows of the rows of an error."""
    from matplotlib.lines import Line2D

    names = row_names(result, kind)
    if kind == "sync_error":
        names = [f"ε{str(k).translate(_INDEX)}" for k in range(1, len(names) + 1)] if len(names) > 1 else []
    widths = line_widths(len(names))
    return [
        Line2D([], [], color=row_color(result, kind, k), linewidth=widths[k], label=plain(name))
        for k, name in enumerate(names)
    ]


def plain(name: str) -> str:
    """A name with nothing in it that matplotlib would read as a formula, or could not write."""
    return printable(name).replace("\n", " ").replace("$", r"\$")


def axis_handles(result: Result) -> list[Any]:
    """What a legend shows of the axes."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color="#555555", ls=line_style(a), label=plain(name))
        for a, name in enumerate(result.info["axes"])
    ]


def legend(figure: Figure, handles: Sequence[Any]) -> None:
    """A legend above the panels, at the right."""
    columns = min(len(handles), 7)
    figure.legend(
        handles=list(handles),
        loc="upper right",
        ncols=columns,
        handlelength=2.0,
        handletextpad=0.5,
        columnspacing=1.0,
        borderaxespad=0.2,
    )
