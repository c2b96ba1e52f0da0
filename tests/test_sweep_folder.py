"""The folder of a sweep: lines that cannot be of it are refused, and one process has it at a time."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from sweeps import DT, base, begun, interrupted_once, quiet, small_sweep, take

from synctrl.errors import InputError, ResultError, SweepError, SweepFileError
from synctrl.sweep import (
    Choice,
    Factor,
    Grid,
    LogUniform,
    Normal,
    Sweep,
    Uniform,
    control_period,
    gain,
    load,
    model_error,
    trajectories,
)
from synctrl.sweep.distributions import described
from synctrl.sweep.journal import Journal
from synctrl.tune import tune

pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")


# -- lines that cannot be ---------------------------------------------------------------------------------


def mixed_sweep() -> Sweep:
    """One factor of every kind; runs with an odd number are refused."""
    factors = [
        control_period(Grid([DT, 1.5 * DT])),
        Factor("word", Choice(["a", "b"]), keep),
        gain("beta", LogUniform(1, 100)),
        model_error(Normal(0, 0.1)),
    ]
    return Sweep(base(), factors, samples=3, dt=DT, engine="pinocchio")


def keep(experiment, value):
    return experiment


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("mixed")
    quiet(mixed_sweep(), folder, backend="serial")
    return folder


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("name", ["sweep.json", "runs.jsonl"])
def test_a_pipe_instead_of_a_file_is_refused_and_not_waited_for(name, made, tmp_path):
    rewritten(made, tmp_path, lambda rows: rows)
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    for read in (load, lambda folder: quiet(mixed_sweep(), folder, backend="serial")):
        with refused(ResultError) as caught:
            read(tmp_path)
        assert caught.value.file in (str(tmp_path), str(tmp_path / name))


def rewritten(made: Path, folder: Path, change) -> None:
    """A copy of the folder with other rows."""
    (folder / "sweep.json").write_bytes((made / "sweep.json").read_bytes())
    rows = [json.loads(line) for line in (made / "runs.jsonl").read_text().splitlines()]
    lines = [line if isinstance(line, str) else json.dumps(line) for line in change(rows)]
    (folder / "runs.jsonl").write_text("".join(line + "\n" for line in lines))


COLUMNS = ["run", "control_period", "word", "beta", "model_error", "status", "cause", "stop_time"]
#: rows of runs 0, 1, 2 are completed, those of 3, 4, 5 refused
WRONG = {
    "a run beyond the last": (0, "run", 99999),
    "a negative run": (0, "run", -1),
    "a run that is true": (1, "run", True),
    "a run that is no whole number": (1, "run", 1.0),
    "a huge run": (0, "run", 10**400),
    "another run's number": (0, "run", 5),
    "another value of a grid": (0, "control_period", 1.5 * DT),
    "a value that is not on the grid": (0, "control_period", 0.5),
    "another word": (0, "word", "c"),
    "a number in the place of a word": (0, "word", 1.0),
    "another draw": (0, "beta", 5.0),
    "a draw outside": (0, "beta", 1000.0),
    "no draw": (0, "beta", None),
    "text in the place of a draw": (0, "beta", "high"),
    "an infinite draw": (0, "model_error", math.inf),
    "a draw that is no number": (0, "model_error", math.nan),
    "a draw that is true": (0, "model_error", True),
    "a draw as long as a line": (0, "model_error", 10**400),
    "an unknown status": (0, "status", "done"),
    "no status": (0, "status", None),
    "a status that does not fit": (0, "status", "refused"),
    "a completed run that was refused": (3, "status", "completed"),
    "a cause of nothing": (0, "cause", "InputError: something"),
    "no cause": (3, "cause", None),
    "a cause that is a number": (3, "cause", 1),
    "half a letter": (3, "cause", "\ud800"),
    "a completed run that stopped": (0, "stop_time", 0.005),
    "a refused run that stopped": (3, "stop_time", 0.005),
    "text for a measure": (0, "sync_rms", "small"),
    "a negative measure": (0, "sync_rms", -1.0),
    "a measure that is true": (0, "peak_torque", True),
    "a measure that is no number": (0, "peak_torque", math.nan),
    "a measure of a run that was refused": (3, "peak_torque", 1.0),
    "a list for a measure": (0, "peak_torque", [1.0]),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_line_that_cannot_be_of_this_sweep_is_refused_with_file_and_line(name, made, tmp_path):
    line, column, value = WRONG[name]
    columns = json.loads((made / "sweep.json").read_text())["columns"]

    def change(rows):
        rows[line][columns.index(column)] = value
        return rows

    rewritten(made, tmp_path, change)
    before = (tmp_path / "runs.jsonl").read_bytes()
    for read in (lambda: load(tmp_path), lambda: quiet(mixed_sweep(), tmp_path, backend="serial")):
        with refused(SweepFileError, file=str(tmp_path / "runs.jsonl"), line=line + 1):
            read()
    assert (tmp_path / "runs.jsonl").read_bytes() == before


def older(made: Path, folder: Path) -> None:
    """A copy of the folder in format 1, which has no columns for steps and saturation."""
    about = json.loads((made / "sweep.json").read_text())
    rewritten(made, folder, lambda rows: [row[: len(about["columns"]) - 2] for row in rows])
    about |= {"format": "synctrl sweep 1", "columns": about["columns"][:-2]}
    (folder / "sweep.json").write_text(json.dumps(about))


def test_a_folder_of_format_1_is_read_and_not_mixed_with_new_rows(made, tmp_path):
    older(made, tmp_path)
    new, old = load(made), load(tmp_path)
    assert list(new.columns) == [*old.columns, "saturation", "step_error"]
    assert new[old.columns].equals(old)
    with refused(ResultError, file=str(tmp_path)):
        quiet(mixed_sweep(), tmp_path, backend="serial")


def test_a_stopped_run_stops_within_its_duration(tmp_path):
    sweep = Sweep(base(), [gain("K_r", Grid([1e6]))], dt=DT, engine="pinocchio", bands=BANDS, duration=0.1)
    quiet(sweep, tmp_path, backend="serial")
    assert load(tmp_path).loc[0, "status"] == "stopped"
    path = tmp_path / "runs.jsonl"
    row = json.loads(path.read_text())
    for wrong in (-0.01, 0.2, "late", True):
        row[4] = wrong
        path.write_text(json.dumps(row) + "\n")
        with refused(SweepFileError, file=str(path), line=1):
            load(tmp_path)


BANDS = {"tracking_error": 1e-3, "sync_error": 1e-3}


def test_a_run_written_twice_is_refused_and_says_whether_the_lines_agree(made, tmp_path):
    rewritten(made, tmp_path, lambda rows: [*rows, rows[1]])
    with refused(SweepFileError, file=str(tmp_path / "runs.jsonl"), line=7) as caught:
        load(tmp_path)
    assert "line 2 has the same" in str(caught.value)
    rewritten(made, tmp_path, lambda rows: [*rows, [*rows[1][:-1], 2.0 * rows[1][-1]]])
    with refused(SweepFileError, file=str(tmp_path / "runs.jsonl"), line=7) as caught:
        load(tmp_path)
    assert "line 2 has other values" in str(caught.value)


def test_a_line_that_is_taken_out_is_made_again(made, tmp_path):
    whole = (made / "table.csv").read_bytes()
    rewritten(made, tmp_path, lambda rows: [rows[4], rows[0], rows[5]])
    assert list(load(tmp_path).index) == [0, 4, 5]
    assert quiet(mixed_sweep(), tmp_path, backend="serial") == whole


def test_the_error_about_a_line_is_one_about_sweeps_and_one_about_files():
    assert issubclass(SweepFileError, SweepError)
    assert issubclass(SweepFileError, ResultError)


@given(
    values=st.one_of(
        st.builds(Uniform, st.floats(-10, 0), st.floats(1, 10)),
        st.builds(LogUniform, st.floats(1e-6, 1), st.floats(2, 1e6)),
        st.builds(Normal, st.floats(-10, 10), st.floats(1e-6, 10)),
        st.builds(Choice, st.lists(st.floats(-10, 10) | st.sampled_from("abc"), min_size=1, unique=True)),
        st.builds(Grid, st.lists(st.floats(-10, 10) | st.sampled_from("abc"), min_size=1, unique=True)),
    )
)
def test_values_are_made_again_from_their_description(values):
    again = described(json.loads(json.dumps(values.describe())))
    assert type(again) is type(values)
    assert again.describe() == values.describe()


class Dice:
    """Values of a kind of the user's own."""

    def __init__(self, sides):
        self.sides = sides

    def draw(self, rng):
        return rng.integers(self.sides)

    def describe(self):
        return {"kind": "Dice", "sides": self.sides}


