"""Sections of the page of laws: a comparison as table, figure and sentences, and adaptations side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..analysis.comparison import Comparison
from ..analysis.trial_rows import Row, Sizes
from ..analysis.verdict import COLUMNS, gain_text
from ..show.law_figures import comparison_figure
from ..show.style import display
from .adaptation_trials import AdaptationTrial
from .report import Block, Points, Section, Table, Text, as_picture, number


def comparison_section(comparison: Comparison, stem: Path, note: str = "") -> Section:
    """A comparison of laws; its figure is written to `<stem>.svg`."""
    caption = (
        "Synchronization error against tracking error. The mark is the rule, the number the law, the colour "
        "the peak torque."
    )
    blocks: list[Block] = [Text(each) for each in (*comparison.summary, note) if each]
    blocks += [rows_table(comparison), as_picture(comparison_figure(comparison), stem, caption)]
    blocks.append(Points(comparison.sentences))
    return Section(f"Laws: {comparison.title}, {comparison.duration:g} s", tuple(blocks))


def cost_table(costs: Mapping[str, float | None]) -> Table:
    """What a step of each law costs, s; None where the engine does not have the law."""
    shown = (("–" if cost is None else number(1e6 * cost)) for cost in costs.values())
    caption = "Processor time of a step with the plant and all evaluations of the method, on this machine."
    return Table(("", *costs), (("µs per step", *shown),), caption)


def adaptation_section(title: str, trials: Sequence[AdaptationTrial], units: tuple[str, str, str]) -> Section:
    """Adaptations side by side; units of e, of epsilon and of torque."""
    (e_unit, e), (s_unit, s) = (display(unit) for unit in units[:2])
    head = (
        "adaptation", f"peak e, {e_unit}", "late e", f"peak ε, {s_unit}", f"torque, {units[2]}",
        "torque error", "µs per step", "bodies",
    )  # fmt: skip
    rows = tuple(
        (
            trial.name,
            *(number(e * value) for value in (trial.tracking_peak, trial.tracking_late)),
            number(s * trial.sync_peak),
            number(trial.peak_torque),
            number(trial.torque_error),
            number(1e6 * trial.cost),
            trial.bodies,
        )
        for trial in trials
    )
    blocks = (Text(adaptation_verdict(trials)), Table(head, rows), Text(_ADAPTATIONS))
    return Section(f"Adaptations: {title}", blocks)


def adaptation_verdict(trials: Sequence[AdaptationTrial]) -> str:
    """What the numbers say: where errors and estimates end best, and which estimates are those of bodies."""
    late = min(trials, key=lambda trial: trial.tracking_late)
    torque = min(trials, key=lambda trial: trial.torque_error)
    best = (
        f"Late tracking errors are smallest with {late.name}, torque errors of the estimates with "
        f"{torque.name}."
    )
    bodies = [trial for trial in trials if trial.bodies != "none"]
    left = [f"{trial.name}, {trial.bodies}" for trial in bodies if trial.bodies != "yes"]
    if not bodies:
        return best
    if not left:
        return f"{best} All estimates are those of bodies that can exist, throughout."
    return f"{best} Estimates do not stay those of bodies that can exist with {'; '.join(left)}."


_ADAPTATIONS = (
    "Late is the last quarter of the run. Torque is the largest of any joint. The torque error is that of "
    "the estimates at the end, relative, over 60 random states. A step is timed by the processor's clock, "
    "with the plant and all evaluations of the method; other work of the machine shows in it, and it depends "
    "on the machine. Bodies: whether the estimates are those of bodies that can exist; none where what is "
    "adapted are not the parameters of bodies."
)


def rows_table(comparison: Comparison) -> Table:
    """Every row of a comparison, with what its runs measured."""
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
