"""What was aimed at, whether it was reached, and why not.

Aims are of a machine with AVX-512, per core. With AVX2 70 % of the gain is asked for, with less twice what
version 0.1 does. Seconds and bytes are those of one machine and so is the multiple that goes with them: where
one of two is reached, the table says which.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from benchmark_figures import Figures
from benchmark_report import Table

#: share of the gain that is asked for with AVX2, and the multiple without
WITH_AVX2, WITHOUT = 0.7, 2.0

#: why an aim is missed, by its words; written by hand, after measuring
_FEW = "two robots fill two lanes only, and about a sixth of a step goes into its log"
_LOG = "eight lanes are not four times as fast as two, and about a tenth of a step goes into its log"
REASONS: dict[str, str] = {
    "four planar arms, logged every step": "what a step needs beside the law, such as fetching neighbours "
    "from other lanes, is as much for four small arms as the law itself",
    "two A460, logged every step": _FEW,
    "two UR5, logged every step": _FEW,
    "two Panda, logged every step": _FEW,
    "sixteen UR5, logged every step": _LOG,
    "sixteen Panda, logged every step": _LOG,
    "16 to 10,000 planar arms, largest cost per robot by least": "the cost falls as cells grow, for sixteen "
    "arms have two rows of lanes to share what a step needs beside them",
    "sweep of 10,000 runs of 2 s in steps of 2 ms, two cores": "five seconds of processor time on two cores "
    "leave half a second for all else",
    "64 to 10,000 planar arms, the least gain": "it is the least of five sizes, and the largest is bound by "
    "memory, and so by what else the machine does",
    "10,000 planar arms in one ring, to the first step": "version 0.1 takes 47 s on this machine, not 80",
    "`certify` of 5 s of four planar arms": "two thirds are Pinocchio's regressors, mass matrices and "
    "kinematics at 5,001 instants, and version 0.1 takes 0.8 s on this machine, not 1.1",
    "`make reproduce` after installation": "runs, certificates and figures take about 90 s of processor time",
}
NO_REASON = "nobody has looked into it yet"


class Bound(NamedTuple):
    """A figure, and what it should be at least, or at most.

    `lanes` is the multiple of version 0.1 that the bound stands for, if it is one of a machine with AVX-512.
    """

    figure: str
    needed: float
    unit: str
    at_most: bool = False
    lanes: float | None = None


class Aim(NamedTuple):
    """Something to be reached, in words; what is said where a figure is missing; and its bounds."""

    words: str
    bounds: tuple[Bound, ...]
    known_as: str = ""


def _steps(cell: str, factor: float, rollout: float | None = None) -> Aim:
    bounds = [Bound(f"{cell}, factor", factor, "x", lanes=factor)]
    if rollout is not None:
        bounds.append(Bound(f"{cell}, rollout", rollout, "x rollout", lanes=factor))
    return Aim(f"{cell}, logged every step", tuple(bounds))


def _start(words: str, kind: str, *bounds: Bound) -> Aim:
    return Aim(f"{words}, to the first step", bounds, f"{kind}, start")


def _most(figure: str, needed: float, unit: str) -> Bound:
    return Bound(figure, needed, unit, at_most=True)


AIMS = (
    _steps("four planar arms", 4.5, 30.0),
    _steps("two A460", 2.4),
    _steps("two UR5", 3.0, 5.0),
    _steps("two Panda", 3.0, 5.0),
    _steps("sixteen UR5", 5.0),
    _steps("sixteen Panda", 5.0),
    Aim(
        "64 to 10,000 planar arms, the least gain",
        (Bound("rings, least factor", 4.5, "x", lanes=4.5),),
        "rings",
    ),
    Aim(
        "16 to 10,000 planar arms, largest cost per robot by least",
        (_most("rings, spread", 1.3, "x"),),
        "rings",
    ),
    _steps("30 joints", 2.0),
    Aim(
        "sweep of 10,000 runs of 5 s in steps of 1 ms, two cores",
        (_most("sweep of 5 s, now wall", 12.0, "s wall"), Bound("sweep of 5 s, wall factor", 7.0, "x")),
        "sweep of 5 s",
    ),
    Aim(
        "sweep of 10,000 runs of 2 s in steps of 2 ms, two cores",
        (_most("sweep of 2 s, now wall", 3.0, "s wall"),),
        "sweep of 2 s",
    ),
    _start(
        "10,000 planar arms in one ring", "planar arms",
        _most("planar arms, now seconds", 5.0, "s"), Bound("planar arms, seconds factor", 16.0, "x"),
    ),
    _start(
        "10,000 planar arms in one ring, memory", "planar arms",
        _most("planar arms, now memory", 1.0, "GB"), Bound("planar arms, memory factor", 14.0, "x"),
    ),
    _start("1,000 UR5 in one ring", "UR5", _most("UR5, now seconds", 5.0, "s")),
    _start("1,000 UR5 in one ring, memory", "UR5", _most("UR5, now memory", 1.0, "GB")),
    Aim(
        "`certify` of 5 s of four planar arms",
        (_most("certify, now", 0.15, "s"), Bound("certify, factor", 7.3, "x")),
        "certify, factor",
    ),
    Aim("`make reproduce` after installation", (_most("reproduce, now", 35.0, "s wall"),), "reproduce"),
    Aim("compile any ready cell", (_most("compile, longest", 5.0, "s wall"),)),
)  # fmt: skip


def table(figures: Figures, features: tuple[str, ...], then: str) -> Table:
    """Every aim, what was found, and whether it was reached.

    Args:
        figures: of the comparison.
        features: of the processor, see `benchmark_report.vectors`.
        then: what the other version is called.
    """
    rows = []
    for aim in AIMS:
        bounds = [bound._replace(needed=asked(bound, features)) for bound in aim.bounds]
        found = "; ".join(reached(figures, bound) for bound in bounds)
        needed = "; ".join(f"{'at most ' * bound.at_most}{bound.needed:.3g} {bound.unit}" for bound in bounds)
        rows.append([aim.words, needed, found, verdict(aim, bounds, figures)])
    note = (
        f"x is how many times faster, or smaller, than {then}. Found are the median of all runs of the "
        "benchmark, and the least and largest of them."
    )
    return Table("Aims", note, ("what", "aim on this machine", "found", "reached"), rows)


def asked(bound: Bound, features: tuple[str, ...]) -> float:
    """What a bound is on a machine with these vectors."""
    if bound.lanes is None or "avx512f" in features:
        return bound.needed
    gain = 1 + WITH_AVX2 * (bound.lanes - 1) if "avx2" in features else min(WITHOUT, bound.lanes)
    return bound.needed * gain / bound.lanes


def reached(figures: Figures, bound: Bound) -> str:
    """What was found, with its spread."""
    if bound.figure not in figures.values:
        return "not measured"
    values = figures.values[bound.figure]
    middle = f"{np.median(values):.3g} {bound.unit}"
    return middle if len(values) == 1 else f"{middle} ({min(values):.3g} to {max(values):.3g})"


def verdict(aim: Aim, bounds: list[Bound], figures: Figures) -> str:
    """Whether an aim is reached, by the medians; with a remark, and with the reason if it is not."""
    there = [bound for bound in bounds if bound.figure in figures.values]
    remark = figures.remarks.get(aim.known_as, "")
    if not there:
        names = [aim.known_as, *(bound.figure for bound in bounds)]
        why = next((figures.missing[name] for name in names if name in figures.missing), "left out")
        return f"not measured: {_short(why)}"
    met = [bound for bound in there if _holds(bound, figures.median(bound.figure))]
    words = "yes" if len(met) == len(bounds) else "missed" if not met else f"only {_listed(met)}"
    if 0 < len(there) < len(bounds):
        words += f", {_listed([bound for bound in bounds if bound not in there])} not measured"
    words += _not_always(there, figures)
    if len(met) < len(there):
        words += f": {REASONS.get(aim.words, NO_REASON)}"
    return f"{words} ({remark})" if remark else words


def _listed(bounds: list[Bound]) -> str:
    return " and ".join(f"{bound.needed:.3g} {bound.unit}" for bound in bounds)


def _holds(bound: Bound, value: float) -> bool:
    return value <= bound.needed if bound.at_most else value >= bound.needed


def _not_always(bounds: list[Bound], figures: Figures) -> str:
    """Of how many runs the same can be said, where not of all."""
    kinds = [[_holds(bound, value) for value in figures.values[bound.figure]] for bound in bounds]
    split = [kind for kind in kinds if any(kind) and not all(kind)]
    return "".join(f", in {sum(kind)} of {len(kind)} runs" for kind in split)


def _short(text: str) -> str:
    return text.splitlines()[0].replace("|", "/")[:160] if text else text
