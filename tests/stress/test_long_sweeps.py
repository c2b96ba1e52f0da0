"""Sweeps under stress: killed again and again, started by many at once, and with every line damaged."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from sweeps import begun, quiet, slow_sweep, small_sweep, take

from synctrl.errors import ResultError, SweepFileError
from synctrl.sweep import load

pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
TESTS = Path(__file__).resolve().parents[1]
ENV = {**os.environ, "PYTHONPATH": os.pathsep.join((str(TESTS.parent), str(TESTS)))}

KILLED = """
from sweeps import slow_sweep
slow_sweep(0.05).run({folder!r}, {workers}, {backend!r}, batch=1, progress=False)
"""
KILLS = 30
ROUNDS = 300
CHANGES = 2000


def lines(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def kill_after(script: str, path: Path, count: int, pause: float) -> None:
    """Start a script and kill it a moment after the file has as many lines, with the processes it started."""
    with subprocess.Popen([sys.executable, "-c", script], env=ENV, start_new_session=True) as process:
        while lines(path) < count and process.poll() is None:
            time.sleep(0.002)
        time.sleep(pause)
        os.killpg(process.pid, signal.SIGKILL)


def test_sweeps_that_are_killed_go_on_and_are_equal_to_the_last_bit(tmp_path, record_property):
    whole = quiet(slow_sweep(0), tmp_path / "whole", backend="serial")
    rng = np.random.default_rng(0)
    cut, equal = 0, 0
    for number in range(KILLS):
        folder = tmp_path / str(number)
        workers, backend = [(1, "serial"), (2, "joblib")][number % 2]
        script = KILLED.format(folder=str(folder), workers=workers, backend=backend)
        kill_after(script, folder / "runs.jsonl", int(rng.integers(0, 7)), float(rng.uniform(0, 0.1)))
        cut += lines(folder / "runs.jsonl") < len(slow_sweep(0))
        equal += quiet(slow_sweep(0), folder, backend="serial") == whole
    record_property(
        "figure", f"{equal} of {KILLS} SIGKILLed sweeps equal to the last bit; {cut} were cut short"
    )
    assert equal == KILLS
    assert cut > KILLS // 2


def test_of_processes_that_start_one_folder_at_once_one_has_it(tmp_path, record_property):
    pytest.importorskip("fcntl", reason="this system has no locks of this kind")
    processes, told = 4, Counter()
    for said in take(tmp_path, processes, ROUNDS):
        told[tuple(sorted(said))] += 1
    expected = ("another process has it",) * (processes - 1) + ("mine",)
    record_property(
        "figure",
        f"{told[expected]} of {ROUNDS} folders that {processes} processes started at once went to one",
    )
    assert told == {expected: ROUNDS}


OTHER = [None, True, -1, 7, 99999, 0.5, 1e300, "NaN", "", "completed", "stopped", [], {}, float("nan")]


def test_any_line_with_another_entry_is_a_row_or_an_error_that_names_it(tmp_path, record_property):
    """Changed measures cannot be told from true ones; everything else that is changed is found."""
    sweep = small_sweep(samples=8)
    quiet(sweep, tmp_path, backend="serial")
    path = tmp_path / "runs.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rng = np.random.default_rng(0)
    refused, accepted = 0, Counter()
    columns = json.loads((tmp_path / "sweep.json").read_text())["columns"]
    for _ in range(CHANGES):
        number, column = int(rng.integers(len(rows))), int(rng.integers(len(columns)))
        changed = [list(row) for row in rows]
        changed[number][column] = OTHER[int(rng.integers(len(OTHER)))]
        if changed == rows:
            continue
        path.write_text("".join(json.dumps(row) + "\n" for row in changed))
        try:
            table = load(tmp_path)
        except SweepFileError as error:
            assert f"runs.jsonl', line {number + 1}: " in str(error) or "again; line" in str(error)
            refused += 1
        else:
            assert len(table) == len(rows)
            accepted[columns[column]] += 1
    measures = set(columns[columns.index("stop_time") + 1 :])
    record_property(
        "figure", f"{refused} changed lines refused, {sum(accepted.values())} plausible measures taken"
    )
    assert set(accepted) <= measures


def test_any_damaged_bytes_are_rows_or_an_error_of_this_package(tmp_path, record_property):
    quiet(small_sweep(samples=8), tmp_path, backend="serial")
    begun(small_sweep(samples=8), tmp_path).close()
    rng = np.random.default_rng(0)
    refused = taken = 0
    for name in ("runs.jsonl", "sweep.json"):
        path = tmp_path / name
        content = path.read_bytes()
        for _ in range(CHANGES // 2):
            damaged = bytearray(content)
            for place in rng.integers(len(content), size=int(rng.integers(1, 4))):
                damaged[place] = int(rng.integers(256))
            path.write_bytes(bytes(damaged))
            try:
                load(tmp_path)
                taken += 1
            except ResultError as error:
                assert name in str(error)
                refused += 1
        path.write_bytes(content)
    record_property("figure", f"{refused} damaged folders refused by name, {taken} read")
    assert refused > 0
