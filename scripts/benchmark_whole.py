"""What whole tasks cost: large cells until they move, sweeps, certificates, compilation, reproduction.

Times are CPU times unless they are called wall.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_figures import LONGEST, READY_THEN, Amount, Figures, check_fits, put_factor
from benchmark_pair import Job, Pair, Unmeasured, Worker, in_turns


def large_cells(pair: Pair, amount: Amount, figures: Figures) -> None:
    """From `Experiment(...)` to the first step: a tenth of the robots, and all where that can be had."""
    for kind, robots in amount.large.items():
        tenth, found = robots // 10, {}
        for by, worker in pair.workers.items():
            try:
                worker.once("first_step", kind=kind, robots=2, duration=0.1)  # compiles
                found[by] = _tenfold(worker.once("first_step", kind=kind, robots=tenth, duration=0.1))
            except Unmeasured as reason:
                figures.lack(f"{kind}, start", f"{by}: {reason}")
        if "now" not in found:
            continue
        _put_start(figures, f"{kind}, tenth", found["now"], robots)
        figures.remarks[f"{kind}, start"] = "concluded from a tenth of the robots"
        try:
            check_fits(figures, kind, robots)
            found["now"] = pair.now.once("first_step", kind=kind, robots=robots, duration=0.1)
            figures.remarks[f"{kind}, start"] = "measured with all robots"
        except Unmeasured as reason:
            figures.remarks[f"{kind}, start"] += f", because {reason}"
        for by, answer in found.items():
            _put_start(figures, f"{kind}, {by}", answer, robots)
        if "then" in found:
            for what in ("seconds", "memory"):
                figures.put({f"{kind}, {what} factor": found["then"][what] / found["now"][what]})


def _tenfold(answer: dict[str, float]) -> dict[str, float]:
    return {name: value if name == "base" else 10 * value for name, value in answer.items()}


def _put_start(figures: Figures, name: str, answer: dict[str, float], robots: int) -> None:
    memory = (answer["memory"] + answer["base"]) / 1e9
    figures.put({f"{name} seconds": answer["seconds"], f"{name} memory": memory})
    figures.put({f"{name} build": answer["build"], f"{name} bytes": answer["memory"] / robots})
    figures.put({f"{name} robots": robots})


def sweeps(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Sweeps of many runs: all of them where that does not take long, else as two smaller ones say."""
    for duration, dt in amount.sweeps:
        name = f"sweep of {duration:g} s"
        job = {"duration": duration, "dt": dt, "workers": amount.workers}
        found: dict[str, dict[str, float]] = {}
        for by, worker in pair.workers.items():
            try:
                found[by] = _concluded(worker, amount, job)
            except Unmeasured as reason:
                figures.lack(name, f"{by}: {reason}")
        if "now" in found and found["now"]["wall"] < LONGEST:
            found["now"] = pair.now.once("sweep", runs=amount.swept, **job)
            figures.remarks[name] = f"all {amount.swept:,} runs made"
        elif "now" in found:
            figures.remarks[name] = f"concluded from {amount.few[0]} and {amount.few[1]} runs"
        for by, answer in found.items():
            figures.put({f"{name}, {by} {what}": value for what, value in answer.items()})
        if len(found) == 2:
            for what in ("wall", "seconds"):
                figures.put({f"{name}, {what} factor": found["then"][what] / found["now"][what]})


def _concluded(worker: Any, amount: Amount, job: dict[str, Any]) -> dict[str, float]:
    """What a sweep takes, from a straight line through two smaller ones."""
    few, more = (worker.once("sweep", runs=runs, **job) for runs in amount.few)
    left = (amount.swept - amount.few[1]) / (amount.few[1] - amount.few[0])
    return {what: more[what] + left * max(more[what] - few[what], 0.0) for what in more}


def certificates(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Certificates of four planar arms."""
    jobs = {by: Job(by, "certify", {"duration": amount.judged}) for by in pair.workers}
    found, failed = in_turns(pair, jobs, max(2, amount.rounds // 2))
    for by, times in found.items():
        figures.put({f"certify, {by}": float(np.median(times))})
    put_factor(figures, "certify, factor", found, "now", "then")
    for by, reason in failed.items():
        figures.lack("certify, factor", f"{by}: {reason}")


def compilation(pair: Pair, amount: Amount, figures: Figures) -> None:
    """Every ready cell on an empty cache; the other version once."""
    walls = []
    for cell in amount.ready:
        for by, worker in _once_then(pair, cell, figures):
            try:
                answer = worker.once("compile", cell=cell)
            except Unmeasured as reason:
                figures.lack(f"compile {cell}, {by}", reason)
                continue
            figures.put({f"compile {cell}, {by} {what}": value for what, value in answer.items()})
            walls += [answer["wall"]] * (by == "now")
    if walls:
        figures.put({"compile, longest": max(walls)})


def _once_then(pair: Pair, cell: str, figures: Figures) -> Iterator[tuple[str, Any]]:
    """The workers that are asked for a cell in this run."""
    yield "now", pair.now
    if cell in READY_THEN and f"compile {cell}, then wall" not in figures.values:
        yield "then", pair.then


def reproduction(pair: Pair, amount: Amount, figures: Figures) -> None:
    """The paper's experiments from an empty cache, once each, wall."""
    for by, worker in pair.workers.items():
        with tempfile.TemporaryDirectory() as folder:
            fresh = Worker(worker.folder, Path(folder) / "cache")
            start = time.perf_counter()
            try:
                fresh.script("reproduce.py", "--out", f"{folder}/out", *amount.reproduced)
            except Unmeasured as reason:
                figures.lack("reproduce", f"{by}: {reason}")
            else:
                figures.put({f"reproduce, {by}": time.perf_counter() - start})
