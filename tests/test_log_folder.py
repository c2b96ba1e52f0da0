"""Logs in folders and in single precision: the same numbers as in memory, and folders from anybody."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused
from shared_work import KINDS
from test_interrupts import experiment as faulty
from test_interrupts import raising

from synctrl import Experiment, Result, simulate
from synctrl.analysis.certify import certify
from synctrl.analysis.metrics import metrics
from synctrl.compiled.tables import BLOCK_STEPS
from synctrl.errors import InputError, ResultError, RunInterrupted, SimulationError
from synctrl.simulation import memory
from synctrl.simulation.log import AHEAD, OFTEN, Keeping, make_log
from synctrl.simulation.log_folder import FolderWriter
from synctrl.simulation.result import LAYOUT

ENGINES = ["pinocchio", "compiled"]
#: with damping, states of a plant's own, sensors' instants, poses and others
CELLS = ("positions", "positions, damped", "hidden joints", "sampled", "payloads", "poses", "moving weights")


@pytest.fixture
def experiment() -> Experiment:
    return Experiment(small_cell(), SMALL_GAINS, 0.3)


@pytest.fixture
def folder(experiment, tmp_path) -> Path:
    """A folder of a run that has ended."""
    experiment.simulate(log_to=tmp_path / "run")
    return tmp_path / "run"


def arrays(result: Result) -> dict[str, np.ndarray]:
    return {**{name: getattr(result, name) for name in LAYOUT}, **result.outputs}


# -- the same numbers --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CELLS)
def test_a_run_into_a_folder_is_the_run_in_memory_and_so_is_what_is_loaded(name, tmp_path):
    kind = KINDS[name]
    usual = kind.make().simulate(0.1, **kind.options)
    mapped = kind.make().simulate(0.1, log_to=tmp_path / "run", **kind.options)
    assert mapped == usual
    assert Result.load(tmp_path / "run") == usual
    for array in arrays(mapped).values():
        assert isinstance(array, np.memmap) or not array.size
        assert not array.flags.writeable


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("steps", [1, OFTEN - 1, OFTEN, OFTEN + 1, AHEAD + OFTEN, 2 * AHEAD + 3])
def test_logs_of_every_length_are_whole(engine, steps, tmp_path, experiment):
    usual = experiment.simulate(steps * 1e-3, engine=engine)
    assert len(usual.t) == steps + 1
    assert experiment.simulate(steps * 1e-3, engine=engine, log_to=tmp_path / "run") == usual
    single = experiment.simulate(steps * 1e-3, engine=engine, log_dtype="float32")
    for name, array in arrays(usual).items():
        np.testing.assert_array_equal(arrays(single)[name], array.astype("f8" if name == "t" else "f4"))


@pytest.mark.parametrize("kept", [Keeping(), Keeping(None, "float32")])
@pytest.mark.parametrize("rows", [1, OFTEN, AHEAD, 3 * AHEAD])
def test_there_is_room_for_all_rows_that_an_engine_may_fill(kept, rows):
    assert BLOCK_STEPS <= AHEAD
    log, rng = make_log({"t": (), "x": (2,)}, rows, kept), np.random.default_rng(0)
    while log.count < rows:
        ahead = len(log.rows["x"]) - log.at
        assert ahead >= min(AHEAD, rows - log.count)
        log.advance(int(min(rng.choice([1, OFTEN - 1, AHEAD]), rows - log.count)))


@pytest.mark.parametrize("engine", ENGINES)
def test_every_fifth_instant_goes_into_a_folder_as_into_memory(engine, tmp_path, experiment):
    options = {"engine": engine, "log_dt": 5e-3}
    assert experiment.simulate(log_to=tmp_path / "run", **options) == experiment.simulate(**options)


@pytest.mark.parametrize("engine", ENGINES)
def test_single_precision_is_the_same_in_memory_and_in_a_folder(engine, tmp_path, experiment):
    inside = experiment.simulate(engine=engine, log_dtype="float32")
    mapped = experiment.simulate(engine=engine, log_dtype="float32", log_to=tmp_path / "run")
    assert mapped == inside == Result.load(tmp_path / "run")
    for found in (inside, mapped):
        kinds = {name: array.dtype for name, array in arrays(found).items()}
        assert kinds.pop("t") == np.float64 and {*kinds.values()} == {np.dtype(np.float32)}


def test_a_mapped_result_can_be_saved_thinned_and_judged(tmp_path, experiment):
    usual, mapped = experiment.simulate(), experiment.simulate(log_to=tmp_path / "run")
    assert Result.load(mapped.save(tmp_path / "saved.npz")) == usual
    assert mapped.decimated(7) == usual.decimated(7)
    assert str(certify(mapped)) == str(certify(usual))
    single = experiment.simulate(log_dtype="float32")
    assert Result.load(single.save(tmp_path / "single.npz")) == single


def test_what_computes_a_run_anew_refuses_single_precision_and_what_reads_it_does_not(experiment):
    single, usual = (experiment.simulate(log_dtype=kind) for kind in ("float32", "float64"))
    with refused(InputError, "result", found="float32"):
        certify(single)
    found, expected = metrics(single), metrics(usual)
    np.testing.assert_allclose(found.tracking_error.rms, expected.tracking_error.rms, rtol=1e-5)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_stops_leaves_a_whole_folder(engine, tmp_path):
    def stopped(**options) -> Result:
        with pytest.raises(SimulationError) as caught:
            faulty(raising(ValueError("a fault"))).simulate(engine=engine, **options)
        return caught.value.result

    assert stopped(log_to=tmp_path / "run") == stopped() == Result.load(tmp_path / "run")


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_is_interrupted_leaves_a_whole_folder(engine, tmp_path, experiment):
    def strike(t: float) -> None:
        if t > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(RunInterrupted) as caught:
        experiment.simulate(engine=engine, progress=strike, log_to=tmp_path / "run")
    loaded = Result.load(tmp_path / "run")
    assert loaded == caught.value.result and loaded.t[-1] >= 0.1 - 1e-9
    usual, rows = experiment.simulate(engine=engine), len(loaded.t)
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(usual, name)[:rows])


@pytest.mark.parametrize("written", [1, 2, 3])
@pytest.mark.parametrize("kept", [("run", "float64"), ("run", "float32"), (None, "float32")])
def test_rows_are_there_once_if_an_interrupt_comes_while_they_are_written(
    kept, written, tmp_path, monkeypatch
):
    folder, dtype = kept
    kept = Keeping(None if folder is None else tmp_path / folder, dtype)
    log = make_log({"t": (), "x": (2,), "y": (3,)}, 3 * OFTEN, kept)
    put, numbers = log._target.put, np.arange(3.0 * OFTEN)

    def interrupted(first: int, rows: dict[str, np.ndarray]) -> None:
        monkeypatch.undo()
        put(first, dict(list(rows.items())[:written]))
        raise KeyboardInterrupt

    monkeypatch.setattr(log._target, "put", interrupted)
    strikes = 0
    for number in numbers:
        for array in log.rows.values():
            array[log.at] = number
        try:
            log.advance(1)
        except KeyboardInterrupt:
            strikes += 1
    assert strikes == 1
    for array in log.taken().values():
        rows = array.reshape(-1, int(np.prod(array.shape[1:])))
        np.testing.assert_array_equal(rows, np.repeat(numbers[:, None], rows.shape[1], axis=1))


# -- refusals ----------------------------------------------------------------------------------------------


def test_a_folder_that_is_there_is_refused_before_the_run_and_stays_as_it_is(experiment, tmp_path):
    told = []
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for taken in (tmp_path, tmp_path / "file", tmp_path / "link"):
        with refused(InputError, "log_to"):
            experiment.simulate(log_to=taken, progress=told.append)
    assert told == [] and sorted(os.listdir(tmp_path)) == ["file", "link"]


@pytest.mark.parametrize("value", [3, b"run", "a\0b", True])
def test_what_is_no_path_is_refused(value):
    with refused(InputError, "log_to"):
        simulate(small_cell(), SMALL_GAINS, 0.1, log_to=value)


@pytest.mark.parametrize("value", ["single", "float16", np.float32, None])
def test_other_precisions_are_refused(value):
    with refused(InputError, "log_dtype"):
        simulate(small_cell(), SMALL_GAINS, 0.1, log_dtype=value)


def test_a_run_that_is_refused_leaves_no_folder(tmp_path, experiment):
    with pytest.raises(InputError):
        experiment.simulate(dt=-1.0, log_to=tmp_path / "run")
    with pytest.raises(InputError):
        experiment.simulate(engine="none", log_to=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_log_is_refused_that_is_larger_than_the_disk_but_not_than_memory(tmp_path, experiment, monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 1000)
    experiment.simulate(0.1, log_to=tmp_path / "run")
    free = type("Usage", (), {"free": 100_000})
    monkeypatch.setattr(memory.shutil, "disk_usage", lambda place: free)
    with refused(InputError, "log_dt"):
        experiment.simulate(1.0, log_to=tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_half_of_the_memory_is_enough_for_single_precision(experiment, monkeypatch):
    row = sum(array[:1].nbytes for array in arrays(experiment.simulate(0.01)).values())
    monkeypatch.setattr(memory, "available_memory", lambda: int(0.7 * 301 * row / memory.SHARE))
    with refused(InputError, "log_dt"):
        experiment.simulate()
    experiment.simulate(log_dtype="float32")


def test_a_folder_of_a_run_that_has_not_ended_is_no_result(folder):
    (folder / "info.json").unlink()
    with refused(ResultError, file=str(folder)):
        Result.load(folder)


def rewritten(folder: Path, **changes) -> None:
    info = json.loads((folder / "info.json").read_text())
    (folder / "info.json").write_text(json.dumps({**info, **changes}))


def shortened(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-8])


def outside(path: Path) -> None:
    """Move a file out of its folder, and leave a link to it."""
    target = path.parents[1] / "elsewhere.npy"
    shutil.move(path, target)
    path.symlink_to(target)


def pickled(path: Path) -> None:
    np.save(path, np.array([{}, None], dtype=object), allow_pickle=True)


def turned(path: Path) -> None:
    np.save(path, np.asfortranarray(np.load(path)))


def changed(path: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    np.save(path, change(np.load(path)))


def with_output(folder: Path, name: str) -> None:
    rewritten(folder, outputs={name: {"unit": "m", "axes": ["time"]}})


DAMAGE: dict[str, Callable[[Path], object]] = {
    "an array is missing": lambda folder: (folder / "x.npy").unlink(),
    "an array is shorter": lambda folder: shortened(folder / "x.npy"),
    "the times are shorter": lambda folder: shortened(folder / "t.npy"),
    "an array is a link": lambda folder: outside(folder / "q.npy"),
    "the info is a link": lambda folder: outside(folder / "info.json"),
    "an array is pickled": lambda folder: pickled(folder / "q.npy"),
    "an array is stored by columns": lambda folder: turned(folder / "q.npy"),
    "an array is in single precision": lambda folder: changed(folder / "q.npy", lambda q: q.astype("f4")),
    "an array is of another length": lambda folder: changed(folder / "q.npy", lambda q: q[1:]),
    "an array is a folder": lambda folder: [(folder / "q.npy").unlink(), (folder / "q.npy").mkdir()],
    "times that fall": lambda folder: changed(folder / "t.npy", lambda t: t[::-1].copy()),
    "times that are none": lambda folder: changed(folder / "t.npy", lambda t: np.nan * t),
    "another format": lambda folder: rewritten(folder, format="synctrl result 99"),
    "an unknown precision": lambda folder: rewritten(folder, log_dtype="float16"),
    "no JSON": lambda folder: (folder / "info.json").write_text("{"),
    "no text": lambda folder: (folder / "info.json").write_bytes(b"\xff\xfe{}"),
    "an output beside the folder": lambda folder: with_output(folder, "../x"),
    "an output that is missing": lambda folder: with_output(folder, "y"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_folders_are_refused_by_name(name, folder):
    assert len(Result.load(folder).t) == 301
    DAMAGE[name](folder)
    with refused(ResultError, file=str(folder)):
        Result.load(folder)


def test_a_link_to_the_folder_itself_is_followed(folder, tmp_path):
    (tmp_path / "here").symlink_to(folder)
    assert Result.load(tmp_path / "here") == Result.load(folder)


@pytest.mark.parametrize("when", [0, 1, 2])
def test_an_interrupt_while_files_are_made_costs_no_row(when, tmp_path, monkeypatch):
    writer = FolderWriter(tmp_path / "run", {"t": (), "q": (2, 3), "z": (4,)}, "float64")
    opened, open_file = [], Path.open

    def interrupted(path, *arguments, **options):
        opened.append(path)
        if len(opened) == when + 1:
            raise KeyboardInterrupt
        return open_file(path, *arguments, **options)

    rows = {"t": np.arange(2.0), "q": np.arange(12.0).reshape(2, 2, 3), "z": np.ones((2, 4))}
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", interrupted)
        with suppress(KeyboardInterrupt):
            writer.put(0, rows)
    writer.put(0, rows)
    for name, array in writer.taken().items():
        np.testing.assert_array_equal(array, rows[name])
