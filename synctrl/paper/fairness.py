"""Fair comparisons of the page: other laws with as much torque, and the paper's law part by part.

The paper compares with beta = K_eps = 0 and everything else unchanged, which takes gain away. Beside that
stand laws that make it up in one respect (`synctrl.analysis.compare`), and every combination of the parts of
the paper's law (`synctrl.analysis.side_by_side`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from pathlib import Path

from ..analysis.comparison import Comparison, compare, side_by_side
from ..analysis.trial_rows import Row
from ..analysis.verdict import SAME, gain_text
from ..control.laws import ChungSlotine, Law, SlotineLi
from ..errors import InputError
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import planar_four
from ..simulation.simulate import Experiment
from .claims import OURS_OF_THE_PAPER, Claim, Finding
from .law_sections import comparison_section, rows_table
from .report import Points, Section, Text
from .reproduction import fastest_engine

#: gains of the law that are switched off, by what a table calls them
PARTS = {"β": "beta", "K_ε": "K_eps", "adaptation": "Gamma"}
TORQUE = "equal peak torque"


@dataclass(frozen=True)
class Fair:
    """What is compared on one cell.

    Attributes:
        make: the cell, with whatever disturbs it.
        laws: beside the paper's; their free gains begin near those that are looked for.
        rules: what is made equal. Where gravity takes most of the peak torque, torque says little.
        duration: s; the peaks of all torques lie within, and the push.
        parts: the cell whose law is taken apart.
        parts_duration: s.
    """

    make: Callable[[], Experiment]
    laws: Sequence[Law]
    rules: Sequence[str]
    duration: float
    parts: Callable[[], Experiment]
    parts_duration: float


FAIR: Mapping[str, Fair] = {
    "a460_pair": Fair(a460_pair, (SlotineLi(), ChungSlotine(30.0)), ("equal pole",), 0.8, a460_pair, 0.8),
    "planar_four": Fair(
        partial(planar_four, disturbance="torque"),
        (SlotineLi(), ChungSlotine(5.0)),
        ("equal pole", TORQUE),
        1.0,
        planar_four,
        0.25,
    ),
}


def compare_laws(name: str, limit: float = float("inf")) -> Comparison:
    """The comparison of laws on a cell of `FAIR`, over at most `limit` seconds."""
    fair = FAIR[name]
    duration = min(fair.duration, limit)
    return compare(fair.make(), fair.laws, fair.rules, duration=duration, engine=fastest_engine())


def compare_parts(name: str, limit: float = float("inf")) -> Comparison:
    """The comparison of the law's parts on a cell of `FAIR`, over at most `limit` seconds."""
    fair = FAIR[name]
    duration = min(fair.parts_duration, limit)
    return side_by_side(taken_apart(fair.parts()), duration=duration, engine=fastest_engine())


def taken_apart(experiment: Experiment) -> dict[str, Experiment]:
    """The experiment with every combination of beta, K_eps and adaptation, and with Lambda + beta for Lambda.

    First all of them, then two, one and none; the last is independent and stiffer.
    """
    gains = experiment.gains
    there = [part for part, gain in PARTS.items() if getattr(gains, gain) is not None]
    found = {}
    for size in range(len(there), -1, -1):
        for kept in combinations(there, size):
            off = {PARTS[part]: 0 * getattr(gains, PARTS[part]) for part in there if part not in kept}
            found[" + ".join(kept) or "none of them"] = replace(experiment, gains=gains.replace(**off))
    stiff = gains.independent().replace(Lambda=gains.Lambda + gains.beta)
    return {**found, "Λ + β for Λ, without β and K_ε": replace(experiment, gains=stiff)}


def another_law_does_better(comparison: Comparison, law: str) -> Claim:
    """Our finding: at equal quiet peak torque another law beats the paper's under the disturbance.

    Raises:
        InputError: the comparison has no such row.
    """
    ours = comparison.rows[0]
    row = next((row for row in comparison.rows if (row.law, row.rule) == (law, TORQUE)), None)
    if row is None:
        raise InputError(f"expected a row of {law} at {TORQUE}, found none", subject="comparison", found=law)
    return Claim(
        f"At equal quiet peak torque, {law} has smaller tracking and synchronization errors under the "
        "disturbance than the paper's law.",
        OURS_OF_THE_PAPER,
        _better(row, ours),
        _figures(row, ours, comparison.units),
        f"{comparison.title}, {comparison.duration:g} s, {gain_text(row)}. Asked: RMS of e and of ε both "
        f"smaller by more than {SAME:.0%}.",
    )


def fair_section(laws: Comparison, parts: Comparison, stem: Path) -> Section:
    """Other laws, and the parts of the paper's; the figure is written to `<stem>.svg` and `<stem>.png`."""
    shown = comparison_section(laws, stem, _FAIRNESS)
    apart = (Text(_PARTS), rows_table(parts), Points(parts.sentences))
    return Section(f"Fair comparisons: {laws.title}, {laws.duration:g} s", (*shown.blocks, *apart))


_FAIRNESS = (
    "The paper compares with β = K_ε = 0 and all else unchanged, which is SlotineLi at equal pole, and takes "
    "gain away. In other rows the free gain is solved for with which the quiet run has the same peak torque. "
    "With the same gains each law runs once more disturbed: the planar arms by the push on robot 1, the A460 "
    "by friction. The sentences are made from the numbers. scripts/compare_laws.py compares all laws, in "
    "three respects each, on a page of its own."
)
_PARTS = (
    "The same law part by part, and the independent controller with Λ + β for Λ. All runs here are "
    "made by the compiled engine where CasADi and a C compiler are there."
)


def _better(row: Row, ours: Row) -> bool:
    if row.disturbed is None or ours.disturbed is None:
        return False
    pairs = zip(_errors(row), _errors(ours), strict=True)
    return all(other < (1 - SAME) * own for other, own in pairs)


def _errors(row: Row) -> tuple[float, ...]:
    """RMS of e and of epsilon of the disturbed run; none without it."""
    return () if row.disturbed is None else (row.disturbed.tracking_rms, row.disturbed.sync_rms)


def _figures(row: Row, ours: Row, units: tuple[str, str, str]) -> tuple[Finding, ...]:
    found = [
        Finding(f"{name} disturbed, {each.law}", value, unit)
        for each in (ours, row)
        for name, value, unit in zip(("RMS e", "RMS ε"), _errors(each), units[:2], strict=False)
    ]
    torques = [
        Finding(f"quiet peak torque, {each.law}", each.quiet.peak_torque, units[2])
        for each in (ours, row)
        if each.quiet is not None
    ]
    return (*found, *torques)
