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
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..analysis.comparison import Comparison, compare, side_by_side, sizes_of
from ..analysis.free_gain import factor_for, scaled
from ..analysis.trial_rows import Row, Sizes
from ..analysis.verdict import ERRORS, SAME, gain_text
from ..control.laws import ChungSlotine, Law, SlotineLi
from ..errors import InputError, SimulationError, StepWarning
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
#: rows of independent controllers with as much gain as u has in the pairs on average, and at most
STIFF = "Λ + β for Λ, without β and K_ε"
STIFFEST = "Λ + β max λ for Λ, without β and K_ε"
#: row of the independent controller whose peak torque is the same as that of the law, with what disturbs both
AS_MUCH_TORQUE = "Λ for as much torque, without β and K_ε"
STIFFER = STIFF, STIFFEST, AS_MUCH_TORQUE


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
    whole, options = fair.parts(), {"duration": min(fair.parts_duration, limit), "engine": fastest_engine()}
    return side_by_side({**taken_apart(whole), **as_much_torque(whole, **options)}, **options)


def taken_apart(experiment: Experiment) -> dict[str, Experiment]:
    """The experiment with every combination of beta, K_eps and adaptation, and independent with as much gain.

    First all of them, then two, one and none. The last are independent and stiffer: u contains Lambda + beta
    lambda, with the eigenvalues lambda of S'S, so that not Lambda + beta but Lambda + beta times the largest
    of them is the largest gain that synchronization has.
    """
    gains = experiment.gains
    there = [part for part, gain in PARTS.items() if getattr(gains, gain) is not None]
    found = {}
    for size in range(len(there), -1, -1):
        for kept in combinations(there, size):
            off = {PARTS[part]: 0 * getattr(gains, PARTS[part]) for part in there if part not in kept}
            found[" + ".join(kept) or "none of them"] = replace(experiment, gains=gains.replace(**off))
    largest = float(np.linalg.norm(experiment.cell.coupling.matrix, 2) ** 2)
    for name, share in ((STIFF, 1.0), (STIFFEST, largest)):
        stiff = gains.independent().replace(Lambda=gains.Lambda + share * gains.beta)
        found[name] = replace(experiment, gains=stiff)
    return found


def as_much_torque(experiment: Experiment, **options: Any) -> dict[str, Experiment]:
    """The independent controller whose Lambda makes the peak torque that of the law; none if no Lambda does.

    The runs are those with all that disturbs the experiment: what is equal in a run without friction need not
    be equal with it.
    """
    alone = replace(experiment, gains=experiment.gains.independent())
    torque = partial(_peak_torque, options=options)
    asked = torque(experiment)
    factor = factor_for(lambda factor: torque(scaled(alone, factor)) / asked - 1)
    return {} if factor is None else {AS_MUCH_TORQUE: scaled(alone, factor)}


def _peak_torque(experiment: Experiment, options: Mapping[str, Any]) -> float:
    """Peak torque of a run, N·m; infinite if it has to stop."""
    with catch_warnings():
        simplefilter("ignore", StepWarning)
        try:
            return sizes_of(experiment.simulate(**options)).peak_torque
        except SimulationError:
            return float("inf")


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
        f"{comparison.title}, {comparison.duration:g} s, {gain_text(row)}. Asked: RMS and peak of both e "
        f"and ε smaller by more than {SAME:.0%}.",
    )


def what_parts_do(parts: Comparison) -> str:
    """What each part of the law alone makes of the errors without any, and what as much gain makes of them.

    Args:
        parts: the comparison of `compare_parts`; of its quiet runs.
    """
    sizes = {row.law: row.quiet for row in parts.rows if row.quiet is not None}
    nothing, alone = sizes["none of them"], [part for part in PARTS if part in sizes]
    each = ", ".join(f"{part} {_share(sizes[part], nothing)}" for part in alone)
    most = min(alone, key=lambda part: sizes[part].sync_rms)
    ours = sizes[next(iter(sizes))]
    gains = [f"{name.partition(',')[0]} {_share(sizes[name], ours)}" for name in STIFFER if name in sizes]
    return (
        f"Of what ε is with none of the law's parts ({parts.title}, {parts.duration:g} s), each part alone "
        f"leaves, RMS and peak: {each}. Most is done by {most}. An independent controller has, of what the "
        f"whole law leaves: {'; '.join(gains)}."
    )


def _share(sizes: Sizes, whole: Sizes) -> str:
    """RMS and peak of epsilon as shares of others."""
    return f"{sizes.sync_rms / whole.sync_rms:.3g} and {sizes.sync_peak / whole.sync_peak:.3g}"


def fair_section(laws: Comparison, parts: Comparison, stem: Path) -> Section:
    """Other laws, and the parts of the paper's; the figure is written to `<stem>.svg`."""
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
    "The same law part by part, and the independent controller with as much gain: u contains Λ + β λ, with "
    "the eigenvalues λ of SᵀS, so Λ + β for Λ, and Λ + β times the largest of them; and with the Λ that has "
    "the same peak torque where something disturbs. All runs here are made by the compiled engine where "
    "CasADi and a C compiler are there."
)


def _better(row: Row, ours: Row) -> bool:
    if row.disturbed is None or ours.disturbed is None:
        return False
    pairs = zip(_errors(row), _errors(ours), strict=True)
    return all(other < (1 - SAME) * own for other, own in pairs)


def _errors(row: Row) -> tuple[float, ...]:
    """Sizes of the errors of the disturbed run, as `ERRORS` names them; none without it."""
    return () if row.disturbed is None else tuple(getattr(row.disturbed, size) for size in ERRORS)


def _figures(row: Row, ours: Row, units: tuple[str, str, str]) -> tuple[Finding, ...]:
    e, epsilon, torque = units
    found = [
        Finding(f"{name} disturbed, {each.law}", value, unit)
        for each in (ours, row)
        for name, value, unit in zip(ERRORS.values(), _errors(each), (e, e, epsilon, epsilon), strict=False)
    ]
    torques = [
        Finding(f"quiet peak torque, {each.law}", each.quiet.peak_torque, torque)
        for each in (ours, row)
        if each.quiet is not None
    ]
    return (*found, *torques)
