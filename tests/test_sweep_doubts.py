"""Sweeps and searches say at their end, once, how many runs had too long a step or torque cut off."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sweeps import DT, base
from test_saturation import pair

from synctrl import Experiment
from synctrl.control.adaptation import Gradient
from synctrl.errors import SaturationWarning, StepWarning
from synctrl.sweep import Factor, Grid, LogUniform, Sweep, gain, load
from synctrl.tune import tune

KINDS = (StepWarning, SaturationWarning)
BANDS = {"tracking_error": 0.1, "sync_error": 0.1}


def asked(experiment: Experiment, way: float) -> Experiment:
    """A pair that is asked for so much; for less than nothing, one that diverges."""
    return pair(way=way) if way >= 0 else pair(K_r=1e6, saturate=False)


def hasty_sweep() -> Sweep:
    """Runs some of which are cut off, or have too long a step too; the last one stops."""
    factors = [Factor("way", Grid([0.0, 20.0, 60.0, 40.0, -1.0]), asked)]
    return Sweep(pair(), factors, duration=0.05, dt=1e-3, engine="pinocchio", bands=BANDS)


def said(call) -> dict[type, str]:
    """What a call warns of, by kind, each once and at a line of this file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    told = [each for each in caught if each.category in KINDS]
    assert {Path(each.filename) for each in told} <= {Path(__file__)}
    assert len({each.category for each in told}) == len(told)
    return {each.category: str(each.message) for each in told}


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> dict[type, str]:
    folder = tmp_path_factory.mktemp("serial")
    return said(lambda: hasty_sweep().run(folder, backend="serial", progress=False))


def test_a_sweep_counts_the_runs_to_be_doubted_and_names_the_worst(serial):
    sweep = hasty_sweep()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        infos = {run: sweep.simulate(run).info for run in range(4)}
    steps = {run: info["step_error"] for run, info in infos.items() if info["step_error"]["advised_step"]}
    shares = {run: max((e["share"] for e in info["saturation"]), default=0) for run, info in infos.items()}
    worst = max(steps, key=lambda run: steps[run]["estimate"])
    assert f"{len(steps)} of the 4 runs" in serial[StepWarning] and len(steps) < 4
    assert f"in run {worst} a step errs by {steps[worst]['estimate']:.2g}" in serial[StepWarning]
    shortest = min(step["advised_step"] for step in steps.values())
    assert f"at most {shortest:g} s" in serial[StepWarning]
    cut = sum(share > 0 for share in shares.values())
    assert f"{cut} of the 4 runs" in serial[SaturationWarning] and 0 < cut < 4
    assert f"most in run {max(shares, key=shares.get)}," in serial[SaturationWarning]


def test_the_table_says_of_each_run_how_far_it_is_to_be_doubted(tmp_path):
    pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
    sweep = hasty_sweep()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sweep.run(tmp_path, backend="serial", progress=False)
        infos = [sweep.simulate(run).info for run in range(4)]
    table = load(tmp_path)
    estimates = [info["step_error"]["estimate"] for info in infos]
    assert estimates[0] is None, "the first run does not move"
    np.testing.assert_array_equal(table["step_error"][:4], np.array(estimates, dtype=float))
    shares = [max((e["share"] for e in info["saturation"]), default=0.0) for info in infos]
    assert list(table["saturation"][:4]) == shares
    assert len(set(shares)) > 1
    assert table.loc[4, ["step_error", "saturation"]].isna().all(), "a run that stops has no measures"
    for name in ("step_error", "saturation"):
        assert table.attrs["measures"][name]["definition"]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_sweep_says_does_not_depend_on_its_workers(serial, workers, tmp_path):
    pytest.importorskip("joblib")
    assert said(lambda: hasty_sweep().run(tmp_path, workers, batch=1, progress=False)) == serial


def test_a_sweep_that_is_done_has_nothing_more_to_say(tmp_path):
    sweep = Sweep(pair(way=60.0), [gain("beta", Grid([5.0]))], duration=0.05, engine="pinocchio", bands=BANDS)
    run = lambda: sweep.run(tmp_path, backend="serial", progress=False)  # noqa: E731
    assert said(run).keys() == {*KINDS}
    assert said(run) == {}


def test_a_sweep_of_good_runs_is_silent(tmp_path):
    sweep = Sweep(base(), [gain("beta", Grid([1.0, 2.0]))], dt=DT / 4, engine="pinocchio")
    assert said(lambda: sweep.run(tmp_path, backend="serial", progress=False)) == {}


def test_a_search_says_the_same_at_its_end():
    options = {"generations": 1, "population": 5, "duration": 0.02, "engine": "pinocchio", "bands": BANDS}
    search = {"K_r": LogUniform(1, 10)}
    plain = pair(way=60.0)
    plain = replace(plain, adaptation=Gradient(0.5), gains=plain.gains.replace(Gamma=None))  # has no bounds
    told = said(lambda: tune(plain, search, backend="serial", progress=False, **options))
    assert told.keys() == {*KINDS}
    assert all(text.startswith("tune: ") and "of the 10 runs" in text for text in told.values())
