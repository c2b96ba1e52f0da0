"""What legends of figures over time show: rows as colours, axes as line styles."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.metrics import row_names
from ..checks import printable
from ..simulation.result import Result
from .style import ACCENT, DESIRED, line_style, robot_color

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
    return robot_color(row) if kind == "tracking_error" else pair_colors(result)[row]


def pair_colors(result: Result) -> list[str]:
    """Colours of the pairs: those of their first robots, or of their last, or else one after another."""
    pairs = result.info["pairs"]
    if len(pairs) == 1:
        return [DESIRED]  # a single pair belongs to both robots
    for end in (0, -1):
        robots = [pair[end] for pair in pairs]
        if len({*robots}) == len(pairs):
            return [robot_color(robot) for robot in robots]
    return [robot_color(k) for k in range(len(pairs))]


def pair_symbols(result: Result) -> list[str]:
    """ε₁, ε₂, ...: what legends call the pairs."""
    return [f"ε{str(k).translate(_INDEX)}" for k in range(1, len(result.info["pairs"]) + 1)]


def row_handles(result: Result, kind: str) -> list[Any]:
    """What a legend shows of the rows of an error."""
    from matplotlib.lines import Line2D

    names = row_names(result, kind)
    if kind == "sync_error":
        names = pair_symbols(result) if len(names) > 1 else []
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


def disturbance_handles(result: Result) -> list[Any]:
    """What a legend shows of torques from outside, once for each robot."""
    from matplotlib.patches import Patch

    pushed = dict.fromkeys(window["robot"] for window in disturbance_windows(result))
    return [Patch(color=ACCENT, alpha=0.12, label=f"torque on {plain(result.names[i])}") for i in pushed]


def disturbance_windows(result: Result) -> list[dict[str, Any]]:
    """When torques act from outside, cut off at the ends of the run."""
    first, last = float(result.t[0]), float(result.t[-1])
    pushes: Sequence[dict[str, Any]] = result.info.get("disturbances", ())
    ends = ((window, *np.clip((window["start"], window["stop"]), first, last)) for window in pushes)
    return [{**window, "start": start, "stop": stop} for window, start, stop in ends if start < stop]


# -- legends that fit -------------------------------------------------------------------------------------

#: size of the words of a legend, and what stands beside them, points
SIZE, HANDLE, SPACE, PAD = 8.5, 22.0, 8.5, 12.0
#: drawn words are up to this much wider than their outlines
HINTED = 1.04
MOST_COLUMNS = 7


def legend(figure: Figure, handles: Sequence[Any]) -> None:
    """A legend above the panels, at the right, in as many lines as the width of the figure asks for."""
    figure.legend(loc="upper right", **fitted(handles, figure.get_figwidth()))


def legend_rows(handles: Sequence[Any], width: float) -> int:
    """Lines that the legend of a figure of a width, inches, takes."""
    return -(-len(handles) // columns_that_fit([handle.get_label() for handle in handles], width))


def fitted(handles: Sequence[Any], width: float) -> dict[str, Any]:
    """Options of a legend that fits into a width, inches: columns as they fit, longer words cut off."""
    labels = [handle.get_label() for handle in handles]
    room = 72 * width - HANDLE - PAD
    return {
        "handles": list(handles),
        "labels": [shortened(label, room, SIZE) for label in labels],
        "ncols": columns_that_fit(labels, width),
        "handlelength": 2.0,
        "handletextpad": 0.5,
        "columnspacing": 1.0,
        "borderaxespad": 0.2,
    }


def columns_that_fit(labels: Sequence[str], width: float) -> int:
    """The most columns in which a legend is no wider than `width`, inches; at least one."""
    widths = [HANDLE + SPACE + text_width(label, SIZE) for label in labels]
    for columns in range(min(len(labels), MOST_COLUMNS), 1, -1):
        rows = -(-len(labels) // columns)
        full = len(labels) - columns * (rows - 1)  # columns that have an entry in the last line
        starts = np.cumsum([0, *(rows if k < full else rows - 1 for k in range(columns))])
        if sum(max(widths[a:b], default=0.0) for a, b in pairwise(starts)) + PAD <= 72 * width:
            return columns
    return 1


def shortened(text: str, room: float, size: float) -> str:
    """The text, or as much of it as there is room for, in points, with an ellipsis."""
    if text_width(text, size) <= room:
        return text
    fits = bisect_right(range(len(text)), room, key=lambda k: text_width(f"{text[:k]}…", size))
    return f"{text[: max(fits - 1, 1)].rstrip(chr(92))}…"


def text_width(text: str, size: float) -> float:
    """How wide words are in a size, both in points, in the letters that are set."""
    from matplotlib import rcParams

    return _width(text, size, tuple(rcParams["font.family"]))


@lru_cache(maxsize=4096)
def _width(text: str, size: float, family: tuple[str, ...]) -> float:
    from matplotlib.cbook import is_math_text
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    if not text.strip():
        return 0.0
    font = FontProperties(family=[*family], size=size)
    width, _, _ = text_to_path.get_text_width_height_descent(text, font, is_math_text(text))
    return HINTED * float(width)
