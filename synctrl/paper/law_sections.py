"""Sections of the page of laws: a comparison as table, figure and sentences, and adaptations side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..analysis.comparison import Comparison
from ..analysis.trial_rows import Row, Sizes
from ..analysis.verdict import COLUMNS, gain_text
from ..show.law_figures import comparison_figure
from ..show.style import display
from .adaptation_trials import AdaptationTrial
from .report import Block, Section, Table, Text, as_picture, number


def comparison_section(comparison: Comparison, stem: Path, note: str = "") -> Section:
    """A comparison of laws; its figure is written to `<stem>.svg` and `<stem>.png`."""
    caption = (
        "Synchronization error against tracking error. The mark is the rule, the number the law, the colour "
        "the peak torque."
    )
    blocks: list[Block] = [Text(note)] if note else []
    blocks.append(_rows(comparison))
    blocks.append(as_picture(comparison_figure(comparison), stem, caption))
    blocks += map(Text, comparison.verdict)
    return Section(f"Laws: {comparison.title}, {comparison.duration:g} s", tuple(blocks))


def adaptation_section(title: str, trials: Sequence[AdaptationTrial], units: tuple[str, str, str]) -> Section:
    """Adaptations side by side; units of e, of epsilon and of torque."""
    (e_unit, e), (s_unit, s) = (display(unit) for unit in units[:2])
    head = (
        "adaptation", f"peak e, {e_unit}", "late e", f"peak ε, {s_unit}", f"peak torque, {units[2]}",
        "torque error", "µs per step", "estimates are those of bodies that can exist",
    )  # fmt: skip
    rows = tuple(
        (
            trial.name,
            *(number(e * value) for value in (trial.tracking_peak, trial.tracking_late)),
            number(s * trial.sync_peak),
            number(trial.peak_torque),
            number(trial.torque_error),
            number(1e6 * trial.cost, 2),
            trial.consistency,
        )
        for trial in trials
    )
    return Section(f"Adaptations: {title}", (Text(_ADAPTATIONS), Table(head, rows)))


_ADAPTATIONS = (
    "Late is the last quarter of the run. The torque error is that of the estimates at the end, relative, "
    "over 60 random states. A step is timed in the compiled engine, by the processor's clock, with the plant "
    "and all evaluations of the method; other work of the machine shows in it."
)


def _rows(comparison: Comparison) -> Table:
    (e_unit, e), (s_unit, s) = (display(unit) for unit in comparison.units[:2])
    names = (f"peak e, {e_unit}", "RMS e", f"peak ε, {s_unit}", "RMS ε", f"torque, {comparison.units[2]}")
    factors = dict(zip(COLUMNS, (e, e, s, s, 1.0), strict=True))
    situations = comparison.situations
    head = ("law", "rule", "free gain", *(name for _ in situations for name in names))
    groups = (("", 2), *((situation, len(names)) for situation in situations))
    rows = tuple(_cells(row, situations, factors) for row in comparison.rows)
    return Table(head, rows, groups=groups)


def _cells(row: Row, situations: Sequence[str], factors: dict[str, float]) -> tuple[str, ...]:
    sizes = (cell for situation in situations for cell in _numbers(getattr(row, situation), factors))
    return (row.law, row.rule, gain_text(row), *sizes)


def _numbers(sizes: Sizes | None, factors: dict[str, float]) -> list[str]:
    if sizes is None:
        return ["–"] * len(factors)
    return [number(factor * getattr(sizes, name)) for name, factor in factors.items()]