def dice_sweep(values=None) -> Sweep:
    factors = [
        model_error(Uniform(-1, 1)),
        Factor("dice", values or Dice(6), keep),
        gain("beta", Uniform(1, 100)),
    ]
    return Sweep(base(), factors, samples=3, dt=DT, engine="pinocchio")


def test_what_follows_values_of_the_users_own_is_compared_when_they_are_at_hand(tmp_path):
    quiet(dice_sweep(), tmp_path, backend="serial")
    path = tmp_path / "runs.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert all(type(row[2]) is int and 0 <= row[2] < 6 for row in rows)
    rows[1][3] += 1.0
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert len(load(tmp_path)) == 3, "a table alone does not know what a user's own values draw"
    with refused(SweepFileError, file=str(path), line=2):
        quiet(dice_sweep(), tmp_path, backend="serial")
    rows[1][1] += 1.0
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    with refused(SweepFileError, file=str(path), line=2):
        load(tmp_path)


@pytest.mark.parametrize("value", [None, math.nan, [1], True, 1j, "\ud800"])
def test_what_a_users_own_values_draw_has_to_be_a_number_or_a_word(value):
    class Wrong(Dice):
        def draw(self, rng):
            return value

    with refused(InputError, "factor 'dice', a value that Wrong has drawn"):
        dice_sweep(Wrong(6)).values(0)


