"""Tuning: the best of all runs within the torque limit, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from cells import SMALL_GAINS
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from sweeps import DT, base

from synctrl.errors import InputError, SweepError
from synctrl.sweep import Grid, LogUniform, Uniform, control_period, gain, load, model_error
from synctrl.tune import Goal, tune
from synctrl.tune.goals import Judge

pytest.importorskip("scipy")
SEARCH = {"beta": LogUniform(1, 100), "K_r": LogUniform(0.1, 10)}


def tuned(search=None, **options):
    defaults = {"generations": 2, "population": 6, "dt": DT, "engine": "pinocchio", "backend": "serial"}
    search = SEARCH if search is None else search
    return tune(base(), search, progress=False, **{**defaults, **options})


@pytest.fixture(scope="module")
def free():
    return tuned()


def test_the_best_run_has_the_smallest_measure_of_all(free):
    assert free.measures["sync_rms"] == min(row["sync_rms"] for row in free.history)
    assert len(free.history) == 3 * 6


def test_what_was_found_is_shown_in_a_few_lines(free):
    shown = repr(free)
    assert len(shown) < 500 and shown.count("\n") < 5
    assert "best of 18 runs" in shown and f"beta = {free.values['beta']:.4g}" in shown


def test_the_experiment_it_returns_is_the_best_run(free):
    assert free.gains == SMALL_GAINS.replace(**free.values)
    torque = np.abs(free.experiment.simulate(dt=DT).tau).max()
    assert torque == free.measures["peak_torque"]


def test_values_stay_in_their_ranges(free):
    for row in free.history:
        assert all(SEARCH[name].low <= row[name] <= SEARCH[name].high for name in SEARCH)


def test_the_first_population_covers_every_range_evenly(free):
    for name, values in SEARCH.items():
        shares = [
            np.log(row[name] / values.low) / np.log(values.high / values.low) for row in free.history[:6]
        ]
        assert sorted(int(6 * share) for share in shares) == list(range(6))


def test_the_same_seed_gives_the_same_search_and_another_does_not(free):
    assert tuned().history == free.history
    assert tuned(seed=1).history != free.history


def test_the_search_does_not_depend_on_the_number_of_workers(free):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    assert tuned(backend="joblib", workers=2).history == free.history


def test_later_generations_do_better(free):
    first = min(row["sync_rms"] for row in free.history[:6])
    assert tuned(generations=6).measures["sync_rms"] < first


def test_the_torque_limit_is_kept(free):
    torques = sorted(row["peak_torque"] for row in free.history)
    limit = torques[len(torques) // 2]
    limited = tuned(torque_limit=limit)
    assert limited.measures["peak_torque"] <= limit
    within = [row["sync_rms"] for row in limited.history if row["peak_torque"] <= limit]
    assert limited.measures["sync_rms"] == min(within)


def test_a_torque_limit_that_no_run_keeps_is_an_error_with_the_smallest_torque():
    with refused(SweepError, "torque_limit") as caught:
        tuned(torque_limit=1e-6)
    assert caught.value.found > 1e-6


def test_a_measure_that_no_run_has_is_named_as_the_cause():
    bands = {"tracking_error": 1e-12, "sync_error": 1e-12}
    with refused(SweepError, "minimize"):
        tuned(minimize="sync_settling_time", bands=bands, generations=1)


def test_a_run_without_the_measure_is_worse_than_those_with_it_and_better_than_those_outside_the_limit():
    told = Judge((Goal("sync_settling_time"),), {"peak_torque": 10.0}, 0.01).told
    settled = {"status": "completed", "stop_time": None, "sync_settling_time": 1e3, "peak_torque": 10.0}
    never, outside = {**settled, "sync_settling_time": None}, {**settled, "peak_torque": 10.1}
    assert told(settled) < told(never) < told(outside)


def test_a_search_goes_on_from_its_folder(free, tmp_path):
    again = tuned(folder=tmp_path, generations=1)
    written = (tmp_path / "runs.jsonl").read_bytes()
    assert tuned(folder=tmp_path).history == free.history
    assert (tmp_path / "runs.jsonl").read_bytes().startswith(written)
    assert again.history == free.history[:12]
    assert list(load(tmp_path)["sync_rms"]) == [row["sync_rms"] for row in free.history]


def test_factors_of_a_sweep_can_be_searched():
    found = tuned([gain("beta", LogUniform(1, 100)), model_error(Uniform(-1, 1))], minimize="tracking_rms")
    assert set(found.values) == {"beta", "model_error"}
    assert found.measures["tracking_rms"] == min(row["tracking_rms"] for row in found.history)


outcomes = st.fixed_dictionaries(
    {
        "status": st.sampled_from(["completed", "stopped"]),
        "sync_rms": st.floats(0, 1e6),
        "peak_torque": st.floats(0, 1e6),
        "stop_time": st.floats(0, 0.01),
    }
)


def rank(row, limit):
    """What is better comes first: a run to its end within the limit, then outside, then one that stops."""
    if row["status"] == "stopped":
        return 2, -row["stop_time"]
    if row["peak_torque"] > limit:
        return 1, row["peak_torque"]
    return 0, row["sync_rms"]


@given(a=outcomes, b=outcomes, limit=st.floats(0.1, 1e3))
def test_what_a_search_is_told_is_in_the_order_of_what_is_better(a, b, limit):
    told = Judge((Goal("sync_rms"),), {"peak_torque": limit}, 0.01).told
    if rank(a, limit) < rank(b, limit):
        assert told(a) <= told(b)
    if rank(a, limit)[0] < rank(b, limit)[0]:
        assert told(a) < told(b)


@pytest.mark.parametrize(
    "wrong",
    [
        {"search": {}},
        {"search": {"alpha": Uniform(1, 2)}},
        {"search": {"beta": Grid([1, 2])}},
        {"search": {"beta": (1, 2)}},
        {"search": ["beta"]},
        {"search": [control_period(Uniform(0.002, 0.004))]},
        {"minimize": "speed"},
        {"torque_limit": 0},
        {"generations": 0},
        {"population": 4},
        {"seed": 0.5},
    ],
)
def test_a_wrong_value_is_an_input_error(wrong):
    with pytest.raises(InputError):
        tuned(**wrong)
