"""Runs in a folder are read when they are asked for, and processes share the work on them."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest
from refusals import refused

from synctrl.errors import InputError, ResultError
from synctrl.experiments import planar_four
from synctrl.paper.processes import processes
from synctrl.paper.saved_runs import SavedRuns


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    for name, duration in (("cell_short", 0.01), ("cell_long", 0.02), ("other", 0.03)):
        planar_four().simulate(duration, 1e-3).save(folder / f"{name}.npz")
    return folder


def test_runs_are_named_after_their_files_with_or_without_what_these_begin_with(folder: Path) -> None:
    every = SavedRuns(folder, ("cell_short", "cell_long", "other"))
    assert list(every) == ["cell_short", "cell_long", "other"]
    cell = every.under("cell_")
    assert list(cell) == ["short", "long"]
    assert cell["long"] == every["cell_long"] != cell["short"]
    assert list(every.named("other", "nobody")) == ["other"]


def test_a_run_is_read_once_and_no_sooner_than_it_is_asked_for(folder: Path) -> None:
    runs = SavedRuns(folder, ("other", "missing"))
    assert runs["other"] is runs["other"]
    with refused(ResultError, file=str(folder / "missing.npz")):
        runs["missing"]
    with pytest.raises(KeyError):
        runs["nobody"]


def test_names_travel_between_processes_and_runs_do_not(folder: Path) -> None:
    runs = SavedRuns(folder, ("cell_short", "cell_long", "other")).under("cell_")
    before = len(pickle.dumps(runs))
    assert runs["short"].t[-1] == pytest.approx(0.01)
    assert len(pickle.dumps(runs)) == before < 1000
    assert pickle.loads(pickle.dumps(runs)) == runs


def fails() -> None:
    raise InputError("expected something else", subject="work")


def leaves(file: Path) -> None:
    file.touch()


def test_an_error_in_a_process_is_that_of_who_waits_for_it_and_nothing_more_begins(tmp_path: Path) -> None:
    with refused(InputError, "work"), processes(1) as pool:
        first = pool.submit(fails)
        rest = [pool.submit(leaves, tmp_path / f"{k}") for k in range(200)]
        first.result()
    assert any(each.cancelled() for each in rest)
    assert len(list(tmp_path.iterdir())) == sum(not each.cancelled() for each in rest)


def test_who_waits_and_is_interrupted_leaves_no_process_behind(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), processes(2) as pool:
        ids = {pool.submit(os.getpid).result() for _ in range(2)}
        raise KeyboardInterrupt
    for each in ids:
        with pytest.raises(ProcessLookupError):
            os.kill(each, 0)
