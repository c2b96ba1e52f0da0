"""Runs side by side are those made one by one: rows, bits, warnings, and what is lost when something dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machines import random_robot
from refusals import refused
from sweeps import DT, quiet
from test_columns import small

from synctrl import Cell, Coupling, Experiment, ExponentialApproach, Gains, JointSpace, Member
from synctrl.control.adaptation import Box
from synctrl.control.laws import SunMills
from synctrl.errors import InputError, StepWarning, SweepError
from synctrl.experiments import planar_four
from synctrl.sweep import (
    Factor,
    Grid,
    LogUniform,
    Normal,
    Sweep,
    Uniform,
    backends,
    control_period,
    disturbance_scale,
    disturbance_start,
    gain,
    gain_scale,
    initial_positions,
    initial_velocities,
    law,
    load,
    model_error,
    true_parameters,
    weights,
)
from synctrl.sweep.blocks import LANES
from synctrl.sweep.columns import Columns
from synctrl.sweep.worker import Runner
from synctrl.tune import tune

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
TESTS = Path(__file__).parent
ENV = {**os.environ, "PYTHONPATH": os.pathsep.join((str(TESTS.parent), str(TESTS)))}
BANDS = {"tracking_error": 1e-3, "sync_error": 1e-3}


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """One cache for all runs of this file."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("SYNCTRL_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def sweep(factors, samples=1, start=None, **options) -> Sweep:
    options = {"dt": DT, "bands": BANDS, **options}
    return Sweep(start or small(), factors, samples=samples, **options)


def free() -> Sweep:
    """Twelve runs that go to their end."""
    return sweep([gain("beta", LogUniform(1, 100)), model_error(Uniform(-1, 1))], 12)


def single() -> Experiment:
    """Two pendulums, compared in one coordinate."""
    members = [Member(random_robot(seed, 1), ExponentialApproach([0.1], [0.4])) for seed in range(2)]
    cell = Cell(members, Coupling.pair([1.0, 1.0]), JointSpace())
    return Experiment(cell, Gains(5.0, 5.0, 3.0, 1.0, 0.1), 1.0)


