"""Measures of a user's own: the same rows side by side and one by one, on any engine, and what is refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from machines import random_robot
from refusals import refused
from sweeps import DT, base, quiet
from test_columns import small

from synctrl import CartesianSpace, Cell, Coupling, Experiment, ExponentialApproach, Gains, Member
from synctrl.compiled import processor
from synctrl.errors import InputError, ResultError, SweepError, SweepFileError
from synctrl.experiments import planar_four
from synctrl.sweep import Grid, LogUniform, OwnMeasure, Sweep, Uniform, gain, load, model_error, weights
from synctrl.sweep.worker import Runner
from synctrl.tune import tune

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
BANDS = {"tracking_error": 1e-3, "sync_error": 1e-3}


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """One cache for all runs of this file."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("SYNCTRL_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def energy(at):
    return np.sum(at.v * at.v)


def distance(at):
    return np.sqrt(np.sum((at.x[0] - at.x[1]) ** 2))


def power(at):
    return np.sum(at.tau * at.v) / 3


def waving(at):
    return (
        np.sin(at.q[0, 0]) * np.exp(np.cos(3 * at.q[1, 1]))
        + np.tanh(at.v[0, 1])
        - np.arctan2(at.x[0, 0], 2.0)
    )


def branching(at):
    return 1.0 if at.v[0, 0] > 0.01 else -(at.tau[0, 1] ** 3)


def pulling(at):
    return (at.q[0, 0] + 0.1) * at.v[1, 0] * at.sync_error[0, 0] - at.coupled_error[1, 1] - 1.0


OWN = [
    OwnMeasure("energy", energy, "integral", "rad²/s", "squares of all velocities"),
    OwnMeasure("distance", distance, "largest", "rad", "between the tips of robots 0 and 1"),
    OwnMeasure("power", power, "mean", "W", "that the controller gives"),
    OwnMeasure("waving", waving, "integral", "s"),
    OwnMeasure("pulling", pulling, "final"),
]


def sweep(measures=OWN, samples=11, start=None, factors=None, **options) -> Sweep:
    factors = factors or [gain("beta", LogUniform(1, 100)), model_error(Uniform(-1, 1))]
    options = {"dt": DT, "bands": BANDS, **options}
    return Sweep(start or small(), factors, samples=samples, measures=measures, **options)


def four(measures=OWN, **options) -> Sweep:
    return sweep(measures, start=planar_four(disturbance="torque"), duration=0.2, dt=4e-3, **options)


def rows(made: Sweep) -> list:
    """Rows of a sweep as its runner makes them, and how many of them were made side by side."""
    runner, tasks = Runner(made.study.job()), [made._task(run) for run in range(len(made))]
    found = [each.row for each in runner.outcomes(tasks)]
    alone = [runner.outcome(task).row for task in tasks]
    return [found, alone, len(runner._blocks.outcomes(tasks))]


@pytest.mark.parametrize("make", [sweep, four])
def test_rows_side_by_side_are_those_of_runs_alone(make):
    found, alone, together = rows(make())
    assert found == alone
    assert together == 11
    assert all(isinstance(value, float) for row in found for value in row[-5:])
    assert all(row[-1] < 0 for row in found)


@pytest.mark.parametrize("width", [1, 2, 4, 8])
def test_rows_are_the_same_in_any_number_of_lanes(width, monkeypatch):
    if width > processor.widest():
        pytest.skip(f"this processor has {processor.widest()} lanes")
    expected = rows(sweep())
    monkeypatch.setattr(processor, "widest", lambda: width)
    assert rows(sweep()) == expected


def unlike() -> Sweep:
    """Two joints beside three: rows of the first robot are padded."""
    robots = [random_robot(seed, 2 + seed) for seed in range(2)]
    starts = [np.linspace(0.4, 0.9, robot.nv) for robot in robots]
    members = []
    for robot, q in zip(robots, starts, strict=True):
        tip = robot.tip_position(q)[:2]
        members.append(Member(robot, ExponentialApproach(tip, tip + 0.01), q))
    cell = Cell(members, Coupling.pair([1.0, 1.0]), CartesianSpace("xy"))
    start = Experiment(cell, Gains(5.0, 5.0, 3.0, 1.0, 0.1), 0.1)
    return sweep(start=start, factors=[gain("beta", Uniform(1, 9))])


