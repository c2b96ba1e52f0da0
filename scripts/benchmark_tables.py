"""Tables of one version: both engines, a naive loop, bare Pinocchio calls, and other libraries.

One robot-step is one robot, one step of 1 ms of the classical Runge-Kutta method, and the full adaptive law
in all four stages. Everything runs in one process and one thread; what is compared takes turns, and the
median of all rounds counts. Times are CPU times, because other programs disturb these less.
"""

from __future__ import annotations

import os
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from benchmark_cells import CELLS, MOTION, START, planar_chain, planar_ring
from benchmark_report import Table, is_installed, markdown
from computed_torque import Task, exact, installed
from naive_loop import BareCalls, NaiveLoop

from synctrl import Experiment, load_robot
from synctrl.compiled.engine import Compiled
from synctrl.errors import SimulationError
from synctrl.experiments import (
    a460_pair,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)  # fmt: skip
from synctrl.simulation.engines import run_reference

DT = 1e-3
MOST_STEPS = 10_000
READY = {
    "planar_four": planar_four, "a460_pair": a460_pair, "rigid_object": rigid_object,
    "mobile_robot": mobile_robot, "panda_four": panda_four, "mixed_four": mixed_four,
    "ur5_payload": ur5_payload,
}  # fmt: skip


class Effort(NamedTuple):
    """How much to measure."""

    rounds: int
    seconds: float
    cells: tuple[str, ...]
    robots: tuple[int, ...]
    joints: tuple[int, ...]
    horizons: tuple[float, ...]
    steps: tuple[float, ...]
    arms: tuple[str, ...]
    ready: tuple[str, ...]
    span: float


FULL = Effort(
    7, 0.3, tuple(CELLS), (4, 16, 64, 256, 1024), (2, 4, 8, 16, 30), (0.5, 1.0, 2.0, 4.0, 8.0),
    (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3), ("planar2r", "ur5", "panda"), tuple(READY), 0.48,
)  # fmt: skip
QUICK = Effort(
    2, 0.01, ("four planar arms",), (4, 8), (2,), (0.02, 0.04), (2e-3, 4e-3), ("planar2r",), (), 0.02
)

Run = Callable[[int], Any]
"""Runs a number of steps."""


# -- measuring --------------------------------------------------------------------------------------------


def seconds(run: Run, steps: int) -> float:
    """CPU time of so many steps, s."""
    start = time.process_time()
    run(steps)
    return time.process_time() - start


def enough(run: Run, effort: Effort) -> int:
    """How many steps take about as long as one measurement should."""
    run(5)  # code is generated and compiled in a first run
    before, steps = seconds(run, 5), 10
    goal = max(effort.seconds, before)  # steps have to outweigh what comes before them
    while (spent := seconds(run, steps) - before) < 0.2 * goal and steps < MOST_STEPS:
        steps *= 2
    return int(np.clip(steps * goal / max(spent, 1e-9), 10, MOST_STEPS))


def per_step(runs: dict[Any, Run], effort: Effort) -> dict[Any, float]:
    """Seconds of each per step, without what a run costs before its first step."""
    steps = {name: enough(run, effort) for name, run in runs.items()}
    found: dict[Any, list[float]] = {name: [] for name in runs}
    for _ in range(effort.rounds):
        for name, run in runs.items():
            few = steps[name] // 5
            found[name].append((seconds(run, steps[name]) - seconds(run, few)) / (steps[name] - few))
    return {name: float(np.median(times)) for name, times in found.items()}


def engines(experiment: Experiment) -> dict[str, Run]:
    """Both engines, or only the reference where the other cannot be had."""
    runs: dict[str, Run] = {"reference": lambda steps: run_reference(experiment.plan(steps * DT, DT))}
    compiled = Compiled({})
    if is_installed("casadi"):
        runs["compiled"] = lambda steps: compiled.run(experiment.plan(steps * DT, DT))
    return runs


def peak(run: Run, steps: int) -> float:
    """Largest memory that a run holds at once, MB, as Python's allocator counts it."""
    tracemalloc.start()
    run(steps)
    memory = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return memory / 1e6


# -- tables -----------------------------------------------------------------------------------------------


def cells(effort: Effort) -> Table:
    """Every way to run every cell."""
    rows = []
    for name in effort.cells:
        experiment = CELLS[name]()
        naive, bare = NaiveLoop(experiment), BareCalls(experiment)
        runs = {
            "bare calls": bare.run,
            **engines(experiment),
            "naive loop": lambda k, loop=naive: loop.run(k, DT),
        }
        times, n = per_step(runs, effort), experiment.cell.n
        for way, spent in times.items():
            row = [name, way, n / spent, DT / spent, spent / times["bare calls"], times["naive loop"] / spent]
            rows.append([*row, peak(runs[way], 100)])
    note = (
        "Bare calls are the Pinocchio calls that the law needs and nothing else; the naive loop is the law "
        "as one would first write it. Memory is the peak during a run of 100 steps, logged at every step."
    )
    columns = ("cell", "way", "robot-steps/s", "real-time factor", "times bare", "times naive", "memory MB")
    return Table("Cells", note, columns, rows)


