"""The benchmark: what it compares is the same thing, and it runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))

from benchmark_cells import joint_cell, planar_ring  # noqa: E402
from computed_torque import PEERS, Task, exact  # noqa: E402
from naive_loop import NaiveLoop  # noqa: E402

from synctrl import load_robot  # noqa: E402
from synctrl.experiments import a460_pair, planar_four  # noqa: E402

CELLS = {
    "planar four": planar_four,
    "A460 pair": a460_pair,
    "ring of five": lambda: planar_ring(5),
    "UR5 pair": lambda: joint_cell("ur5", 2),
}


@pytest.mark.parametrize("engine", ["pinocchio", "compiled"])
@pytest.mark.parametrize("name", CELLS)
def test_the_naive_loop_makes_the_trajectories_of_both_engines(name, engine):
    experiment = CELLS[name]()
    expected = NaiveLoop(experiment).run(20, 2e-3)
    found = experiment.simulate(0.04, 2e-3, engine=engine).q
    assert np.abs(expected - expected[0]).max() > 1e-6  # it moves
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("library", ["Pinocchio", "MuJoCo"])
def test_every_library_solves_the_same_problem_with_the_same_order(library):
    task = Task(load_robot("planar2r"), np.array([0.4, 1.2]), 2.0)
    arm, goal = PEERS[library](task), exact(task, 0.16)
    errors = [np.abs(arm.run(round(0.16 / dt), dt) - goal).max() for dt in (8e-3, 4e-3)]
    assert errors[0] < 1e-6
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.2)


def test_the_script_writes_its_tables(tmp_path):
    command = [sys.executable, str(SCRIPTS / "benchmark.py"), "--quick", str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    written = json.loads((tmp_path / "benchmark.json").read_text())
    report = (tmp_path / "benchmark.md").read_text()
    assert written["machine"]["cores"]
    for table in written["tables"]:
        assert f"## {table['title']}" in report
        assert all(len(row) == len(table["columns"]) for row in table["rows"])
    ways = {row[1] for row in written["tables"][1]["rows"]}
    assert {"bare calls", "naive loop", "reference"} <= ways
