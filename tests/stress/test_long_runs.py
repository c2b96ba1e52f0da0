"""Runs that are ended at any moment, logged at any interval, and long ones."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from memory_use import memory_use
from test_interrupts import ENGINES, Faulty, Strike, assert_begins, raising

from synctrl import Cell, Coupling, Cubic, Disturbance, Experiment, Member, Result, load_robot
from synctrl.errors import RunInterrupted, SimulationError
from synctrl.experiments import planar_four
from synctrl.simulation.result import LAYOUT

MB = 1_000_000


@pytest.mark.parametrize("engine", ["compiled"])
def test_an_hour_takes_little_memory_beyond_the_arrays_of_its_result(engine, record_property):
    use = memory_use(engine, 3600.0, 0.01)
    record_property(
        "figure",
        f"one hour at 1 kHz logged at 100 Hz, {engine}: {use.beyond / MB:.1f} MB beyond the "
        f"{use.arrays / MB:.0f} MB of the arrays",
    )
    assert use.rows == 360_001
    assert use.beyond < 50 * MB


CHILD = """
import sys
from synctrl.errors import RunInterrupted
from synctrl.experiments import planar_four

engine, duration, path = sys.argv[1], float(sys.argv[2]), sys.argv[3]
told = []

def progress(t):
    told.append(t)
    print(t, flush=True)

try:
    planar_four().simulate(duration, engine=engine, progress=progress)
except RunInterrupted as stop:
    stop.result.save(path)
    print("interrupted", told[-1], flush=True)
"""


def interrupted(engine, duration, lines, path):
    """The result of a run that gets Ctrl-C once it has told its progress so many times, and what it told."""
    command = [sys.executable, "-c", CHILD, engine, str(duration), str(path)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    for _ in range(lines):
        assert child.stdout.readline()
    child.send_signal(signal.SIGINT)
    *_, last = child.communicate(timeout=300)[0].splitlines()
    assert (child.returncode, last.split()[0]) == (0, "interrupted")
    return Result.load(path), float(last.split()[1])


@pytest.mark.parametrize(("engine", "duration"), [("pinocchio", 10.0), ("compiled", 60.0)])
def test_ctrl_c_at_any_moment_hands_over_the_bits_of_the_whole_run(
    engine, duration, tmp_path, record_property
):
    rng, runs = np.random.default_rng(0), []
    for lines in rng.integers(1, 20, 10):
        kept, told = interrupted(engine, duration, int(lines), tmp_path / "kept.npz")
        assert kept.t[-1] >= told - 1.5e-3
        runs.append(kept)
    longest = max(len(kept.t) for kept in runs)
    whole = planar_four().simulate(longest * 1e-3, engine=engine)
    for kept in runs:
        assert_begins(kept, whole, len(kept.t))
    record_property(
        "figure",
        f"{len(runs)} of {len(runs)} runs ended by SIGINT, {engine}: equal to the whole run, bit for bit",
    )


@pytest.mark.parametrize("control_period", [None, 4e-3])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_fault_at_any_instant_keeps_all_steps_before_it(
    engine, control_period, monkeypatch, record_property
):
    arm, rng, count = load_robot("planar2r"), np.random.default_rng(1), 0
    still = Member(arm, Cubic([0.3, 1.0], [0.5, 0.8], 1.0))
    options = {"engine": engine, "control_period": control_period}

    def run(act, fault):
        monkeypatch.setattr("test_interrupts.FAULT", fault)
        cell = Cell([still, Member(arm, Faulty(act))], Coupling.pair())
        return Experiment(cell, SMALL_GAINS, 3.0).simulate(**options)

    whole = run(raising(AssertionError("never")), -1.0)
    for k in rng.integers(0, 3000, 25).tolist():
        for error, kind in ((Strike("now"), SimulationError), (KeyboardInterrupt(), RunInterrupted)):
            with pytest.raises(kind) as stop:
                run(raising(error), (k + 0.5) * 1e-3)
            assert_begins(stop.value.result, whole, k)
            count += 1
    record_property("figure", f"{count} of {count} faults, {engine}, period {control_period}: all steps kept")


def test_the_interval_of_the_log_changes_nothing_else(record_property):
    rng, count = np.random.default_rng(2), 0
    for _ in range(40):
        dt = float(rng.choice([1e-3, 2e-3, 1.3e-3]))
        duration, edges = float(rng.uniform(0.05, 0.3)), np.sort(rng.uniform(0.0, 0.3, 2))
        push = [Disturbance(0, float(rng.uniform(-1, 1)), float(edges[0]), float(edges[1]))]
        experiment = Experiment(small_cell(), SMALL_GAINS, duration, push)
        for options in ({}, {"control_period": 3 * dt}, {"engine": "compiled"}, {"integrator": "RK45"}):
            every = int(rng.integers(1, 40))
            whole = experiment.simulate(dt=dt, **options)
            thin = experiment.simulate(dt=dt, log_dt=every * dt, **options)
            for name in LAYOUT:
                np.testing.assert_array_equal(getattr(thin, name), getattr(whole.decimated(every), name))
            count += 1
    record_property("figure", f"{count} of {count} logs at longer intervals: bits of the whole log")