SWEEPS = {
    "one coordinate": (lambda: sweep([gain("beta", Uniform(1, 9))], 9, single(), dt=1e-3), 9),
    "numbers": (free, 12),
    "a start": (
        lambda: sweep(
            [
                true_parameters(Uniform(0.5, 2)),
                model_error(Normal(0, 0.1)),
                initial_positions(Uniform(-0.1, 0.1), joint=1),
                initial_velocities(Uniform(-0.1, 0.1), robot=0),
                disturbance_scale(Uniform(-2, 2), 1),
                gain_scale("K_r", LogUniform(0.5, 2)),
            ],
            7,
        ),
        7,
    ),
    "refused ones between": (
        lambda: sweep([gain("Lambda", Grid([5, 0, 7, -1])), gain("beta", Grid([1, 2]))]),
        4,
    ),
    "stopped ones between": (lambda: sweep([gain("K_r", Grid([1, 1e6, 2]))], duration=0.1), 2),
    "groups": (
        lambda: sweep([gain("beta", Grid([1, 2, 3])), control_period(Grid([DT, 1.5 * DT, 2 * DT]))]),
        6,
    ),
    "what moves in time or couples": (
        lambda: sweep(
            [weights(Grid([1, 2])), disturbance_start(Grid([0, 0.003])), gain("K_eps", Uniform(1, 2))], 2
        ),
        8,
    ),
    "groups of one": (lambda: sweep([weights(Uniform(1, 2)), gain("beta", Uniform(1, 2))], 3), 0),
    "laws": (
        lambda: sweep(
            [law(Grid([SunMills(), SunMills(reference_acceleration="paper")])), gain("beta", Uniform(1, 2))],
            2,
        ),
        4,
    ),
    "four arms": (
        lambda: sweep(
            [
                true_parameters(Uniform(0.8, 1.2), body=1),
                model_error(Uniform(-0.5, 0.5)),
                gain("beta", Uniform(5, 9)),
            ],
            9,
            planar_four(disturbance="torque"),
            duration=0.6,
            dt=5e-3,
        ),
        9,
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_runs_side_by_side_have_the_rows_that_they_have_alone(name):
    make, together = SWEEPS[name]
    made = make()
    runner, tasks = Runner(made.study.job()), [made._task(run) for run in range(len(made))]
    found = [*runner.outcomes(tasks)]
    alone = [runner.outcome(task) for task in tasks]
    assert [each.row for each in found] == [each.row for each in alone]
    assert len(runner._blocks.outcomes(tasks)) == together


def test_doubts_of_runs_side_by_side_are_those_of_runs_alone():
    made = sweep([gain("Lambda", LogUniform(2, 500))], 10, planar_four(), duration=0.4, dt=4e-3)
    runner, tasks = Runner(made.study.job()), [made._task(run) for run in range(10)]
    found = [each.doubt for each in runner.outcomes(tasks)]
    alone = [runner.outcome(task).doubt for task in tasks]
    assert [doubt._replace(advised=None) for doubt in alone] == found
    assert 0 < sum(doubt.estimate is not None for doubt in found) < 10


def said(call) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if each.category is StepWarning]


def test_a_sweep_advises_the_step_that_it_advises_of_runs_alone(tmp_path, monkeypatch):
    made = lambda: sweep([gain("Lambda", LogUniform(2, 500))], 6, planar_four(), duration=0.4, dt=4e-3)  # noqa: E731
    together = said(lambda: quiet(made(), tmp_path / "together", backend="serial"))
    monkeypatch.setattr("synctrl.sweep.blocks.Blocks.outcomes", lambda blocks, tasks: {})
    assert said(lambda: quiet(made(), tmp_path / "alone", backend="serial")) == together
    assert together


@pytest.mark.parametrize("kept", [{"keep_every": 2}, {}])
def test_trajectories_and_a_users_own_factors_are_made_run_by_run(kept, tmp_path, monkeypatch):
    own = [] if kept else [Factor("own", Grid([1]), lambda experiment, value: experiment)]
    made = sweep([gain("beta", Grid([1, 2])), *own])
    monkeypatch.setattr("synctrl.sweep.blocks.Blocks._group", None)
    quiet(made, tmp_path, backend="serial", **kept)
    assert list(load(tmp_path)["status"]) == ["completed"] * 2


def stiffer(experiment, value):
    return replace(experiment, gains=experiment.gains.replace(K_eps=value, K_r=2 * value))


def stiffer_columns(arrays, values):
    arrays["K_eps"][...] = values[:, None, None]
    arrays["K_r"][...] = 2 * values[:, None, None]


def test_a_users_own_factor_may_have_columns(monkeypatch):
    made = sweep(
        [Factor("stiffness", Uniform(1, 2), stiffer, stiffer_columns), gain("beta", Uniform(1, 2))], 5
    )
    runner, tasks = Runner(made.study.job()), [made._task(run) for run in range(5)]
    alone = [runner.outcome(task).row for task in tasks]
    monkeypatch.setattr(Runner, "outcome", None)
    assert [each.row for each in runner.outcomes(tasks)] == alone


def test_columns_of_a_users_own_that_fail_end_the_sweep_and_name_their_factor(tmp_path):
    made = sweep([Factor("own", Grid([1, 2]), stiffer, lambda arrays, values: values["K_eps"])], 1)
    with refused(SweepError, "factor 'own'"):
        quiet(made, tmp_path, 1, "serial")
    with refused(InputError, "factor 'own', columns", found=3):
        Factor("own", Grid([1]), stiffer, 3)


def test_theta_follows_true_parameters_that_are_those_of_the_base():
    columns = Columns(small().plan(0.01, 1e-3), 2)
    before = columns["theta"].copy()
    columns.moved(0)
    np.testing.assert_allclose(columns["theta"], before, rtol=1e-9)


def test_runs_that_cannot_go_together_are_left_to_processes(tmp_path, monkeypatch):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    learning = replace(small(), adaptation=Box(0.1, -9.0, 9.0), gains=small().gains.replace(Gamma=None))
    made = sweep([model_error(Uniform(-0.1, 0.1))], 4, learning)
    monkeypatch.setattr("synctrl.sweep.backends._threads", None)
    table = quiet(made, tmp_path / "processes")
    assert table == quiet(made, tmp_path / "serial", backend="serial")


# -- the same table, whoever makes it ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole(tmp_path_factory, cache) -> bytes:
    """The table of runs made one by one."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("synctrl.sweep.blocks.Blocks.outcomes", lambda blocks, tasks: {})
        return quiet(free(), tmp_path_factory.mktemp("whole"), backend="serial")


@pytest.mark.parametrize("batch", [None, 1, 5])
@pytest.mark.parametrize(("backend", "workers"), [("serial", 1), ("joblib", 1), ("joblib", 2)])
def test_the_table_is_the_same_in_blocks_of_any_size(backend, workers, batch, whole, tmp_path):
    if backend == "joblib":
        pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    assert quiet(free(), tmp_path, workers, backend, batch=batch) == whole


@pytest.mark.parametrize("width", [1, 2, 4, 8])
def test_the_table_is_the_same_in_any_number_of_lanes(width, whole, tmp_path, monkeypatch):
    from synctrl.compiled import processor

    if width > processor.widest():
        pytest.skip(f"this processor has {processor.widest()} lanes")
    made = []
    monkeypatch.setattr(processor, "widest", lambda: made.append(width) or width)
    assert quiet(free(), tmp_path, backend="serial") == whole
    assert made


def test_the_table_is_the_same_from_a_cluster(whole, tmp_path):
    distributed = pytest.importorskip("distributed", reason="pip install 'synctrl[sweep]'")
    with distributed.Client(processes=False, n_workers=1, dashboard_address=None) as client:
        assert quiet(free(), tmp_path, backend="dask", client=client) == whole


def test_a_sweep_goes_on_in_the_middle_of_a_block(whole, tmp_path):
    quiet(free(), tmp_path, backend="serial", batch=5)
    path = tmp_path / "runs.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[3:4] + lines[6:9]) + lines[0][:40])
    assert quiet(free(), tmp_path, 2) == whole


def generations(folder, monkeypatch, backend: str) -> tuple[list[int], list[int]]:
    """A search of four generations of 24: how many runs each task of a worker has, and each trial of one."""
    sizes, tried = [], []
    outcomes, go_together = Runner.outcomes, Runner.go_together
    monkeypatch.setattr(Runner, "outcomes", lambda *given: sizes.append(len(given[1])) or outcomes(*given))
    monkeypatch.setattr(
        Runner, "go_together", lambda *given: tried.append(len(given[1])) or go_together(*given)
    )
    search = {"beta": LogUniform(1, 100), "Lambda": Uniform(4, 9)}
    options = {"generations": 3, "population": 24, "workers": 2, "progress": False}
    tune(small(), search, folder=folder, backend=backend, duration=0.01, dt=DT, bands=BANDS, **options)
    return sizes, tried


def test_tasks_of_generations_fill_the_lanes_while_all_workers_have_one(tmp_path, monkeypatch):
    sizes, _ = generations(tmp_path, monkeypatch, "serial")
    assert sum(sizes) == 4 * 24 and {*sizes} == {LANES}


def test_workers_of_one_generation_are_those_of_the_next(tmp_path, monkeypatch):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    made: list[bytes] = []
    runner_of = backends.runner_of
    monkeypatch.setattr(backends, "runner_of", lambda payload: made.append(payload) or runner_of(payload))
    sizes, tried = generations(tmp_path, monkeypatch, "joblib")
    assert sum(sizes) == 4 * 24 and len(tried) == 2 and len(made) < 2


# -- nothing is lost but runs in flight -------------------------------------------------------------------

KILLED = """
import os, signal
from test_sweep_blocks import after, free, quiet

after(2, lambda: os.kill(os.getpid(), signal.SIGKILL))
quiet(free(), {folder!r}, 2, {backend!r}, batch=3)
"""


def after(blocks: int, call) -> None:
    """Let something happen in the middle of every block after so many."""
    from synctrl.compiled.batch import Batch

    measure, made = Batch.measure, []

    def measured(batch, columns, count):
        found = measure(batch, columns, count)
        made.append(count)
        if len(made) > blocks:
            call()
        return found

    Batch.measure = measured


@pytest.mark.parametrize("backend", ["serial", "joblib"])
def test_a_sweep_that_is_killed_in_a_block_loses_blocks_in_flight_alone(backend, whole, tmp_path):
    script = KILLED.format(folder=str(tmp_path), backend=backend)
    done = subprocess.run([sys.executable, "-c", script], cwd=TESTS.parent, env=ENV, capture_output=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    written = (tmp_path / "runs.jsonl").read_bytes()
    assert written.count(b"\n") in ({"serial": [6], "joblib": [0, 3, 6]}[backend])
    assert quiet(free(), tmp_path, 2) == whole
    assert (tmp_path / "runs.jsonl").read_bytes().startswith(written)


STOPPED = """
import signal
from test_sweep_blocks import after, free, quiet

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it otherwise
after(2, lambda: signal.raise_signal(signal.SIGINT))
quiet(free(), {folder!r}, 2, {backend!r}, batch=3)
"""


@pytest.mark.parametrize("backend", ["serial", "joblib"])
def test_ctrl_c_ends_a_sweep_that_goes_on_from_the_blocks_before(backend, whole, tmp_path):
    script = STOPPED.format(folder=str(tmp_path), backend=backend)
    done = subprocess.run([sys.executable, "-c", script], cwd=TESTS.parent, env=ENV, capture_output=True)
    assert b"KeyboardInterrupt" in done.stderr, done.stderr
    assert (tmp_path / "runs.jsonl").read_bytes().count(b"\n") < 12
    assert quiet(free(), tmp_path, 2) == whole


@pytest.mark.parametrize("backend", ["serial", "joblib"])
def test_an_interrupt_costs_the_blocks_in_flight(backend, whole, tmp_path, monkeypatch):
    from synctrl.compiled.batch import Batch

    def interrupt():
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Batch, "measure", Batch.measure)  # put back at the end
        after(2, interrupt)
        with pytest.raises(KeyboardInterrupt):
            quiet(free(), tmp_path, 1, backend, batch=3)
    assert len(load(tmp_path)) == {"serial": 6, "joblib": 3}[backend]  # joblib has tried one of them before
    assert quiet(free(), tmp_path, 2) == whole


def test_what_fails_in_a_block_is_raised(tmp_path, monkeypatch):
    from synctrl.compiled.batch import Batch

    def fail(batch, columns, count):
        raise RuntimeError("nobody foresaw this")

    monkeypatch.setattr(Batch, "measure", fail)
    for backend in ("serial", "joblib"):
        with pytest.raises(RuntimeError):
            quiet(free(), tmp_path / backend, backend=backend)
