"""The benchmark: what it compares is the same thing, and it runs."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))

from benchmark_aims import AIMS, Bound, asked, table  # noqa: E402
from benchmark_cells import joint_cell, planar_ring  # noqa: E402
from benchmark_comparison import into_page  # noqa: E402
from benchmark_features import FEATURES  # noqa: E402
from benchmark_figures import Figures, check_fits  # noqa: E402
from benchmark_jobs import Bench, cell_named  # noqa: E402
from benchmark_pair import REPOSITORY, Job, Pair, Unmeasured, Worker, in_turns, side_by_side  # noqa: E402
from computed_torque import PEERS, Task, exact  # noqa: E402
from naive_loop import NaiveLoop  # noqa: E402

from synctrl import load_robot  # noqa: E402
from synctrl.experiments import a460_pair, planar_four  # noqa: E402
from synctrl.simulation.description import describe_run  # noqa: E402

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
    for titled in written["tables"]:
        assert f"## {titled['title']}" in report
        assert all(len(row) == len(titled["columns"]) for row in titled["rows"])
    ways = {row[1] for row in written["tables"][1]["rows"]}
    assert {"bare calls", "naive loop", "reference"} <= ways


# -- against another version ------------------------------------------------------------------------------


def has_history() -> bool:
    """Whether this is a clone, with git at hand."""
    command = ["git", "-C", str(REPOSITORY), "rev-parse", "--verify", "HEAD"]
    return bool(shutil.which("git")) and subprocess.run(command, capture_output=True).returncode == 0


needs_git = pytest.mark.skipif(not has_history(), reason="no git repository here")
ALL = ("sse2", "avx2", "avx512f")


def reached(values: dict[str, list[float]], features: tuple[str, ...] = ALL) -> dict[str, list]:
    """Rows of the table of aims by their words."""
    figures = Figures()
    figures.values.update(values)
    return {row[0]: row[1:] for row in table(figures, features, "then").rows}


@needs_git
def test_the_script_compares_the_working_tree_with_a_commit_and_leaves_nothing(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    (between := tmp_path / "between").mkdir()
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- benchmark against: begin -->old<!-- benchmark against: end -->\nafter\n")
    monkeypatch.setenv("TMPDIR", str(between))
    command = [sys.executable, str(SCRIPTS / "benchmark.py"), "--against", "HEAD", "--quick"]
    command += ["--page", str(page), str(tmp_path / "out")]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert run.returncode == 0, run.stderr
    found = json.loads((tmp_path / "out" / "benchmark.json").read_text())
    text = page.read_text()
    assert found["figures"]["four planar arms, factor"][0] > 0
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "old" not in text
    for titled in found["tables"]:
        assert f"### {titled['title']}" in text
        assert all(len(row) == len(titled["columns"]) for row in titled["rows"])
    assert str(REPOSITORY) not in text and str(tmp_path) not in text
    assert not list(between.iterdir())


@needs_git
def test_a_commit_that_is_not_there_is_refused():
    with pytest.raises(Unmeasured), side_by_side("0" * 40):
        pass


def test_a_page_without_its_marks_is_left_alone(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- benchmark against: begin -->")
    with pytest.raises(ValueError):
        into_page(page, "against", "text")


def test_what_a_version_does_not_have_is_said_and_the_rest_is_measured(tmp_path):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    worker = Worker(REPOSITORY, tmp_path)
    arms = {"cell": "four planar arms", "seconds": 0.001}
    jobs = {
        "there": Job("now", "per_step", arms),
        "not": Job("now", "per_step", {**arms, "cell": "no such cell"}),
    }
    try:
        found, failed = in_turns(Pair(worker, worker, "", ""), jobs, 2)
    finally:
        worker.close()
    assert list(found) == ["there"] and found["there"].shape == (2,) and list(failed) == ["not"]


def test_a_process_that_ends_is_started_anew(tmp_path):
    worker = Worker(REPOSITORY, tmp_path)
    try:
        worker.ask("hello")
        worker._process.kill()
        with pytest.raises(Unmeasured):
            worker.ask("hello")
        assert Path(worker.ask("hello")["package"]).is_relative_to(REPOSITORY)
    finally:
        worker.close()


@pytest.mark.parametrize("name", FEATURES)
def test_every_feature_can_be_planned_and_changes_the_run_without_it(name):
    feature = FEATURES[name]
    with_it, without = feature.make(), cell_named(feature.cell)
    options = dict(feature.options)
    runs = with_it.plan(2e-3, 1e-3, **options, **feature.own), without.plan(2e-3, 1e-3, **options)
    assert runs[0].loop.cell.n == runs[1].loop.cell.n
    spaces = [getattr(run.loop.cell.space, "damping", None) for run in runs]
    told = [(describe_run(run.loop), run.info, space) for run, space in zip(runs, spaces, strict=True)]
    assert told[0] != told[1]


def test_steps_cost_the_same_however_many_there_are(monkeypatch):
    """A run that costs a second and a millisecond per step: only the step is counted."""
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    clock = [0.0]
    monkeypatch.setattr("benchmark_jobs.time.process_time", lambda: clock[0])

    def engine(*_):
        def run(planned):
            clock[0] += 1.0 + 1e-3 * planned.clock.steps

        return run

    monkeypatch.setattr("benchmark_jobs.engine", engine)
    assert Bench().per_step("four planar arms", 0.1)["seconds"] == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize(
    ("features", "needed"), [(ALL, 4.5), (("sse2", "avx2"), 1 + 0.7 * 3.5), (("sse2",), 2.0), ((), 2.0)]
)
def test_aims_are_those_of_the_processor(features, needed):
    assert asked(Bound("some", 4.5, "x", lanes=4.5), features) == pytest.approx(needed)
    assert asked(Bound("rollout", 30.0, "x", lanes=4.5), features) == pytest.approx(30 * needed / 4.5)
    assert asked(Bound("time", 5.0, "s", at_most=True), features) == 5.0


def test_aims_are_judged_by_medians_and_say_what_was_not_measured():
    rows = reached({
        "two A460, factor": [2.3, 2.5, 2.6],
        "sixteen UR5, factor": [4.0, 4.1, 5.2],
        "two UR5, factor": [3.5], "two UR5, rollout": [4.0],
        "two Panda, factor": [3.5],
        "compile, longest": [4.0, 4.5, 4.8],
    })  # fmt: skip
    assert rows["two A460, logged every step"][2] == "yes, in 2 of 3 runs"
    assert "2.5 x (2.3 to 2.6)" in rows["two A460, logged every step"][1]
    assert rows["sixteen UR5, logged every step"][2].startswith("missed, in 1 of 3 runs: ")
    assert rows["two UR5, logged every step"][2].startswith("only 3 x")
    assert "5 x rollout not measured" in rows["two Panda, logged every step"][2]
    assert rows["compile any ready cell"][2] == "yes"
    assert rows["30 joints, logged every step"][2].startswith("not measured")
    assert len(rows) == len(AIMS)


def test_cells_that_would_not_fit_are_not_tried(monkeypatch):
    figures = Figures()
    check_fits(figures, "UR5", 10_000)  # nothing is known yet
    figures.put({"UR5, tenth bytes": 1e6, "UR5, tenth seconds": 10.0, "UR5, tenth robots": 1000.0})
    monkeypatch.setattr("benchmark_figures._free_memory", lambda: 4e9)
    check_fits(figures, "UR5", 2000)
    with pytest.raises(Unmeasured):
        check_fits(figures, "UR5", 3000)  # 3 GB of 4
    monkeypatch.setattr("benchmark_figures._free_memory", lambda: 4e10)
    check_fits(figures, "UR5", 3000)
    with pytest.raises(Unmeasured):
        check_fits(figures, "UR5", 10_000)  # 100 s