def growth(title: str, unit: str, sizes: tuple, cell: Callable[[Any], Experiment], effort: Effort) -> Table:
    """What a robot-step costs as a cell grows; all sizes take turns."""
    experiments = {size: cell(size) for size in sizes}
    ways = {(size, way): run for size in sizes for way, run in engines(experiments[size]).items()}
    times = per_step(ways, effort)
    rows = [[*key, 1e6 * spent / experiments[key[0]].cell.n] for key, spent in times.items()]
    return Table(
        title, "Without what a run costs before its first step.", (unit, "way", "µs/robot-step"), rows
    )


def rings(effort: Effort) -> Table:
    """Planar arms in one ring."""
    return growth("Robots in one signed ring", "planar arms", effort.robots, planar_ring, effort)


def joints(effort: Effort) -> Table:
    """Planar arms with more and more joints."""
    return growth("Joints", "joints", effort.joints, planar_chain, effort)


def horizons(effort: Effort) -> Table:
    """What a whole call costs as runs get longer."""
    runs = engines(planar_four())
    cases = [(horizon, way) for horizon in effort.horizons for way in runs]
    rounds = [[seconds(runs[way], round(h / DT)) for h, way in cases] for _ in range(min(effort.rounds, 3))]
    rows = []
    for (horizon, way), spent in zip(cases, np.median(rounds, axis=0).tolist(), strict=True):
        steps = round(horizon / DT)
        rows.append([horizon, way, spent, 1e6 * spent / (4 * steps), peak(runs[way], steps)])
    columns = ("horizon s", "way", "whole run s", "µs/robot-step", "memory MB")
    return Table("Horizon", "Four planar arms, logged at every step.", columns, rows)


def accuracy(effort: Effort) -> Table:
    """Error and cost of several steps, for speed at equal error."""
    rows = []
    for name in effort.cells[:3]:
        experiment = CELLS[name]()
        tight = experiment.simulate(effort.span, effort.span, "DOP853", rtol=1e-12, atol=1e-14).q[-1]
        for dt in effort.steps:
            for way, run in last_positions(experiment, effort.span, dt).items():
                start = time.process_time()
                try:
                    error = float(np.abs(run() - tight).max())
                except SimulationError:
                    error = np.inf  # the step is too long for the method
                rows.append([name, way, 1e3 * dt, error, (time.process_time() - start) / effort.span])
    note = "Largest error of a joint position at the end, against DOP853 with a tolerance of 1e-12."
    return Table("Accuracy", note, ("cell", "way", "step ms", "error rad", "s per simulated s"), rows)


def last_positions(experiment: Experiment, span: float, dt: float) -> dict[str, Callable[[], np.ndarray]]:
    """Ways to get the joint positions after so many seconds, (n, nv)."""
    naive, compiled = NaiveLoop(experiment), Compiled({})
    runs: dict[str, Callable[[], np.ndarray]] = {
        "reference": lambda: run_reference(experiment.plan(span, dt)).q[-1],
        "naive loop": lambda: naive.run(round(span / dt), dt)[-1],
    }
    if is_installed("casadi"):
        compiled.load(experiment.plan(dt, dt))
        runs["compiled"] = lambda: compiled.run(experiment.plan(span, dt)).q[-1]
    return runs


def peers(effort: Effort) -> Table:
    """Computed torque on one arm by the libraries that are installed."""
    rows = []
    for name in effort.arms:
        start = np.array(START.get(name, (0.4, 1.2)))
        task = Task(load_robot(name), start, MOTION)
        arms, goal = installed(task), exact(task, 50 * DT)
        times = per_step({way: lambda k, arm=arm: arm.run(k, DT) for way, arm in arms.items()}, effort)
        for way, arm in arms.items():
            error = float(np.abs(arm.run(50, DT) - goal).max())
            rows.append([name, way, 1 / times[way], DT / times[way], error])
    note = (
        "One arm under computed torque from Python: steps of 1 ms of the classical Runge-Kutta method, the "
        "control in all four stages. Error as above, after 0.05 s."
    )
    return Table("Peers", note, ("arm", "library", "robot-steps/s", "real-time factor", "error rad"), rows)


def compilation(effort: Effort) -> Table:
    """How long the compiled engine takes to come to be, and to be found again."""
    rows = []
    for name in effort.ready if is_installed("casadi") else ():
        experiment = READY[name]()
        if experiment.payloads:
            experiment = Experiment(experiment.cell, experiment.gains, experiment.duration)
        first, again = [_first_run(experiment) for _ in range(2)]
        rows.append([name, *first, again[0]])
    note = (
        "A first run of two steps, without a cache and with it; a cell of robots that were compiled for one "
        "above finds them. CPU time includes the compiler's, on up to one core per kind. Payloads left out."
    )
    return Table("Compile time", note, ("ready cell", "first, wall s", "first, CPU s", "again, wall s"), rows)


def _first_run(experiment: Experiment) -> tuple[float, float]:
    """Wall time and CPU time of a short run with nothing loaded, s."""
    start, before = time.perf_counter(), os.times()
    Compiled().run(experiment.plan(2 * DT, DT))
    spent, after = time.perf_counter() - start, os.times()
    return spent, sum(after[:4]) - sum(before[:4])


def measure(effort: Effort) -> list[Table]:
    """Measure and print all tables."""
    tables = []
    with tempfile.TemporaryDirectory() as cache:
        os.environ["SYNCTRL_CACHE"] = cache  # an empty one, so that compile times are those of the first time
        for make in (compilation, cells, rings, joints, horizons, accuracy, peers):
            tables.append(make(effort))
            print(markdown(tables[-1:]), flush=True)
    return tables