def test_words_that_no_file_can_hold_are_refused_or_replaced(tmp_path):
    with refused(InputError, "Choice"):
        Choice(["a", "\ud800"])
    refuse = Factor("own", Grid([1]), half_a_letter)
    quiet(Sweep(base(), [refuse], dt=DT, engine="pinocchio"), tmp_path, backend="serial")
    assert load(tmp_path).loc[0, "cause"] == "InputError: half a letter, ?"


def half_a_letter(experiment, value):
    raise InputError("half a letter, \ud800")


DAMAGED = {
    "seed": [-1, "3", None, True],
    "samples": [0, 2, None],
    "runs": [7, None, "6"],
    "duration": [0, -1, "long", None, 10**400],
    "columns": [["run"], None, [*COLUMNS]],
    "settling_bands": [{}, None, {"tracking_error": 1, "sync_error": -1}],
    "factors": [[], None, [3], [{"name": 1}], [{"name": "a", "values": {"kind": "Uniform", "low": 2}}]],
    "search": [3, {}, {"population": 0}],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key in DAMAGED for value in DAMAGED[key]])
def test_a_description_that_contradicts_itself_is_refused_with_its_file(key, value, made, tmp_path):
    rewritten(made, tmp_path, lambda rows: rows)
    about = json.loads((tmp_path / "sweep.json").read_text())
    (tmp_path / "sweep.json").write_text(json.dumps({**about, key: value}))
    for read in (load, lambda folder: trajectories(folder, 0)):
        with refused(ResultError, file=str(tmp_path / "sweep.json")):
            read(tmp_path)


def test_trajectories_of_another_run_are_refused(tmp_path):
    quiet(small_sweep(samples=2), tmp_path, backend="serial", keep_every=2)
    kept = tmp_path / "runs"
    (kept / "000000.npz").rename(kept / "000001.npz")
    with refused(ResultError, file=str(kept / "000001.npz"), found=0):
        trajectories(tmp_path, 1)
    for wrong in ("../0", -1, 1.5):
        with refused(InputError, "run"):
            trajectories(tmp_path, wrong)


# -- a search ---------------------------------------------------------------------------------------------


def searched(folder, generations=2):
    search = {"beta": LogUniform(1, 100), "K_r": Uniform(0.1, 10)}
    options = {"dt": DT, "engine": "pinocchio", "backend": "serial", "progress": False, "population": 5}
    return tune(base(), search, generations=generations, folder=folder, **options)


