"""The front of a search for several goals: a panel for each two of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..sweep.rows import COMPLETED
from ..tune import Goal, Tuned
from .panels import WIDTH, power_of_ten
from .plots import new_figure, style
from .style import ACCENT, PALETTE, display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: of a panel, inches; and the least width of one beside another
HEIGHT, NARROWEST = 2.6, 2.05
#: from which ratio of the largest to the smallest value on an axis is logarithmic
RATIO = 20.0
#: runs that count and are not on the front, and those that do not count
PLAIN, BEYOND = "#9aa3ad", "#d9a441"
_WORDS: Mapping[str, str] = MappingProxyType({"sync": "sync error", "tracking": "tracking error"})


class _Shown(NamedTuple):
    """Rows that a panel shows: of the front, others that count, beyond limits, and the chosen one."""

    front: list[Any]
    others: list[Any]
    beyond: list[Any]
    chosen: list[Any]


def front_figure(found: Tuned, *, width: float = WIDTH) -> Figure:
    """Runs of a search over each two of its goals: those on its front, the others, and the chosen one.

    Of two goals the front is a line of steps, to whose better side there is nothing but runs beyond a limit,
    which have a mark of their own. How many runs have no place, for want of a number, is said.

    Args:
        found: what `tune` found, for two goals or more.
        width: of the figure, inches.

    Raises:
        InputError: a search for one goal, which has no front.
    """
    if len(found.goals) < 2:
        raise InputError.expected("a search for two goals or more", found.goals[0].name, "found")
    pairs = list(combinations(found.goals, 2))
    columns = max(1, min(len(pairs), int(width / NARROWEST)))
    rows = -(-len(pairs) // columns)
    with style():
        figure, axes = new_figure(HEIGHT * rows + 0.5, rows, columns, width=width)
        for panel, pair in zip(axes.flat, pairs, strict=False):
            _draw(panel, pair, found)
        for panel in axes.flat[len(pairs) :]:
            panel.set_axis_off()
        handles, _ = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles=handles, loc="outside upper left", ncols=max(1, int(width / 1.7)))
    return figure


def _draw(panel: Axes, pair: tuple[Goal, Goal], found: Tuned) -> None:
    shown = _shown(found)
    front, others, beyond, chosen = (_points(rows, pair, found) for rows in shown)
    hidden = len(found.history) - len(front) - len(others) - len(beyond)
    if len(beyond):
        panel.plot(*beyond.T, "x", color=BEYOND, ms=4, label=f"beyond a limit: {len(beyond)}", zorder=1)
    panel.plot(*others.T, "o", color=PLAIN, ms=2.5, mew=0, label=f"other runs: {len(others)}", zorder=2)
    if len(found.goals) == 2:
        _steps(panel, front, pair)
    panel.plot(*front.T, "o", color=PALETTE[0], ms=4.5, mew=0, label=f"front: {len(front)}", zorder=4)
    star: Any = {"marker": "*", "ms": 13, "ls": "", "mfc": "white", "mec": ACCENT, "mew": 1.4, "zorder": 5}
    panel.plot(*chosen.T, **star, label=f"chosen: run {found.run}")
    if hidden:
        panel.plot([], [], " ", label=f"no numbers: {hidden}")
    for axis, goal, values in zip("xy", pair, np.vstack([front, others, beyond]).T, strict=True):
        _scale(panel, axis, goal, values, found)


def _points(rows: list[Any], pair: tuple[Goal, Goal], found: Tuned) -> np.ndarray:
    """Values of two goals as they are displayed, (rows, 2)."""
    factors = [display(found.definitions[goal.name].unit).factor for goal in pair]
    values = [[row[goal.name] for goal in pair] for row in rows]
    return np.array(values, dtype=float).reshape(-1, 2) * np.array(factors)


def _shown(found: Tuned) -> _Shown:
    """Rows that have a place in the panels of all goals."""
    on = {row["run"] for row in found.front}
    placed = [row for row in found.history if row["status"] == COMPLETED and not _blank(row, found.goals)]
    faults = {row["run"]: found.judge.fault(row) for row in placed}
    others = [row for row in placed if not faults[row["run"]] and row["run"] not in on]
    beyond = [row for row in placed if faults[row["run"]]]
    return _Shown(found.front, others, beyond, [found.history[found.run]])


def _blank(row: Mapping[str, Any], goals: Sequence[Goal]) -> bool:
    return any(row[goal.name] is None for goal in goals)


def _steps(panel: Axes, front: np.ndarray, pair: tuple[Goal, Goal]) -> None:
    """The border of what is worse in both goals than some run of the front."""
    line = front[np.argsort(front[:, 0])]
    where: Any = "pre" if pair[0].larger else "post"
    panel.step(*line.T, where=where, color=PALETTE[0], lw=1.0, alpha=0.6, zorder=3)


def _scale(panel: Axes, axis: str, goal: Goal, values: np.ndarray, found: Tuned) -> None:
    """Label of an axis, and whether it is logarithmic."""
    from matplotlib.ticker import NullFormatter

    unit = display(found.definitions[goal.name].unit).unit
    better = ", larger is better" if goal.larger else ""
    panel.set(**{f"{axis}label": f"{words_of(goal.name)}{'' if unit == '1' else f', {unit}'}{better}"})
    if values.min() > 0 and values.max() > RATIO * values.min():
        panel.set(**{f"{axis}scale": "log"})
        lines = getattr(panel, f"{axis}axis")
        lines.set_major_formatter(power_of_ten)
        lines.set_minor_formatter(NullFormatter())


def words_of(measure: str) -> str:
    """A measure as people call it: "sync error rms" for "sync_rms"."""
    kind, _, rest = measure.partition("_")
    return f"{_WORDS.get(kind, kind)} {rest.replace('_', ' ')}".strip()
