"""Many runs at a time: each is saved as it comes, and none takes the others along."""

from __future__ import annotations

import os
import sys
from functools import partial

import pytest
from refusals import refused

from synctrl.errors import ResultError, SimulationError
from synctrl.experiments import a460_pair, planar_four
from synctrl.experiments.planar_four import GAINS
from synctrl.paper.reproduction import PlannedRun, run_all
from synctrl.simulation.result import LAYOUT, Result


def test_runs_are_those_of_one_process_and_every_one_shows_its_progress(tmp_path, capsys):
    planned = {"pair": PlannedRun(a460_pair, 0.05), "arms": PlannedRun(planar_four, 0.04)}
    runs = run_all(tmp_path, 2, planned)
    for name, run in planned.items():
        alone = run.make().simulate(run.duration)
        for array in LAYOUT:
            assert getattr(runs[name], array).tobytes() == getattr(alone, array).tobytes()
        assert Result.load(tmp_path / f"{name}.npz").status == "completed"
    shown = capsys.readouterr().err
    assert "pair" in shown and "arms" in shown
    assert shown.count("100%") == 2


def test_a_run_that_stops_does_not_take_the_others_along(tmp_path):
    planned = {
        "unstable": PlannedRun(partial(planar_four, gains=GAINS.replace(Gamma=1e9)), 0.05),
        "fine": PlannedRun(planar_four, 0.05),
    }
    with refused(SimulationError, cause="Gamma"):
        run_all(tmp_path, workers=1, planned=planned)
    assert Result.load(tmp_path / "fine.npz").status == "completed"
    assert Result.load(tmp_path / "unstable.npz").status.startswith("stopped")


def test_a_process_that_is_killed_is_a_clear_error_and_what_was_saved_stays(tmp_path):
    planned = {"fine": PlannedRun(planar_four, 0.02), "killed": PlannedRun(partial(os._exit, 9))}
    with refused(SimulationError, "killed"):
        run_all(tmp_path, workers=1, planned=planned)
    assert Result.load(tmp_path / "fine.npz").status == "completed"


def test_a_folder_that_cannot_be_written_is_an_error_before_anything_runs(tmp_path):
    (tmp_path / "file").write_text("")
    with refused(ResultError, file=str(tmp_path / "file" / "runs")):
        run_all(tmp_path / "file" / "runs", 1, {"killed": PlannedRun(partial(os._exit, 9))})


def test_a_shortened_run_is_never_longer_than_it_was():
    assert PlannedRun(planar_four).shortened(1.0).duration == 1.0
    assert PlannedRun(planar_four, 0.4).shortened(1.0).duration == 0.4
    assert PlannedRun(planar_four).shortened(100.0).duration == planar_four().duration


def test_a_run_is_made_by_the_engine_that_is_planned(tmp_path):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    planned = {name: PlannedRun(planar_four, 0.01, engine=name) for name in ("pinocchio", "compiled")}
    for name, run in run_all(tmp_path, 1, planned).items():
        assert run.info["engine"] == name


@pytest.mark.parametrize("missing", ["compiler", "casadi"])
def test_runs_that_cannot_be_compiled_here_are_made_by_the_reference_engine(missing, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    planned = PlannedRun(planar_four, engine="compiled")
    assert planned.possible() == planned
    if missing == "compiler":
        monkeypatch.setenv("CC", "no-such-compiler")
    else:
        monkeypatch.setitem(sys.modules, "casadi", None)
    assert planned.possible() == PlannedRun(planar_four)
