"""A comparison of the working tree with another commit as tables, and as a part of a page."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import benchmark_aims
import numpy as np
from benchmark_features import FEATURES
from benchmark_figures import FULL, QUICK, Amount, Figures
from benchmark_pair import Pair, side_by_side
from benchmark_report import Table, machine, vectors
from benchmark_steps import features, lanes, rings, steps
from benchmark_whole import certificates, compilation, large_cells, reproduction, sweeps

ALWAYS = (steps, large_cells, rings, features, lanes, sweeps, certificates, compilation)
PARTS = {part.__name__: part for part in (*ALWAYS, reproduction)}


def compare(
    commit: str, quick: bool, runs: int | None, parts: Sequence[str]
) -> tuple[dict[str, str], list[Table], Figures]:
    """What was measured on what, the tables, and all figures.

    Args:
        commit: the other version.
        quick: whether little is measured.
        runs: how often; by default as often as the amount says.
        parts: names of `PARTS`.

    Raises:
        Unmeasured: there is no such commit.
    """
    amount, load = QUICK if quick else FULL, _load()
    amount = amount._replace(runs=runs or amount.runs)
    with side_by_side(commit) as pair:
        figures, took, ended = measured(pair, amount, parts)
        about = {"working tree": pair.now_is, "compared with": pair.then_is, **machine()}
        about |= {
            "runs": f"{amount.runs}{'' if ended else ', interrupted'}",
            "made on": time.strftime("%-d %B %Y"),
            "took": f"{took / 60:.0f} min",
            "programs that wanted a core": f"{load} before, {_load()} after",
        }
        return about, tables(figures, amount, pair.then_is, not quick), figures


def measured(pair: Pair, amount: Amount, parts: Sequence[str]) -> tuple[Figures, float, bool]:
    """All figures, how long that took, s, and whether it came to its end: Ctrl-C leaves out the rest."""
    figures, start = Figures(), time.perf_counter()
    try:
        for run in range(amount.runs):
            for name in parts:
                PARTS[name](pair, amount, figures)
                _say(f"{time.perf_counter() - start:5.0f} s, run {run + 1} of {amount.runs}: {name}")
    except KeyboardInterrupt:
        return figures, time.perf_counter() - start, False
    return figures, time.perf_counter() - start, True


def _load() -> str:
    """How many programs there are that run or want to."""
    try:
        return f"{os.getloadavg()[0]:.1f}"
    except (AttributeError, OSError):
        return "unknown"


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


# -- tables -----------------------------------------------------------------------------------------------


def tables(figures: Figures, amount: Amount, then: str, aims: bool) -> list[Table]:
    """All of them; the aims only where what they are about was measured in full."""
    return [
        *([benchmark_aims.table(figures, vectors(), then)] if aims else []),
        _steps(figures, amount, then),
        _features(figures, amount, then),
        _lanes(figures, amount),
        _whole(figures, amount, then),
        _compilation(figures, amount, then),
    ]


def _steps(figures: Figures, amount: Amount, then: str) -> Table:
    cells = [*amount.cells, *(f"ring of {size}" for size in amount.rings)]
    rows = []
    for cell in cells:
        names = "factor", "factor of all", "now", "then", "rollout"
        rows.append([cell, *(_spread(figures, f"{cell}, {name}") for name in names)])
        rows[-1][1] = rows[-1][1] or _why(figures, f"{cell}, factor")
    note = (
        "Steps of 1 ms, every one logged, without what comes before the first. The first factor and the "
        "times are with desired motions and weights looked up, as in a sweep; the second factor is with "
        "these computed on the way by Python, as in a single run. Where the other version was not asked for "
        "a ring of a size, the factor is against its largest. The last column is robot-steps of the cell by "
        "steps of one such arm in `mujoco.rollout`: RK4, open loop, one thread."
    )
    columns = ("cell", f"times {then}", "with desired motions", "µs/robot-step", f"µs/robot-step, {then}")
    return Table("Steps", note, (*columns, "times mujoco.rollout"), rows)


def _features(figures: Figures, amount: Amount, then: str) -> Table:
    rows = []
    for name in amount.features or FEATURES:
        cost = _spread(figures, f"{name}, cost") or _why(figures, f"{name}, cost")
        of_all = _spread(figures, f"{name}, cost of all")
        gain = _spread(figures, f"{name}, factor") or "not there" * (f"{name}, factor" in figures.missing)
        rows.append([name, FEATURES[name].cell, cost, of_all, gain])
    note = (
        "What a step takes with a feature by what it takes without: with desired motions and weights looked "
        "up, and with these computed on the way. The last column is how many times faster than in "
        f"{then} a step with the feature is, where that version has it."
    )
    columns = ("feature", "of", "times the step without", "with desired motions", f"times {then}")
    return Table("Features", note, columns, rows)


def _lanes(figures: Figures, amount: Amount) -> Table:
    rows = [
        [cell, width, _spread(figures, f"{cell}, {width} lanes") or _why(figures, f"{cell}, {width} lanes")]
        for cell, widths in amount.lanes.items()
        for width in widths
    ]
    note = "Robots of a kind side by side in vectors, against the same code for one robot at a time."
    return Table("Lanes", note, ("cell", "lanes", "times one lane"), rows)


def _whole(figures: Figures, amount: Amount, then: str) -> Table:
    rows = []
    for duration, _ in amount.sweeps:
        name = f"sweep of {duration:g} s"
        for what, words in (("wall", "wall, s"), ("seconds", "CPU, s")):
            rows.append([f"{name}, {words}", *_both(figures, f"{name}, {{}} {what}")])
            rows[-1].append(figures.remarks.get(name, ""))
    for kind, robots in amount.large.items():
        for what, words in (("seconds", "CPU, s"), ("memory", "memory, GB"), ("build", "cell, CPU, s")):
            name = f"{robots:,} {kind}, first step: {words}"
            rows.append(
                [name, *_both(figures, f"{kind}, {{}} {what}"), figures.remarks.get(f"{kind}, start", "")]
            )
    rows.append([f"`certify` of {amount.judged:g} s, CPU, s", *_both(figures, "certify, {}"), ""])
    rows.append(["`make reproduce`, wall, s", *_both(figures, "reproduce, {}"), _why(figures, "reproduce")])
    note = (
        f"{then} makes a tenth of the robots, of which ten times is said here, and sweeps of "
        f"{amount.few[0]} and {amount.few[1]} runs, from which {amount.swept:,} are concluded by a straight "
        "line. Memory is that of the whole process; to make the robots and the cell comes before "
        "`Experiment(...)`."
    )
    return Table("Whole tasks", note, ("what", "working tree", then, "remark"), rows)


def _compilation(figures: Figures, amount: Amount, then: str) -> Table:
    rows = []
    for cell in amount.ready:
        values = [_spread(figures, f"compile {cell}, now {what}") for what in ("wall", "seconds")]
        values[0] = values[0] or _why(figures, f"compile {cell}, now")
        rows.append([cell, *values, _spread(figures, f"compile {cell}, then wall")])
    note = (
        "A first run of two steps in a new process on an empty cache, without payloads. CPU time includes "
        "the compiler's."
    )
    return Table("Compile time", note, ("ready cell", "wall, s", "CPU, s", f"wall, s, {then}"), rows)


def _both(figures: Figures, name: str) -> list[str]:
    return [_spread(figures, name.format(by)) or "not measured" for by in ("now", "then")]


def _spread(figures: Figures, name: str) -> str:
    """A figure's median, least and largest value, or nothing."""
    if name not in figures.values:
        return ""
    values = np.array(figures.values[name])
    middle = _number(float(np.median(values)))
    return middle if values.size == 1 else f"{middle} ({_number(values.min())} to {_number(values.max())})"


def _number(value: Any) -> str:
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def _why(figures: Figures, name: str) -> str:
    """Why a figure is not there."""
    reason = figures.missing.get(name, "")
    if not reason:
        return "not measured"
    kind, _, words = reason.splitlines()[0].partition(": ")
    return (words or kind).split(";")[0].replace("|", "/")[:120]


# -- pages ------------------------------------------------------------------------------------------------


def into_page(page: Path, name: str, text: str) -> str:
    """The page with a text between the two marks of a name.

    Raises:
        ValueError: it has no such marks.
    """
    begin, end = f"<!-- benchmark {name}: begin -->", f"<!-- benchmark {name}: end -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"'{page}' has no part between '{begin}' and '{end}'")
    return f"{before}{begin}\n\n{text.strip()}\n\n{end}{after}"
