"""How much of a comparison is measured, and the figures that are found: numbers by name, one per run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmark_pair import Job, Unmeasured

#: share of the free memory, and seconds, that one measurement may take
SHARE, LONGEST = 0.6, 60.0
READY_THEN = (
    "planar_four", "a460_pair", "a460_full_pair", "rigid_object", "mobile_robot", "panda_four", "mixed_four",
    "ur5_payload",
)  # fmt: skip
READY = (*READY_THEN, "carry_planar", "carry_ur5", "bead_on_edge", "bead_on_path")


class Amount(NamedTuple):
    """How much to measure.

    `large` are numbers of robots of cells whose way to the first step is measured, by kind; `sweeps` are
    pairs of duration and step, s, of `swept` runs, which are concluded from two smaller numbers, `few`, where
    they would take long; `judged` is how long the run lasts that is certified, s, and `reproduced` are
    options of `reproduce.py`.
    """

    runs: int
    rounds: int
    seconds: float
    cells: tuple[str, ...]
    rings: tuple[int, ...]
    features: tuple[str, ...] | None
    lanes: dict[str, tuple[int, ...]]
    large: dict[str, int]
    sweeps: tuple[tuple[float, float], ...]
    swept: int
    few: tuple[int, int]
    workers: int
    judged: float
    ready: tuple[str, ...]
    reproduced: tuple[str, ...]


WIDTHS = 1, 2, 4, 8
CELLS = (
    "four planar arms", "two A460", "two UR5", "two Panda", "sixteen UR5", "sixteen Panda", "30 joints",
)  # fmt: skip
FULL = Amount(
    3, 4, 0.1, CELLS, (16, 64, 256, 1024, 4096, 10_000), None,
    {"four planar arms": WIDTHS[:3], "two UR5": WIDTHS[:2], "sixteen UR5": WIDTHS, "ring of 64": WIDTHS},
    {"planar arms": 10_000, "UR5": 1000}, ((5.0, 1e-3), (2.0, 2e-3)), 10_000, (100, 400), 2, 5.0, READY, (),
)  # fmt: skip
QUICK = Amount(
    1, 2, 0.01, ("four planar arms",), (4, 8), ("a log of every tenth step",), {"four planar arms": (1, 2)},
    {"planar arms": 20}, ((0.02, 2e-3),), 8, (2, 4), 1, 0.05, ("planar_four",), ("--quick",),
)  # fmt: skip


class Figures:
    """Numbers by name, one per run; remarks on how they came about; and why others are not there."""

    def __init__(self) -> None:
        self.values: dict[str, list[float]] = defaultdict(list)
        self.remarks: dict[str, str] = {}
        self.missing: dict[str, str] = {}

    def put(self, figures: Mapping[str, float]) -> None:
        """Figures of one run."""
        for name, value in figures.items():
            self.values[name].append(float(value))

    def lack(self, name: str, reason: object) -> None:
        """A figure that cannot be had."""
        self.missing[name] = str(reason)

    def median(self, name: str) -> float:
        """Of all runs; nan if there is none."""
        return float(np.median(self.values[name])) if name in self.values else float("nan")


def stepping(by: str, cell: str, amount: Amount, **more: Any) -> Job:
    """Steps of a cell by one of the workers; `more` as in `Bench.per_step`."""
    return Job(by, "per_step", {"cell": cell, "seconds": amount.seconds, **more})


def put_factor(figures: Figures, name: str, found: Mapping, ours: Any, theirs: Any) -> None:
    """The median of the ratios of their time to ours, if both were measured."""
    if ours in found and theirs in found:
        figures.put({name: float(np.median(found[theirs] / found[ours]))})


def check_fits(figures: Figures, kind: str, robots: int) -> None:
    """Refuse robots that take more than there is, as far as a tenth of a large cell tells.

    Raises:
        Unmeasured: they would take too much memory, or too long.
    """
    name = f"{kind}, tenth"
    if f"{name} bytes" not in figures.values or robots < 1000:
        return
    needed, free = robots * figures.median(f"{name} bytes"), _free_memory()
    if needed > SHARE * free:
        raise Unmeasured(f"they would take {needed / 1e9:.2g} GB, of {free / 1e9:.2g} GB that are free")
    share = figures.median(f"{name} seconds") / figures.median(f"{name} robots")
    if share * robots > LONGEST:
        raise Unmeasured(f"they would take {share * robots:.2g} s before the first step")


def _free_memory() -> float:
    """Memory that is free, bytes; infinite where nobody says."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(1024.0 * float(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        return float("inf")
