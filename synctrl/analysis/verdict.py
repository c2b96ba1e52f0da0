"""A comparison of laws in words, all computed from its numbers, and as a table of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .trial_rows import AS_GIVEN, Row

#: relative difference up to which two sizes count as the same
SAME = 0.02
COLUMNS = ("tracking_peak", "tracking_rms", "sync_peak", "sync_rms", "peak_torque")
#: sizes of the errors in the order in which they are said, with their words
ERRORS = {
    "tracking_rms": "RMS e",
    "tracking_peak": "peak e",
    "sync_rms": "RMS ε",
    "sync_peak": "peak ε",
}
#: share of the peak torque that gravity takes, beyond which equal peak torque says little
HEAVY = 0.5


def sentences(rows: Sequence[Row], situations: Sequence[str], unit: str) -> list[str]:
    """Each row beside the first, a sentence each, with the unit of torque."""
    ours, *others = rows
    return [_sentence(ours, row, situations, unit) for row in others]


def summary(rows: Sequence[Row], situations: Sequence[str]) -> str:
    """Which rows are better than the first in both errors, by RMS and by peak."""
    ours, *others = rows
    better = [
        f"{_at_rule(row)}, {situation}"
        for row in others
        for situation in situations
        if max(_ratios(ours, row, situation), default=1.0) < 1 - SAME
    ]
    if better:
        return f"Better than {ours.law} in both errors, by RMS and by peak: {'; '.join(better)}."
    return f"In no row are RMS and peak of both e and ε smaller than with {ours.law}."


def about_gravity(rows: Sequence[Row], share: float) -> list[str]:
    """A sentence where gravity takes most of the first row's peak torque and rows have as much as that."""
    if share <= HEAVY or not any(row.rule == "equal peak torque" for row in rows):
        return []
    return [
        f"Gravity alone asks for {share:.0%} of the quiet peak torque of {rows[0].law}, so equal peak torque "
        "hardly tells gentle from stiff control here."
    ]


def table(rows: Sequence[Row], situations: Sequence[str], units: tuple[str, str, str]) -> list[str]:
    """Lines of a table of text, in SI units."""
    e, epsilon, torque = units
    head = (f"peak e, {e}", "RMS e", f"peak ε, {epsilon}", "RMS ε", f"torque, {torque}")
    lines = [["law", "rule", "free gain", *(f"{h}" for _ in situations for h in head)]]
    for row in rows:
        sizes = [cell for situation in situations for cell in _numbers(getattr(row, situation))]
        lines.append([row.law, row.rule, gain_text(row), *sizes])
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    first = sum(widths[:3]) + 6
    span = sum(widths[3:8]) + 10
    above = " " * first + "".join(f"{situation:<{span}}" for situation in situations)
    text = ["  ".join(f"{cell:<{w}}" for cell, w in zip(line, widths, strict=True)) for line in lines]
    return [line.rstrip() for line in (above, *text)]


def gain_text(row: Row) -> str:
    """The free gain of a row, as `K_2 = 0.3`."""
    if row.value is None:
        return f"{row.gain}: none"
    return f"{row.gain} = {_listed(row.value)}"


# -- parts -------------------------------------------------------------------------------------------------


def _sentence(ours: Row, row: Row, situations: Sequence[str], unit: str) -> str:
    if row.value is None:
        return f"{_at_rule(row)}: {row.remark}."
    parts = [_compared(ours, row, situation, unit) for situation in situations]
    return f"{_at_rule(row)} ({gain_text(row)}), beside {ours.law}: {'; '.join(parts)}."


def _at_rule(row: Row) -> str:
    """A row by its law and by what is equal."""
    return row.law if row.rule == AS_GIVEN else f"{row.law} at {row.rule}"


def _compared(ours: Row, row: Row, situation: str, unit: str) -> str:
    ratios = _ratios(ours, row, situation)
    if not ratios:
        return row.remark or ours.remark
    errors = ", ".join(_times(ratio, name) for ratio, name in zip(ratios, ERRORS.values(), strict=True))
    here, there = getattr(row, situation), getattr(ours, situation)
    torque = f"with {here.peak_torque:.4g} against {there.peak_torque:.4g} {unit} of torque"
    return f"{situation}, {errors}, {torque}"


def _ratios(ours: Row, row: Row, situation: str) -> list[float]:
    """RMS and peaks of e and of epsilon, over those of the first row; empty where a run is missing."""
    here, there = getattr(row, situation), getattr(ours, situation)
    if here is None or there is None:
        return []
    pairs = ((getattr(here, name), getattr(there, name)) for name in ERRORS)
    return [a / b if b else (np.inf if a else 1.0) for a, b in pairs]


def _times(ratio: float, name: str) -> str:
    if abs(ratio - 1) <= SAME:
        return f"{name} the same"
    if ratio > 1:
        return f"{name} {ratio:.3g} times larger"
    return f"{name} {1 / ratio:.3g} times smaller"


def _numbers(sizes: Any) -> list[str]:
    if sizes is None:
        return ["-"] * len(COLUMNS)
    return [f"{getattr(sizes, name):.4g}" for name in COLUMNS]


def _listed(value: Any) -> str:
    return f"{value:.4g}" if np.ndim(value) == 0 else f"[{', '.join(_listed(each) for each in value)}]"
