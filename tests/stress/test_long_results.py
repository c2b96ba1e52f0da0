"""Long versions of tests of result files: thousands of damaged ones, and hundreds of saves to one path."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path

import pytest
from cells import SMALL_GAINS, small_cell
from consumers import CONSUMERS, FIGURES, SCENES, consume
from damage import damaged
from writers import at_once, read_often, save_often, versions, write_often

from synctrl import Disturbance, Experiment, Result
from synctrl.errors import ResultError
from synctrl.files import write_whole

FILES = 20_000
#: every so many files that load, all figures and scenes are drawn too
DRAWN = 10


@pytest.fixture(scope="module")
def experiment():
    return Experiment(small_cell(), SMALL_GAINS, 0.05, disturbances=[Disturbance(0, 0.3, 0.02, 0.03)])


@pytest.fixture(scope="module")
def result(experiment):
    return experiment.simulate(dt=5e-3)


@pytest.fixture
def damaged_files(result, tmp_path):
    """Damaged files that load, as results, and a count of what all of them ended in."""
    data = result.save(tmp_path / "good.npz").read_bytes()
    ended: Counter[str] = Counter()

    def some(count: int):
        for seed in range(count):
            path = tmp_path / "damaged.npz"
            path.write_bytes(damaged(seed, data)[1])
            try:
                loaded = Result.load(path)
            except ResultError:
                ended["refused"] += 1
            else:
                ended["loaded"] += 1
                yield loaded

    return some, ended


def test_damaged_files_are_valid_results_or_result_errors(damaged_files, tmp_path, record_property):
    some, ended = damaged_files
    for loaded in some(FILES):
        assert Result.load(loaded.save(tmp_path / "again.npz")) == loaded
    record_property(
        "figure",
        f"{FILES:,} damaged files: {ended['refused']:,} ended in a ResultError, {ended['loaded']:,} in a "
        "valid result that was saved and loaded again, none in anything else",
    )


def test_whatever_loads_can_be_used(damaged_files, experiment, record_property):
    some, ended = damaged_files
    uses: Counter[str] = Counter()
    quick = [name for name in CONSUMERS if name not in (*FIGURES, *SCENES)]
    for k, loaded in enumerate(some(FILES // 10)):
        uses.update(consume(loaded, experiment, quick if k % DRAWN else None).values())
    record_property(
        "figure",
        f"{ended['loaded']:,} damaged files that load were given to metrics, plots, scenes and certificates "
        f"{uses.total():,} times: {uses['done']:,} worked, {uses.total() - uses['done']:,} ended in an error "
        "of the toolkit, none in anything else",
    )


def test_processes_that_save_to_one_path(result, tmp_path, record_property):
    path, runs = tmp_path / "run.npz", [result, result.decimated(2), result.decimated(3)]
    result.save(path)
    saving = [partial(save_often, path, run, 300) for run in runs]
    loading = [partial(read_often, path, Result.load, runs, 600) for _ in range(2)]
    assert at_once(*saving, *loading) == []
    assert [found.name for found in tmp_path.iterdir()] == ["run.npz"]
    record_property("figure", "3 processes saved to one path 900 times while 2 loaded 1,200 times: no error")


def test_processes_that_write_large_files_to_one_path(tmp_path, record_property):
    path, contents = tmp_path / "file", versions(5_000_000)
    write_whole(path, contents[0])
    writing = [partial(write_often, path, content, 100) for content in contents]
    reading = [partial(read_often, path, Path.read_bytes, contents, 500) for _ in range(2)]
    assert at_once(*writing, *reading) == []
    record_property(
        "figure", "3 processes wrote 5 MB to one path 300 times, 2 read it 1,000 times: always whole"
    )