def test_rows_of_robots_that_are_not_alike_are_those_of_runs_alone():
    found, alone, together = rows(unlike())
    assert found == alone
    assert together == 11


def test_own_measures_leave_all_others_alone():
    (found, *_), (others, *_) = rows(sweep()), rows(sweep([]))
    assert [row[:-5] for row in found] == others


def test_a_run_that_is_made_again_has_its_row():
    made = four()
    found, *_ = rows(made)
    assert [list(made.run_one(run).values()) for run in (0, 9)] == [found[0], found[9]]


def test_runs_that_stop_have_no_measures():
    found, alone, together = rows(sweep(samples=1, factors=[gain("K_r", Grid([1, 1e6, 2]))], duration=0.1))
    assert found == alone
    assert together == 2
    assert found[1][-5:] == [None] * 5


@pytest.mark.parametrize("over", ["largest", "mean", "integral", "final"])
@pytest.mark.parametrize("value", [energy, distance, power])
def test_measures_are_what_they_say_of_the_logged_arrays(over, value):
    made = four([OwnMeasure("own", value, over)], samples=1)
    result = made.simulate(0)
    of = {
        "energy": np.sum(result.v**2, axis=(1, 2)),
        "distance": np.linalg.norm(result.x[:, 0] - result.x[:, 1], axis=1),
        "power": np.sum(result.tau * result.v, axis=(1, 2)) / 3,
    }[value.__name__]
    integral = np.trapezoid(of, result.t)
    expected = {
        "largest": of.max(),
        "mean": integral / result.t[-1],
        "integral": integral,
        "final": of[-1],
    }[over]
    assert made.run_one(0)["own"] == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert OwnMeasure("own", value, over).of(result) == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_functions_that_cannot_be_traced_make_runs_go_one_by_one():
    measures = [*OWN, OwnMeasure("branching", branching, "mean")]
    found, alone, together = rows(sweep(measures))
    reference, _, _ = rows(sweep(measures, engine="pinocchio"))
    assert found == alone
    assert together == 0
    for row, other in zip(found, reference, strict=True):
        assert row[-6:] == pytest.approx(other[-6:], rel=1e-6, abs=1e-9)


def test_the_table_is_the_same_for_any_workers(tmp_path):
    made = sweep()
    tables = {quiet(made, tmp_path / f"{workers}", workers) for workers in (1, 2)}
    tables.add(quiet(made, tmp_path / "serial", backend="serial"))
    tables.add(quiet(made, tmp_path / "kept", 1, keep_every=2))
    assert len(tables) == 1


def test_functions_go_to_other_processes(tmp_path):
    made = sweep([OwnMeasure("branching", branching, "mean"), OwnMeasure("one", lambda at: 1.0, "final")], 4)
    assert quiet(made, tmp_path / "processes", 2, batch=1) == quiet(made, tmp_path / "here", 1)


