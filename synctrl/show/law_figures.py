"""What laws trade: synchronization against tracking, torque in colour."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..analysis.comparison import RULES, Comparison
from ..analysis.trial_rows import AS_GIVEN
from .legends import plain
from .plots import new_figure, style
from .style import display

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: how a row is drawn, by its rule
MARKERS = dict(zip((AS_GIVEN, *RULES), ("*", "o", "s", "^"), strict=True))
#: laws are numbered in the panels, for their names would cover each other
_SIZE = {"*": 150, "o": 60, "s": 52, "^": 62}


def comparison_figure(comparison: Comparison) -> Figure:
    """RMS of epsilon over RMS of e of every row, a panel for each of the quiet and the disturbed runs.

    The mark is the rule, the number the law, and the colour the peak torque. Rows without a run are left out.
    """
    from matplotlib.colors import LogNorm

    situations = comparison.situations
    numbers = {name: k for k, name in enumerate(dict.fromkeys(row.law for row in comparison.rows))}
    with style():
        figure, axes = new_figure(4.4, 1, len(situations), sharex=True, sharey=True)
        torques = [
            sizes.peak_torque
            for row in comparison.rows
            for situation in situations
            if (sizes := getattr(row, situation)) is not None
        ]
        norm = LogNorm(0.98 * min(torques), 1.02 * max(torques))
        for panel, situation in zip(axes[0], situations, strict=True):
            dots = _panel(panel, comparison, situation, numbers, norm)
        bar = figure.colorbar(dots, ax=list(axes[0]), aspect=30, label=f"peak torque, {comparison.units[2]}")
        bar.ax.yaxis.set_major_formatter("{x:.3g}")
        bar.ax.yaxis.set_minor_formatter("{x:.3g}")
        _legend(figure, numbers)
    return figure


def _panel(panel: Axes, comparison: Comparison, situation: str, numbers: dict[str, int], norm: Any) -> Any:
    from matplotlib.ticker import LogLocator, NullFormatter

    (e_unit, e), (s_unit, s) = (display(unit) for unit in comparison.units[:2])
    for row in comparison.rows:
        sizes = getattr(row, situation)
        if sizes is None:
            continue
        x, y, marker = e * sizes.tracking_rms, s * sizes.sync_rms, MARKERS[row.rule]
        dots = panel.scatter(
            [x], [y], _SIZE[marker], [sizes.peak_torque], norm=norm, marker=marker,
            cmap="viridis", edgecolors="#222222", linewidths=0.7,
        )  # fmt: skip
        panel.annotate(str(numbers[row.law]), (x, y), (6, 4), textcoords="offset points", fontsize=8)
    panel.set(xscale="log", yscale="log", title=situation, xlabel=f"RMS e, {e_unit}")
    if panel.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        panel.set_ylabel(f"RMS ε, {s_unit}")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    return dots


def _legend(figure: Figure, numbers: dict[str, int]) -> None:
    from matplotlib.lines import Line2D

    rules = [
        Line2D([], [], ls="", marker=m, ms=8, mfc="white", mec="#222222", label=r) for r, m in MARKERS.items()
    ]
    laws = [Line2D([], [], ls="", label=f"{number}  {plain(name)}") for name, number in numbers.items()]
    figure.legend(handles=rules + laws, loc="outside lower center", ncols=4)
