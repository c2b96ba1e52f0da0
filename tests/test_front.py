"""Tuning for several goals: the front is what no other run is preferable to, and all of it."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from cells import SMALL_GAINS
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from sweeps import DT, Pause, base, interrupt
from test_sweep import ENV, ROOT, wait_for_lines

from synctrl import (
    Cell,
    Coupling,
    Disturbance,
    Experiment,
    Hold,
    JointSpace,
    Member,
    load_robot,
)
from synctrl.analysis import delay_margin
from synctrl.control.laws import ChungSlotine
from synctrl.errors import InputError, MissingDependencyError, ResultError, SweepError
from synctrl.sweep import Factor, LogUniform, Uniform, gain, initial_positions, load
from synctrl.tune import Goal, tune
from synctrl.tune.asking import for_one, for_several, spread
from synctrl.tune.goals import Judge, knee, non_dominated, read_goals

pytest.importorskip("scipy")
pytest.importorskip("optuna", reason="pip install 'synctrl[tune]'")
SEARCH = {"beta": LogUniform(1, 100), "K_r": LogUniform(0.1, 10)}
TWO = ("sync_rms", "peak_torque")
#: gains that decide how much delay is tolerated, and a duration longer than some of it, s
DAMPING, LONG = {"K_r": LogUniform(0.02, 0.5), "K_eps": LogUniform(5, 300)}, 0.1
OPTIONS = {"generations": 2, "population": 6, "dt": DT, "engine": "pinocchio", "backend": "serial"}


def tuned(search=None, start=None, **options):
    search = SEARCH if search is None else search
    options = {"minimize": TWO, **OPTIONS, **options}
    return tune(base() if start is None else start, search, progress=False, **options)


@pytest.fixture(scope="module")
def found():
    return tuned()


def preferable(a, b, goals):
    """Whether row a is as good as row b in every goal, and better in one."""
    pairs = [(a[g.name], b[g.name]) if not g.larger else (b[g.name], a[g.name]) for g in goals]
    return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)


# -- the filter -------------------------------------------------------------------------------------------


numbers = st.integers(0, 4).map(float) | st.floats(-1e3, 1e3)
tables = st.integers(1, 4).flatmap(lambda k: st.lists(st.tuples(*[numbers] * k), min_size=1, max_size=25))


@given(tables)
def test_the_filter_keeps_what_nothing_is_preferable_to_and_all_of_it(table):
    values = np.array(table)
    worse = [any((b <= a).all() and (b < a).any() for b in values) for a in values]
    assert non_dominated(values).tolist() == [not each for each in worse]


@given(tables, st.randoms())
def test_the_filter_does_not_ask_for_an_order(table, random):
    order = list(range(len(table)))
    random.shuffle(order)
    values = np.array(table)
    np.testing.assert_array_equal(non_dominated(values)[order], non_dominated(values[order]))


@given(tables, st.integers(-8, 8))
def test_the_knee_is_on_the_front_and_knows_no_units(table, power):
    values = np.array(table)
    values = values[non_dominated(values)]
    scales = 2.0 ** (power * np.arange(values.shape[1]))
    assert knee(values) == knee(values * scales)
    assert 0 <= knee(values) < len(values)


def test_the_knee_of_a_bend_is_its_corner():
    assert knee(np.array([[0.0, 1.0], [0.1, 0.1], [1.0, 0.0]])) == 1


# -- what a search is told --------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.floats(0, 1e6), st.floats(0, 1e6)), min_size=2, max_size=2))
def test_of_runs_that_count_a_search_is_told_who_is_better_in_each_goal(pair):
    judge = Judge((Goal("sync_rms"), Goal("delay_margin", True)), {}, 1.0)
    a, b = ({"status": "completed", "stop_time": None, "sync_rms": x, "delay_margin": y} for x, y in pair)
    (sync_a, margin_a), (sync_b, margin_b) = judge.told(a), judge.told(b)
    assert (sync_a <= sync_b) or a["sync_rms"] > b["sync_rms"]
    assert (margin_a <= margin_b) or a["delay_margin"] < b["delay_margin"]
    assert max(sync_a, margin_a, sync_b, margin_b) <= 1


def test_a_run_that_counts_is_better_in_every_goal_than_one_that_does_not():
    judge = Judge(
        (Goal("sync_rms"), Goal("delay_margin", True)), {"saturation": 0.0, "peak_torque": 2.0}, 1.0
    )
    worst = {"status": "completed", "stop_time": None, "sync_rms": 1e300, "delay_margin": 0.0}
    worst |= {"saturation": 0.0, "peak_torque": 2.0}
    without = {**worst, "delay_margin": None}
    cut = {**worst, "saturation": 0.01}
    both = {**cut, "peak_torque": 3.0}
    late, early, refused = ({"status": "stopped", "stop_time": t} for t in (0.9, 0.1, None))
    told = [judge.told(row) for row in (worst, without, cut, both, late, early, refused)]
    assert all(max(better) < min(worse) for better, worse in pairwise(told))
    assert judge.front([late, worst, both, cut, without]) == [worst]


# -- a front that is known --------------------------------------------------------------------------------


def parabolas(points, a=0.3, b=0.7):
    """Squared distances from two points of the cube: the front is what lies between them."""
    rest = ((points[:, 1:] - 0.5) ** 2).sum(axis=1)
    return np.stack([(points[:, 0] - a) ** 2 + rest, (points[:, 0] - b) ** 2 + rest], axis=1)


def test_a_search_comes_near_to_the_whole_front_of_two_parabolas():
    asked = []

    def tell(points):
        asked.append(points)
        return parabolas(points)

    rng = np.random.default_rng(0)
    for_several(tell, spread(rng, 24, 2), 30, 2, rng)
    values = parabolas(np.vstack(asked))
    front = np.sqrt(values[non_dominated(values)])
    assert np.median(front.sum(axis=1) - 0.4) < 0.01  # what the triangle leaves over the distance of 0.4
    first = np.sqrt(parabolas(asked[0]))
    assert np.median(first.sum(axis=1) - 0.4) > 0.05
    places = np.sort(front[:, 0])
    assert places[0] < 0.05 and places[-1] > 0.35 and np.diff(places).max() < 0.1


def test_a_search_asks_for_what_it_was_told_and_nothing_else():
    def points(search, seed):
        asked, rng = [], np.random.default_rng(seed)

        def tell(points):
            asked.append(points.copy())
            return parabolas(points)

        search(tell, spread(rng, 6, 3), 4, rng=rng)
        return np.array(asked)

    for search in (for_one, partial(for_several, goals=2)):
        np.testing.assert_array_equal(points(search, 1), points(search, 1))
        assert (points(search, 1) != points(search, 2)).any()


def resting_pair(offset=0.1):
    """Two arms that are to stay where they are, the second of which starts beside its place."""
    arm = load_robot("planar2r")
    places = [np.array([0.3, 1.2]), np.array([0.4, 1.3])]
    starts = [places[0], places[1] + [offset, 0]]
    members = [
        Member(arm.placed((i, 0.0, 0.0), name=f"arm {i + 1}"), Hold(places[i]), starts[i]) for i in range(2)
    ]
    cell = Cell(members, Coupling.pair(), JointSpace(), name="resting")
    return Experiment(cell, SMALL_GAINS, 2e-3)


def test_a_cell_whose_front_is_known():
    """Tracking asks the first arm to start at its place, synchronization as far from it as the second."""
    found = tuned(
        [initial_positions(Uniform(-0.3, 0.3), robot=0, joint=0)],
        resting_pair(),
        minimize=("tracking_ise", "sync_ise"),
        population=12,
        dt=1e-3,
    )
    (name,) = found.values
    for row in found.history:  # joints hardly move within two steps
        assert row["tracking_ise"] == pytest.approx(2e-3 * (row[name] ** 2 + 0.1**2), rel=0.02)
    inside = {row["run"] for row in found.history if 0.002 < row[name] < 0.098}
    near = {row["run"] for row in found.history if -0.002 < row[name] < 0.102}
    assert len(inside) >= 5
    assert inside <= {row["run"] for row in found.front} <= near


# -- a search ---------------------------------------------------------------------------------------------


def test_the_front_of_a_search_is_the_front_of_its_history(found):
    front = [
        row
        for row in found.history
        if not any(preferable(other, row, found.goals) for other in found.history)
    ]
    assert sorted(row["run"] for row in found.front) == sorted(row["run"] for row in front)
    assert len(found.front) >= 2
    sync = [row["sync_rms"] for row in found.front]
    assert sync == sorted(sync)


def test_the_chosen_run_is_on_the_front_and_others_can_be_chosen(found):
    assert found.run in {row["run"] for row in found.front}
    for goal in TWO:
        assert found.best(goal).measures[goal] == min(row[goal] for row in found.history)
    last = found.front[-1]
    assert found.chosen(last["run"]).values == {name: last[name] for name in SEARCH}
    assert found.chosen(last["run"]).gains == SMALL_GAINS.replace(**{name: last[name] for name in SEARCH})
    assert found.best("sync_rms").best().run == found.run
    assert f"run {found.run} of {len(found.front)} on the front of 18 runs" in repr(found)


def test_what_is_not_on_the_front_cannot_be_chosen(found):
    off = next(row["run"] for row in found.history if row not in found.front)
    for wrong in (off, 10**6, -1, "first"):
        with refused(InputError, "run"):
            found.chosen(wrong)
    with refused(InputError, "goal"):
        found.best("tracking_rms")


def test_the_experiment_it_returns_is_the_chosen_run(found):
    result = found.best("peak_torque").experiment.simulate(dt=DT)
    assert np.abs(result.tau).max() == found.best("peak_torque").measures["peak_torque"]


def test_a_front_does_not_depend_on_the_number_of_workers(found):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    for workers in (1, 2):
        assert tuned(backend="joblib", workers=workers).history == found.history


def test_limits_keep_runs_off_the_front(found):
    limit = float(np.median([row["step_error"] for row in found.history]))
    kept = tuned(limits={"step_error": limit})
    assert all(row["step_error"] <= limit for row in kept.front)
    assert any(row["step_error"] > limit for row in kept.history)
    assert kept.history[:6] == found.history[:6]


def test_runs_that_stop_are_told_apart_and_never_on_the_front():
    strong = replace(base(), disturbances=[Disturbance(0, (1e9, 0.0), 0.002, 0.01)])
    stops = Factor("push", Uniform(0, 1), partial(pushed, strong=strong.disturbances))
    found = tuned([*[gain(name, values) for name, values in SEARCH.items()], stops])
    stopped = {row["run"] for row in found.history if row["status"] == "stopped"}
    assert stopped and not stopped & {row["run"] for row in found.front}


def pushed(experiment, value, strong):
    return replace(experiment, disturbances=strong) if value > 0.5 else experiment


# -- the delay margin -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def with_margin():
    return tuned(DAMPING, maximize="delay_margin", duration=LONG)


def test_the_delay_margin_is_that_of_the_run_up_to_the_duration(with_margin):
    for row in with_margin.history:
        gains = SMALL_GAINS.replace(K_r=row["K_r"], K_eps=row["K_eps"])
        assert row["delay_margin"] == min(delay_margin(base().cell, gains).delay, LONG)
    margins = {row["delay_margin"] for row in with_margin.history}
    assert LONG in margins and len(margins) > 1


def test_of_the_delay_margin_the_largest_is_best(with_margin):
    goals = with_margin.goals
    assert [goal.name for goal in goals if goal.larger] == ["delay_margin"]
    front = [
        row["run"]
        for row in with_margin.history
        if not any(preferable(other, row, goals) for other in with_margin.history)
    ]
    assert sorted(row["run"] for row in with_margin.front) == front
    best = with_margin.best("delay_margin").measures["delay_margin"]
    assert best == max(row["delay_margin"] for row in with_margin.history)


def test_one_goal_may_be_maximized():
    found = tuned(minimize=(), maximize="tracking_rms")
    assert found.measures["tracking_rms"] == max(row["tracking_rms"] for row in found.history)
    assert len(found.front) == 1


def test_an_experiment_that_has_no_delay_margin_is_refused_before_anything_runs():
    other = replace(base(), law=ChungSlotine(0.3), gains=SMALL_GAINS.independent())
    with refused(InputError, "law"):
        tuned({"K_r": LogUniform(0.1, 1)}, other, maximize="delay_margin")


# -- the folder -------------------------------------------------------------------------------------------


def test_a_search_for_a_front_goes_on_from_its_folder(found, tmp_path):
    first = tuned(folder=tmp_path, generations=1)
    written = (tmp_path / "runs.jsonl").read_bytes()
    assert tuned(folder=tmp_path).history == found.history
    assert (tmp_path / "runs.jsonl").read_bytes().startswith(written)
    assert first.history == found.history[:12]


def test_the_table_of_the_front_has_its_rows_to_the_last_digit(with_margin, tmp_path):
    again = tuned(DAMPING, maximize="delay_margin", duration=LONG, folder=tmp_path)
    assert again.history == with_margin.history
    with (tmp_path / "front.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["run"]) for row in rows] == [row["run"] for row in again.front]
    for name in (*DAMPING, *TWO, "delay_margin"):
        assert [float(row[name]) for row in rows] == [row[name] for row in again.front]


def test_the_folder_of_a_search_with_margins_loads(tmp_path):
    pytest.importorskip("pandas", reason="pip install 'synctrl[sweep]'")
    found = tuned(maximize="delay_margin", folder=tmp_path)
    table = load(tmp_path)
    assert list(table["delay_margin"]) == [row["delay_margin"] for row in found.history]
    assert table.attrs["measures"]["delay_margin"]["unit"] == "s"


def test_a_description_with_a_further_measure_that_is_none_is_refused(tmp_path):
    pytest.importorskip("pandas", reason="pip install 'synctrl[sweep]'")
    tuned(folder=tmp_path, generations=1)
    about = json.loads((tmp_path / "sweep.json").read_text("utf-8"))
    about["search"]["further"] = ["beauty"]
    (tmp_path / "sweep.json").write_text(json.dumps(about), "utf-8")
    with refused(ResultError, file=str(tmp_path / "sweep.json")):
        load(tmp_path)


def test_another_search_is_refused_in_its_folder(tmp_path):
    tuned(folder=tmp_path, generations=1)
    for other in ({"minimize": TWO[::-1]}, {"maximize": "delay_margin"}, {"limits": {"saturation": 0}}):
        with refused(ResultError, file=str(tmp_path)):
            tuned(folder=tmp_path, generations=1, **other)


KILLED = """
from test_front import slow
slow({folder!r}, 0.05)
"""


def slow(folder, pause):
    """A search whose runs take a little while."""
    factors = [gain("beta", LogUniform(1, 100)), gain("K_r", LogUniform(0.1, 10))]
    waits = Factor("wait", Uniform(0, 1), Pause(pause))
    return tuned([*factors, waits], folder=folder, generations=3)


def test_a_search_that_is_killed_goes_on_where_it_was(tmp_path):
    folder = tmp_path / "search"
    script = KILLED.format(folder=str(folder))
    with subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, env=ENV) as process:
        wait_for_lines(folder / "runs.jsonl", 9, process)
        process.send_signal(signal.SIGKILL)
    written = (folder / "runs.jsonl").read_bytes()
    kept = written[: written.rfind(b"\n") + 1]
    resumed, whole = slow(folder, 0), slow(tmp_path / "whole", 0)
    assert 9 <= kept.count(b"\n") < len(whole.history)
    assert resumed.history == whole.history
    assert (folder / "runs.jsonl").read_bytes().startswith(kept)
    tables = [(place / "front.csv").read_bytes() for place in (folder, tmp_path / "whole")]
    assert tables[0] == tables[1]


def test_a_search_that_is_interrupted_goes_on_where_it_was(tmp_path):
    flag = tmp_path / "flag"
    factors = [gain("beta", LogUniform(1, 100)), Factor("x", Uniform(0, 1), partial(late, flag=str(flag)))]
    with pytest.raises(KeyboardInterrupt):
        tuned(factors, folder=tmp_path / "search")
    assert flag.exists()
    assert tuned(factors, folder=tmp_path / "search").history == tuned(factors).history


def late(experiment, value, flag):
    """Interrupt the first run in the upper third of a range."""
    return interrupt(experiment, 2 if value > 0.7 else 0, flag)


# -- the table --------------------------------------------------------------------------------------------


def test_the_table_says_which_runs_are_on_the_front(found):
    pytest.importorskip("pandas", reason="pip install 'synctrl[sweep]'")
    table = found.to_pandas()
    assert len(table) == len(found.history)
    assert sorted(table.index[table["front"]]) == sorted(row["run"] for row in found.front)
    assert list(table["sync_rms"]) == [row["sync_rms"] for row in found.history]


# -- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [
        ({"minimize": ("sync_rms", "speed")}, "minimize"),
        ({"minimize": ("sync_rms", "sync_rms")}, "minimize, maximize"),
        ({"maximize": "sync_rms"}, "minimize, maximize"),
        ({"minimize": ()}, "minimize"),
        ({"minimize": "delay_margin"}, "minimize"),
        ({"minimize": 3}, "minimize"),
        ({"maximize": "margin"}, "maximize"),
        ({"limits": {"speed": 1}}, "limits"),
        ({"limits": {"saturation": -1}}, "limits, saturation"),
        ({"limits": 3}, "limits"),
        ({"limits": {"peak_torque": 3}, "torque_limit": 2}, "torque_limit"),
        ({"search": [Factor("delay_margin", Uniform(0, 1), Pause(0))]}, "search"),
    ],
)
def test_wrong_goals_and_limits_are_refused_by_name(wrong, subject):
    with refused(InputError, subject):
        tuned(**wrong)


def test_a_limit_that_no_run_keeps_is_named_with_the_least_that_was_found():
    with refused(SweepError, "limits, tracking_peak") as caught:
        tuned(limits={"tracking_peak": 1e-9}, generations=1)
    assert caught.value.found > 1e-9


@pytest.mark.parametrize("minimize", [(), "sync_rms", ("sync_rms", "saturation")])
def test_goals_are_read_in_their_order(minimize):
    names = [minimize] if isinstance(minimize, str) else [*minimize]
    goals = read_goals(minimize, "delay_margin")
    assert [goal.name for goal in goals] == [*names, "delay_margin"]
    assert [goal.larger for goal in goals] == [False] * len(names) + [True]


def test_without_optuna_several_goals_are_refused_and_one_is_not(monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with refused(MissingDependencyError, "optuna"):
        tuned()
    assert len(tuned(minimize="sync_rms", generations=1).history) == 12
