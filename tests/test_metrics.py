"""Metrics of signals whose metrics are known, and of runs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl.analysis.metrics import (
    as_data,
    error_metrics,
    metrics,
    settling_bands,
    settling_time,
    write_metrics,
)
from synctrl.errors import InputError, ResultError
from synctrl.experiments import a460_pair


@pytest.fixture(scope="module")
def run():
    return a460_pair().simulate(0.2)


@given(st.floats(0.1, 10), st.floats(0.5, 3))
def test_metrics_of_a_decaying_exponential(size, rate):
    t = np.linspace(0, 10 / rate, 20001)
    e = size * np.exp(-rate * t)[:, None]
    found = error_metrics(t, e, band=0.05 * size)
    assert found.peak == pytest.approx(size)
    assert found.ise == pytest.approx(size**2 / (2 * rate), rel=1e-5)
    assert found.rms == pytest.approx(np.sqrt(found.ise / t[-1]))
    assert found.settling_time == pytest.approx(np.log(20) / rate, abs=2 * t[1])
    assert found.final == pytest.approx(size * np.exp(-10))


def test_a_signal_settles_when_it_enters_the_band_for_the_last_time():
    t = np.arange(6.0)
    assert settling_time(t, np.array([3, 0.5, 2, 0.5, 0.5, 0.5]), 1.0) == 3
    assert settling_time(t, np.zeros(6), 1.0) == 0
    assert settling_time(t, np.array([0, 0, 0, 0, 0, 2.0]), 1.0) == np.inf


def test_runs_that_are_compared_share_their_band(run):
    other = a460_pair(synchronized=False).simulate(0.2)
    shared = settling_bands(run, other)
    assert shared["sync_error"] == max(settling_bands(r)["sync_error"] for r in (run, other))


def test_metrics_as_data_are_finite_and_named(run):
    data = json.loads(json.dumps(as_data(run, metrics(run)), allow_nan=False))
    joint = data["sync_error"]["values"]["1: robot 1, robot 2"]["joint2"]
    assert joint["peak"] == np.abs(run.sync_error[:, 0, 1]).max()
    assert data["sync_error"]["units"] == {
        "peak": "rad", "rms": "rad", "ise": "rad²·s", "settling_time": "s", "final": "rad"
    }  # fmt: skip
    assert data["peak_torque"]["values"]["robot 1"]["joint1"] == np.abs(run.tau[:, 0, 0]).max()
    assert data["gains"]["beta"] == 8.0
    assert "pin" in data["versions"]


def test_numbers_that_are_not_finite_and_folders_that_are_files_are_refused(tmp_path):
    with refused(InputError, "metrics"):
        write_metrics(tmp_path / "m.json", {"a": {"peak": float("nan")}}, [])
    (tmp_path / "file").write_text("")
    with refused(ResultError, file=str(tmp_path / "file" / "m.json")):
        write_metrics(tmp_path / "file" / "m.json", {}, [])
    with refused(InputError, "settling bands"):
        settling_bands()