def test_a_sweep_goes_on_and_its_folder_says_what_the_measures_are(tmp_path):
    made = sweep()
    whole = quiet(made, tmp_path, 1)
    lines = (tmp_path / "runs.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "runs.jsonl").write_bytes(b"".join(lines[:4]))
    assert quiet(made, tmp_path, 1) == whole
    table = load(tmp_path)
    assert list(table.columns[-5:]) == [own.name for own in OWN]
    assert table.attrs["measures"]["power"]["unit"] == "W"
    assert json.loads((tmp_path / "sweep.json").read_text("utf-8"))["own_measures"][0] == {
        "name": "energy",
        "function": "energy",
        "over": "integral",
        "unit": "rad²/s",
        "meaning": "squares of all velocities",
    }
    with refused(ResultError):
        quiet(sweep([replace(OWN[0], over="mean"), *OWN[1:]]), tmp_path, 1)


def test_only_own_measures_may_be_negative(tmp_path):
    quiet(sweep(), tmp_path, 1)
    path = tmp_path / "runs.jsonl"
    row = json.loads(path.read_bytes().splitlines()[0])
    path.write_text(json.dumps([*row[:-1], -abs(row[-1]) - 1.0]) + "\n", "utf-8")
    assert len(load(tmp_path)) == 1
    path.write_text(json.dumps([*row[:-6], -1.0, *row[-5:]]) + "\n", "utf-8")
    with refused(SweepFileError, line=1):
        load(tmp_path)


def test_a_search_has_them_too(tmp_path):
    options = {"dt": DT, "bands": BANDS, "measures": OWN, "generations": 1, "population": 5}
    found = tune(small(), {"beta": LogUniform(1, 100)}, folder=tmp_path, progress=False, workers=1, **options)
    assert found.measures["power"] == load(tmp_path)["power"][found.run]
    assert found.definitions["power"].unit == "W"


def test_blocks_of_weights_have_them():
    found, alone, together = rows(
        sweep(samples=2, factors=[weights(Grid([1, 2])), gain("beta", Uniform(1, 2))])
    )
    assert found == alone
    assert together == 4


@pytest.mark.parametrize("name", ["", "two words", "7", 7, None])
def test_a_name_is_a_word(name):
    with refused(InputError, "own measure"):
        OwnMeasure(name, energy, "mean")


def test_other_arguments_of_the_wrong_kind_are_refused_by_name():
    for arguments in [(7, "mean"), (energy, "sum"), (energy, None)]:
        with refused(InputError, "measure 'own'"):
            OwnMeasure("own", *arguments)
    with refused(InputError, "measure 'own', unit"):
        OwnMeasure("own", energy, "mean", 7)


@pytest.mark.parametrize("name", ["run", "status", "beta", "sync_rms", "step_error", "delay_margin"])
def test_a_name_that_is_taken_is_refused(name):
    with refused(InputError, "measures", found=name):
        sweep([OwnMeasure(name, energy, "mean")])
    with refused(InputError, "measures", found="energy"):
        sweep([OWN[0], OWN[0]])
    with refused(InputError, "measures"):
        sweep([energy])


def fails(at):
    raise ValueError("no such thing")


@pytest.mark.parametrize("engine", ["compiled", "pinocchio"])
@pytest.mark.parametrize("value", [fails, lambda at: at.v, lambda at: "word", lambda at: None, lambda at: 1j])
def test_a_function_that_fails_ends_the_sweep_and_is_named(value, engine):
    with refused(SweepError, "measure 'own'"):
        sweep([OwnMeasure("own", value, "mean")], 1, base(), engine=engine).run_one(0)


def test_what_is_no_finite_number_is_empty():
    q = sweep([], 1).simulate(0).q[:, 0, 0]
    middle = float(np.median(q))  # of some instants there is a number, of others none
    measures = [
        OwnMeasure("none", lambda at: at.v[0, 0] * np.inf, "largest"),
        OwnMeasure("root", lambda at: np.sqrt(-1 - energy(at)), "mean"),
        OwnMeasure("at_times", lambda at: np.sqrt(at.q[0, 0] - middle), "largest"),
        OwnMeasure("one", lambda at: 1.0, "integral"),
    ]
    for engine in ("compiled", "pinocchio"):
        found, alone, _ = rows(sweep(measures, 2, engine=engine))
        assert found == alone
        assert all(row[-4:-1] == [None] * 3 for row in found)
        assert all(row[-1] == pytest.approx(small().duration, rel=1e-12) for row in found)


def scaled(at, factor):
    return factor * energy(at)


def test_functions_with_arguments_are_told_by_their_name():
    own = OwnMeasure("own", partial(scaled, factor=2.0), "final")
    assert own.describe()["function"] == "scaled"
    (found, *_) = rows(sweep([own, OwnMeasure("energy", energy, "final")], 3))
    assert all(row[-2] == 2.0 * row[-1] for row in found)


def test_the_example_of_the_page_runs():
    page = (Path(__file__).parents[1] / "docs" / "sweeps.md").read_text("utf-8")
    (block,) = [
        text for text in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL) if "OwnMeasure" in text
    ]
    names: dict = {}
    exec(compile(block.replace("duration=2.0", "duration=0.1"), "docs/sweeps.md", "exec"), names)
    row = names["sweep"].run_one(0)
    assert row["mean_power"] == pytest.approx(names["sweep"].study.measures[0].of(names["sweep"].simulate(0)))
    assert row["apart"] > 0
