"""What a step costs: of cells, of rings from small to large, with features, and in lanes.

Times are CPU times. A factor is what the other version takes by what the working tree takes: the median of
the ratios of interleaved rounds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from benchmark_features import FEATURES
from benchmark_figures import Amount, Figures, check_fits, put_factor, stepping
from benchmark_pair import Job, Pair, Unmeasured, in_turns

#: arms that MuJoCo rolls out, by the cell they are compared with
ROLLED = {"four planar arms": "planar2r", "two UR5": "ur5", "two Panda": "panda"}
#: largest ring that the other version is asked for: it takes more than a megabyte for an arm
LARGEST_THEN = 1024


def steps(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Steps of cells: with what is desired looked up, and with what is desired computed on the way."""
    for cell in amount.cells:
        jobs = {
            (by, kept): stepping(by, cell, amount, kept=kept) for by in pair.workers for kept in (True, False)
        }
        if cell in ROLLED:
            about = {"arm": ROLLED[cell], "seconds": amount.seconds}
            jobs["rollout", True] = Job("now", "rollout", about)
        found, failed = in_turns(pair, jobs, amount.rounds)
        for (by, _), reason in failed.items():
            figures.lack(f"{cell}, {'rollout' if by == 'rollout' else 'factor'}", reason)
        put_factor(figures, f"{cell}, factor", found, ("now", True), ("then", True))
        put_factor(figures, f"{cell}, factor of all", found, ("now", False), ("then", False))
        put_factor(figures, f"{cell}, rollout", found, ("now", True), ("rollout", True))
        _put_times(figures, cell, found, {("now", True): "now", ("then", True): "then"})


def rings(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Steps of planar arms in one ring, from small to large, with what is desired looked up."""
    jobs: dict[tuple[str, int], Job] = {}
    for size in amount.rings:
        cell = f"ring of {size}"
        try:
            check_fits(figures, "planar arms", size)
            jobs["now", size] = stepping("now", cell, amount, kept=True)
        except Unmeasured as reason:
            figures.lack(f"{cell}, factor", reason)
        if size <= LARGEST_THEN:
            jobs["then", size] = stepping("then", cell, amount, kept=True)
    found, failed = in_turns(pair, jobs, max(2, amount.rounds // 2))
    largest = max((size for by, size in found if by == "then"), default=0)
    for (by, size), reason in failed.items():
        figures.lack(f"ring of {size}, factor", f"{by}: {reason}")
    for size in amount.rings:
        other = size if ("then", size) in found else largest
        put_factor(figures, f"ring of {size}, factor", found, ("now", size), ("then", other))
        _put_times(figures, f"ring of {size}", found, {("now", size): "now", ("then", size): "then"})
    costs = [float(np.median(found["now", size])) for size in amount.rings if ("now", size) in found]
    compared = [np.median(found["then", min(s, largest)]) / np.median(found["now", s]) for s in _many(found)]
    left = ", ".join(f"{size:,}" for size in amount.rings if ("now", size) not in found)
    figures.remarks["rings"] = f"without {left} arms, which were not measured" if left else ""
    if costs:
        figures.put({"rings, spread": max(costs) / min(costs)})
    if compared:
        figures.put({"rings, least factor": float(min(compared))})


def features(pair: Pair, amount: Amount, figures: Figures) -> None:
    """What every feature costs, against the same run without it, and against the other version."""
    for name in amount.features or FEATURES:
        plain, options = FEATURES[name].cell, FEATURES[name].options
        full = {**options, **FEATURES[name].own}
        jobs: dict[str, Job] = {}
        for key, kept in (("", True), (" of all", False)):
            jobs[f"with{key}"] = stepping("now", name, amount, kept=kept, options=full)
            jobs[f"plain{key}"] = stepping("now", plain, amount, kept=kept, options=dict(options))
        jobs["then"] = stepping("then", name, amount, kept=True, options=full)
        found, failed = in_turns(pair, jobs, max(2, amount.rounds // 2))
        for key in ("", " of all"):
            put_factor(figures, f"{name}, cost{key}", found, f"plain{key}", f"with{key}")
        put_factor(figures, f"{name}, factor", found, "with", "then")
        if "with" in failed:
            figures.lack(f"{name}, cost", failed["with"])


def lanes(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Widths of lanes against one lane."""
    for cell, widths in amount.lanes.items():
        jobs = {width: stepping("now", cell, amount, kept=True, width=width) for width in widths}
        found, failed = in_turns(pair, jobs, max(2, amount.rounds // 2))
        for width in widths:
            put_factor(figures, f"{cell}, {width} lanes", found, width, 1)
        for width, reason in failed.items():
            figures.lack(f"{cell}, {width} lanes", reason)


def _many(found: dict) -> list[int]:
    """Sizes of rings that are called large."""
    sizes = sorted(size for by, size in found if by == "now")
    return [size for size in sizes if size >= 64] or sizes


def _put_times(figures: Figures, cell: str, found: dict, names: dict[Any, str]) -> None:
    """Microseconds per robot-step."""
    for key, name in names.items():
        if key in found:
            figures.put({f"{cell}, {name}": 1e6 * float(np.median(found[key]))})