@pytest.mark.parametrize(
    ("line", "column", "value"),
    [
        (0, "run", 99999),
        (6, "beta", 1000.0),
        (6, "K_r", "high"),
        (6, "status", "fine"),
    ],
)
def test_a_line_that_cannot_be_of_this_search_is_refused(line, column, value, tmp_path):
    searched(tmp_path)
    path = tmp_path / "runs.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rows[line][json.loads((tmp_path / "sweep.json").read_text())["columns"].index(column)] = value
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for read in (lambda: load(tmp_path), lambda: searched(tmp_path)):
        with refused(SweepFileError, file=str(path), line=line + 1):
            read()


def test_a_search_goes_on_only_from_runs_that_it_would_have_made(tmp_path):
    searched(tmp_path)
    path = tmp_path / "runs.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rows[7][1] = 0.5 * (rows[7][1] + 50)
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    with refused(SweepFileError, file=str(path), line=8):
        searched(tmp_path)
    path.write_text("".join(json.dumps(row) + "\n" for row in (*rows[:7], *rows[8:])))
    again = searched(tmp_path)
    path.unlink()
    assert again.history == searched(tmp_path).history


# -- one process at a time --------------------------------------------------------------------------------


def test_a_folder_that_another_process_has_is_neither_read_nor_written(tmp_path):
    pytest.importorskip("fcntl", reason="this system has no locks of this kind")
    with Journal(tmp_path):
        (tmp_path / "sweep.json").write_text("half a descr")
        before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
        for start in (lambda: quiet(small_sweep(), tmp_path, backend="serial"), lambda: searched(tmp_path)):
            with refused(ResultError, file=str(tmp_path)):
                start()
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_processes_that_start_one_folder_at_once_leave_it_to_one_of_them(tmp_path):
    pytest.importorskip("fcntl", reason="this system has no locks of this kind")
    for said in take(tmp_path, processes=3, rounds=20):
        assert sorted(said) == ["another process has it", "another process has it", "mine"]


def test_a_folder_that_was_taken_and_left_before_anything_was_written_can_be_used(tmp_path):
    Journal(tmp_path).close()
    assert quiet(small_sweep(), tmp_path, backend="serial")


def test_a_folder_with_runs_and_no_description_is_refused(tmp_path):
    begun(small_sweep(), tmp_path).close()
    (tmp_path / "runs.jsonl").write_text("[0]\n")
    (tmp_path / "sweep.json").unlink()
    with refused(ResultError, file=str(tmp_path)):
        quiet(small_sweep(), tmp_path, backend="serial")


# -- interrupts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", ["serial", "joblib"])
def test_a_run_that_is_interrupted_is_no_row_and_is_made_again(backend, tmp_path):
    if backend == "joblib":
        pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    flag = tmp_path / "flag"
    sweep = interrupted_once(flag)
    folder = tmp_path / "sweep"
    with pytest.raises(KeyboardInterrupt):
        quiet(sweep, folder, backend=backend, batch=1)
    assert flag.exists()
    assert 2 not in load(folder).index
    assert set(load(folder)["status"]) <= {"completed"}
    whole = quiet(sweep, tmp_path / "whole", backend="serial")
    assert quiet(sweep, folder, backend="serial") == whole


def test_an_interrupt_that_carries_a_result_is_no_row(tmp_path, monkeypatch):
    from synctrl.sweep import worker

    class Interrupted(KeyboardInterrupt):
        """As a run that was interrupted raises it."""

        def __init__(self, result):
            super().__init__("interrupted")
            self.result = result

    sweep = small_sweep(samples=2)
    whole = sweep.simulate(0)
    row = quiet(sweep, tmp_path / "whole", backend="serial")
    simulate = worker.Prepared.simulate

    def interrupted(prepared, experiment, period=None):
        simulate(prepared, experiment, period)
        raise Interrupted(whole)

    with monkeypatch.context() as patched, pytest.raises(Interrupted) as raised:
        patched.setattr(worker.Prepared, "simulate", interrupted)
        quiet(small_sweep(samples=2, bands=BANDS), tmp_path / "cut", backend="serial")
    assert raised.value.result is whole
    assert (tmp_path / "cut" / "runs.jsonl").read_bytes() == b""
    assert row
