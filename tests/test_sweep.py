"""Sweeps: any run again alone, the same table whoever makes it, and nothing lost but runs in flight."""

from __future__ import annotations

import json
import math
import os
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused
from sweeps import DT, base, begun, die, die_once, quiet, slow_sweep, small_sweep

from synctrl import Experiment
from synctrl.errors import InputError, ResultError, SweepError, SweepFileError
from synctrl.experiments import a460_pair, mobile_robot, panda_four, planar_four
from synctrl.simulation.result import LAYOUT
from synctrl.sweep import (
    Choice,
    Factor,
    Grid,
    LogUniform,
    Normal,
    Sweep,
    Uniform,
    control_period,
    disturbance_scale,
    disturbance_start,
    evaluation,
    gain,
    gain_scale,
    initial_estimates,
    initial_positions,
    initial_velocities,
    load,
    model_error,
    trajectories,
    true_parameters,
    weights,
)
from synctrl.sweep.description import difference
from synctrl.sweep.worker import Prepared

pytest.importorskip("pandas", reason="tables are read with pandas: pip install 'synctrl[sweep]'")
TESTS = Path(__file__).parent
ROOT = TESTS.parent
ENV = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(TESTS)))}


# -- values -----------------------------------------------------------------------------------------------

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, low=st.floats(1e-6, 1e3), factor=st.floats(1.001, 1e6))
def test_draws_stay_within_their_bounds(seed, low, factor):
    rng = np.random.default_rng(seed)
    for kind in (Uniform, LogUniform):
        interval = kind(low, low * factor)
        assert all(interval.low <= interval.draw(rng) <= interval.high for _ in range(20))
        assert interval.at(0) == interval.low
        assert math.isclose(interval.at(1), interval.high, rel_tol=1e-12)


@pytest.mark.parametrize(
    ("values", "median"), [(Uniform(2, 4), 3), (LogUniform(1, 100), 10), (Normal(5, 1), 5)]
)
def test_half_of_the_draws_are_below_the_median(values, median):
    rng = np.random.default_rng(0)
    below = np.mean([values.draw(rng) < median for _ in range(2000)])
    assert abs(below - 0.5) < 0.05


def test_a_choice_draws_every_value_and_no_other():
    rng = np.random.default_rng(0)
    assert {Choice(["a", 2.0, 3]).draw(rng) for _ in range(100)} == {"a", 2.0, 3.0}


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Uniform(1, 1),
        lambda: Uniform(0, math.inf),
        lambda: LogUniform(0, 1),
        lambda: LogUniform(2, 1),
        lambda: Normal(0, 0),
        lambda: Normal(math.nan, 1),
        lambda: Choice([]),
        lambda: Choice("ab"),
        lambda: Grid([1, 1.0]),
        lambda: Grid([None]),
        lambda: gain("alpha", Uniform(0, 1)),
        lambda: gain("beta", 3),
        lambda: true_parameters(Uniform(0, 1), robot=-1),
        lambda: Factor("", Uniform(0, 1), lambda e, v: e),
        lambda: Factor("f", Uniform(0, 1), None),
        lambda: Factor("f", np.random.default_rng(0), lambda e, v: e),
        lambda: Sweep(base(), []),
        lambda: Sweep(base(), [gain("beta", Uniform(0, 1))] * 2),
        lambda: Sweep(base(), [Factor("status", Uniform(0, 1), lambda e, v: e)]),
        lambda: Sweep("base", [gain("beta", Uniform(0, 1))]),
        lambda: small_sweep(samples=0),
        lambda: small_sweep(seed=-1),
        lambda: small_sweep(engine="fast"),
        lambda: small_sweep(bands={"tracking_error": 1}),
        lambda: small_sweep().values(5),
        lambda: small_sweep().values(True),
        lambda: small_sweep().run("nowhere", workers=0),
        lambda: small_sweep().run("nowhere", backend="threads"),
    ],
)
def test_a_wrong_value_is_an_input_error(wrong, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError):
        wrong()


def test_values_of_a_run_depend_on_seed_and_number_alone():
    few, many = small_sweep(samples=3), small_sweep(samples=10)
    assert [few.values(r) for r in range(3)] == [many.values(r) for r in range(3)]
    assert many.values(0) != many.values(1)
    assert many.values(0) != small_sweep(seed=4).values(0)


def test_grids_are_combined_and_sampled():
    factors = [gain("beta", Grid([1, 2])), model_error(Uniform(0, 1)), gain("K_eps", Grid([3, 4, 5]))]
    sweep = Sweep(base(), factors, samples=2)
    assert len(sweep) == 12
    values = [sweep.values(run) for run in range(12)]
    assert sorted((v["beta"], v["K_eps"]) for v in values[::2]) == [(b, k) for b in (1, 2) for k in (3, 4, 5)]
    assert len({v["model_error"] for v in values}) == 12


def test_a_sweep_may_have_more_factors_than_arrays_have_axes():
    factors = [Factor(f"factor {k}", Grid([0, 1] if k > 97 else [0]), lambda e, v: e) for k in range(100)]
    assert [*Sweep(base(), factors).values(2).values()] == [0.0] * 98 + [1.0, 0.0]


# -- factors ----------------------------------------------------------------------------------------------


def varied(factor) -> Experiment:
    return Sweep(base(), [factor]).experiment(0)


@pytest.mark.parametrize("name", ["Lambda", "beta", "K_r", "K_eps", "Gamma"])
def test_a_gain_gets_the_value_and_the_others_stay(name):
    expected = SMALL_GAINS.replace(**{name: 7.0})
    assert varied(gain(name, Grid([7]))).gains == expected
    scaled = SMALL_GAINS.replace(**{name: 7 * getattr(SMALL_GAINS, name)})
    assert varied(gain_scale(name, Grid([7]))).gains == scaled


def test_true_parameters_change_the_plant_and_not_the_estimates():
    before, after = base().cell, varied(true_parameters(Grid([1.5]), robot=1)).cell
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, 2))
    torques = [[cell.robots[i].inverse_dynamics(q, v, a) for i in (0, 1)] for cell in (before, after)]
    np.testing.assert_allclose(torques[1][0], torques[0][0])
    np.testing.assert_allclose(torques[1][1], 1.5 * torques[0][1])
    np.testing.assert_allclose(after.theta[1], 1.5 * before.theta[1])
    np.testing.assert_array_equal(after.theta_hat0, before.theta_hat0)


def test_true_parameters_of_one_body_change_linear_parameters_with_it():
    cell = Sweep(planar_four(), [true_parameters(Grid([2.0]), body=1)]).experiment(0).cell
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, 2))
    for robot, parameters in zip(cell.robots, cell.parameters, strict=True):
        torque = parameters.regressor(q, v, v, a) @ parameters.theta
        np.testing.assert_allclose(torque, robot.inverse_dynamics(q, v, a))


def test_estimates_are_scaled_or_off_by_a_model_error():
    cell = base().cell
    members = [replace(m, theta_hat0=np.arange(20.0)) for m in cell.members]
    start = base(cell=type(cell)(members, cell.coupling, cell.space))
    scaled = Sweep(start, [initial_estimates(Grid([3]), robot=0)]).experiment(0).cell.theta_hat0
    np.testing.assert_allclose(scaled, [3 * np.arange(20), np.arange(20)])
    off = Sweep(start, [model_error(Grid([0.25]))]).experiment(0).cell
    np.testing.assert_allclose(off.theta_hat0, 1.25 * cell.theta)


@pytest.mark.parametrize(("factor", "name"), [(initial_positions, "q0"), (initial_velocities, "v0")])
def test_a_start_is_moved_for_all_or_for_one_joint(factor, name):
    before = getattr(base().cell, name)
    np.testing.assert_allclose(getattr(varied(factor(Grid([0.1]))).cell, name), before + 0.1)
    one = getattr(varied(factor(Grid([0.1]), robot=1, joint=0)).cell, name)
    np.testing.assert_allclose(one - before, [[0, 0], [0.1, 0]])


def test_disturbances_are_scaled_and_moved():
    (scaled,) = varied(disturbance_scale(Grid([-2]))).disturbances
    np.testing.assert_array_equal(scaled.torque, [-2, -4])
    (moved,) = varied(disturbance_start(Grid([1.0]))).disturbances
    assert (moved.start, moved.stop) == (1.0, 1.004)


def test_weights_are_scaled_for_all_or_for_one_robot():
    times = np.array([0.0, 1.0])
    before = base().cell.coupling.weights(times, 2).c
    both = varied(weights(Grid([3]))).cell.coupling
    assert both.is_constant
    np.testing.assert_allclose(both.weights(times, 2).c, 3 * before)
    np.testing.assert_allclose(
        varied(weights(Grid([3]), robot=1)).cell.coupling.weights(times, 2).c[:, :, 0, 0], [[1, -3]] * 2
    )


def test_moving_weights_are_scaled_with_their_derivatives():
    from cells import moving_weights

    from synctrl import Coupling

    coupling = Coupling.pair(moving_weights(np.random.default_rng(1), 2, 2))
    cell = small_cell(coupling=coupling)
    scaled = Sweep(base(cell=cell), [weights(Grid([0.5]))]).experiment(0).cell.coupling
    before, after = (c.weights(np.array([0.3]), 2) for c in (coupling, scaled))
    for old, new, power in zip(before, after, (1, 1, 1, -1), strict=True):
        np.testing.assert_allclose(new, 0.5**power * old)


def test_the_control_period_belongs_to_the_run():
    sweep = Sweep(base(), [control_period(Grid([2 * DT]))], dt=DT, engine="pinocchio")
    assert sweep.simulate(0) == base().simulate(dt=DT, control_period=2 * DT)


@pytest.mark.parametrize(
    "factor",
    [
        true_parameters(Grid([2]), robot=2),
        true_parameters(Grid([2]), body=2),
        initial_positions(Grid([2]), joint=2),
        disturbance_scale(Grid([2]), disturbance=1),
        weights(Grid([2]), robot=2),
        Factor("own", Grid([2]), lambda experiment, value: None),
    ],
)
def test_what_the_experiment_does_not_have_is_an_input_error(factor):
    with pytest.raises(InputError):
        varied(factor)


def test_an_own_factor_changes_what_its_function_says():
    own = Factor("own", Grid([0.5]), lambda experiment, value: replace(experiment, duration=value))
    assert varied(own).duration == 0.5


# -- one run ----------------------------------------------------------------------------------------------


def test_every_row_can_be_made_again_alone(tmp_path):
    sweep = small_sweep()
    quiet(sweep, tmp_path, backend="serial")
    table = load(tmp_path)
    for run in range(len(sweep)):
        row = small_sweep().run_one(run)
        found = {"run": run, **table.loc[run].to_dict()}
        assert {name: found[name] for name, value in row.items() if value is not None} == {
            name: value for name, value in row.items() if value is not None
        }


def test_measures_are_what_their_definitions_say():
    sweep = small_sweep()
    row, result = sweep.run_one(2), sweep.simulate(2)
    e, epsilon = result.tracking_error, result.sync_error
    assert row["tracking_peak"] == np.abs(e).max()
    assert row["tracking_final"] == np.abs(e[-1]).max()
    mean_square = np.trapezoid(epsilon**2, result.t, axis=0) / result.t[-1]
    np.testing.assert_allclose(row["sync_rms"], np.sqrt(mean_square.mean()))
    np.testing.assert_allclose(row["sync_ise"], mean_square.sum() * result.t[-1])
    assert row["peak_torque"] == np.abs(result.tau).max()


VARIATIONS = [
    gain("beta", Grid([30])),
    true_parameters(Grid([1.3])),
    initial_positions(Grid([0.01])),
    disturbance_start(Grid([0.003])),
    weights(Grid([2])),
    control_period(Grid([2 * DT])),
]


def assert_prepared_runs_are_the_same(engine):
    prepared = Prepared(base(), 0.01, DT, engine)
    for factor in VARIATIONS:
        setup = Sweep(base(), [factor], dt=DT, engine=engine).setup(0)
        assert prepared.simulate(setup.experiment, setup.control_period) == setup.simulate(), factor.name


def test_prepared_runs_are_those_of_simulate():
    assert_prepared_runs_are_the_same("pinocchio")


def test_prepared_compiled_runs_are_those_of_simulate(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    monkeypatch.setenv("SYNCTRL_CACHE", str(tmp_path))
    assert_prepared_runs_are_the_same("compiled")


def test_a_run_that_diverges_is_a_row_with_its_cause(tmp_path):
    sweep = Sweep(base(), [gain("K_r", Grid([1, 1e6]))], duration=0.1, dt=DT, engine="pinocchio")
    quiet(sweep, tmp_path, backend="serial", keep_every=10)
    table = load(tmp_path)
    assert list(table["status"]) == ["completed", "stopped"]
    assert table.loc[0, "cause"] == ""
    assert table.loc[1, "cause"].split(":")[0] in ("NonFiniteError", "SingularJacobianError")
    assert 0 < table.loc[1, "stop_time"] < 0.1
    assert table.loc[0].notna()["sync_rms"]
    assert table.loc[1].isna()["sync_rms"]
    assert trajectories(tmp_path, 1).status.startswith("stopped")


def test_a_run_that_is_refused_is_a_row_with_its_cause(tmp_path):
    sweep = Sweep(base(), [control_period(Grid([DT, 1.5 * DT]))], dt=DT, engine="pinocchio")
    quiet(sweep, tmp_path, backend="serial")
    table = load(tmp_path)
    assert list(table["status"]) == ["completed", "refused"]
    assert "InputError: control_period" in table.loc[1, "cause"]


def test_a_base_that_stops_needs_settling_bands(tmp_path):
    def wild(**options):
        stopping = base(gains=SMALL_GAINS.replace(K_r=1e6))
        factors = [gain("K_r", Grid([1]))]
        return Sweep(stopping, factors, duration=0.1, dt=DT, engine="pinocchio", **options)

    with refused(InputError, "base"):
        quiet(wild(), tmp_path / "a", backend="serial")
    quiet(wild(bands={"tracking_error": 1e-3, "sync_error": 1e-3}), tmp_path / "b", backend="serial")
    assert load(tmp_path / "b").loc[0, "status"] == "completed"


def test_trajectories_are_kept_as_often_as_asked(tmp_path):
    sweep = small_sweep(samples=2)
    quiet(sweep, tmp_path, backend="serial", keep_every=2)
    kept, whole = trajectories(tmp_path, 1), sweep.simulate(1)
    for name in LAYOUT:
        expected = getattr(whole, name)
        np.testing.assert_array_equal(getattr(kept, name), expected[[0, 2, 4, 5]])
    quiet(sweep, tmp_path / "none", backend="serial")
    with refused(ResultError, file=str(tmp_path / "none" / "runs" / "000001.npz")):
        trajectories(tmp_path / "none", 1)


CELLS = {
    "small": base,
    "four arms": planar_four,
    "A460": a460_pair,
    "mobile robot": mobile_robot,
    "Pandas": panda_four,
}


@pytest.mark.parametrize("name", CELLS)
def test_an_experiment_that_was_sent_runs_as_before(name):
    cloudpickle = pytest.importorskip("cloudpickle", reason="pip install 'synctrl[sweep]'")
    experiment = CELLS[name]()
    sent = pickle.loads(cloudpickle.dumps(experiment))
    assert sent.simulate(0.01, DT) == experiment.simulate(0.01, DT)


# -- the same table, whoever makes it ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def serial_table(tmp_path_factory):
    return quiet(small_sweep(), tmp_path_factory.mktemp("serial"), backend="serial")


@pytest.mark.parametrize("workers", [2, 1])
def test_the_table_does_not_depend_on_the_number_of_workers(workers, serial_table, tmp_path):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    assert quiet(small_sweep(), tmp_path, workers, batch=1) == serial_table


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed", reason="pip install 'synctrl[sweep]'")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster


def test_the_table_is_the_same_from_a_dask_client(cluster, serial_table, tmp_path):
    with cluster.get_client() as client:
        assert quiet(small_sweep(), tmp_path, backend="dask", client=client, batch=1) == serial_table
        assert client.status == "running"


def test_the_table_is_the_same_from_a_dask_address(cluster, serial_table, tmp_path):
    options = {"backend": "dask", "client": cluster.scheduler_address}
    assert quiet(small_sweep(), tmp_path, **options) == serial_table


def test_a_wrong_dask_client_is_an_input_error(cluster, tmp_path):
    with refused(InputError, "client"):
        quiet(small_sweep(), tmp_path, backend="dask", client=3)


def test_a_table_is_read_by_pandas_as_it_is_loaded(serial_table, tmp_path):
    import pandas as pd

    quiet(small_sweep(), tmp_path, backend="serial")
    read = pd.read_csv(tmp_path / "table.csv", index_col="run", dtype=str)
    loaded = load(tmp_path)
    for name in loaded.columns:
        if name not in ("status", "cause"):
            np.testing.assert_array_equal(read[name].astype(float), loaded[name])
    assert loaded.attrs["measures"]["sync_rms"]["unit"] == "m"


def test_a_table_becomes_a_dataset_of_xarray(serial_table, tmp_path):
    pytest.importorskip("xarray", reason="pip install 'synctrl[sweep]'")
    quiet(small_sweep(), tmp_path, backend="serial")
    table = load(tmp_path)
    dataset = table.to_xarray()
    assert dict(dataset.sizes) == {"run": len(table)}
    np.testing.assert_array_equal(dataset["sync_rms"], table["sync_rms"])


def test_what_is_made_here_is_shown_in_a_few_lines():
    sweep = Sweep(base(), [gain("beta", Grid(np.linspace(1, 2, 1000))), model_error(Uniform(-1, 1))], dt=DT)
    job = sweep.study.job()
    for thing in (sweep, sweep.study, sweep.study.base, *sweep.study.factors, job, sweep._task(0)):
        assert len(repr(thing)) < 400
        assert repr(thing).count("\n") < 6
    assert "beta: Grid(1000 values from 1.0 to 2.0)" in repr(sweep)


# -- nothing is lost but runs in flight -------------------------------------------------------------------


def test_a_worker_that_is_killed_is_replaced(tmp_path):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    deadly = Factor("number", Grid(range(4)), partial(die_once, flag=str(tmp_path / "flag")))
    sweep = Sweep(base(), [deadly], dt=DT, engine="pinocchio")
    table = quiet(sweep, tmp_path / "a", 2, batch=1)
    assert (tmp_path / "flag").exists()
    assert table == quiet(sweep, tmp_path / "b", backend="serial")


def test_a_run_that_kills_every_worker_ends_the_sweep_and_keeps_the_others(tmp_path, monkeypatch):
    pytest.importorskip("joblib", reason="pip install 'synctrl[sweep]'")
    monkeypatch.setattr(evaluation, "RETRIES", 0)
    sweep = Sweep(base(), [Factor("number", Grid(range(3)), die)], dt=DT, engine="pinocchio")
    with refused(SweepError, "worker process"):
        quiet(sweep, tmp_path, 2)
    assert 0 in load(tmp_path).index
    assert 2 not in load(tmp_path).index


KILLED = """
from sweeps import Grid, slow_sweep
slow_sweep(0.2).run({folder!r}, backend="serial", batch=1, progress=False)
"""


def test_a_sweep_that_is_killed_goes_on_where_it_was(tmp_path):
    folder = tmp_path / "sweep"
    script = KILLED.format(folder=str(folder))
    with subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, env=ENV) as process:
        wait_for_lines(folder / "runs.jsonl", 3, process)
        process.send_signal(signal.SIGKILL)
    written = (folder / "runs.jsonl").read_bytes()
    assert 3 <= written.count(b"\n") < len(slow_sweep(0))
    resumed = quiet(slow_sweep(0), folder, backend="serial")
    assert resumed == quiet(slow_sweep(0), tmp_path / "whole", backend="serial")
    kept = written[: written.rfind(b"\n") + 1]
    assert (folder / "runs.jsonl").read_bytes().startswith(kept)


def wait_for_lines(path: Path, count: int, process: subprocess.Popen) -> None:
    """Wait until the file has as many lines."""
    while not path.exists() or path.read_bytes().count(b"\n") < count:
        assert process.poll() is None, "the sweep ended before it was killed"
        time.sleep(0.02)


FULL_DISK = """
import resource
from sweeps import begun, quiet, small_sweep
from synctrl.errors import ResultError
sweep = small_sweep()
begun(sweep, {folder!r}).close()
resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room}))
try:
    quiet(sweep, {folder!r}, backend="serial", batch=1)
except ResultError as error:
    print(error)
"""


def test_a_disk_that_is_full_is_a_clear_error_and_rows_stay_readable(tmp_path):
    folder, room = tmp_path / "sweep", 1000
    script = FULL_DISK.format(folder=str(folder), room=room)
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, env=ENV, capture_output=True, text=True)
    assert "cannot write to the sweep" in run.stdout, run.stderr
    assert (folder / "runs.jsonl").stat().st_size == room
    assert 0 < len(load(folder)) < len(small_sweep())
    whole = quiet(small_sweep(), tmp_path / "whole", backend="serial")
    assert quiet(small_sweep(), folder, backend="serial") == whole


@pytest.mark.parametrize(
    ("other", "named"),
    [
        (lambda: small_sweep(seed=4), "seed is 3 there and 4 here"),
        (lambda: small_sweep(samples=6), "samples"),
        (lambda: small_sweep(duration=0.02), "duration"),
        (lambda: Sweep(base(), [gain("beta", LogUniform(1, 50))], seed=3, dt=DT), "factors"),
        (
            lambda: small_sweep(start=base(gains=SMALL_GAINS.replace(K_r=2))),
            "base.gains.K_r is 1.0 there and 2.0 here",
        ),
        (
            lambda: small_sweep(start=base(cell=small_cell(way=0.06))),
            "base.digest.desired motion",
        ),
    ],
)
def test_a_folder_with_another_sweep_is_refused_with_the_difference(other, named, tmp_path):
    quiet(small_sweep(), tmp_path, backend="serial")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with refused(ResultError, file=str(tmp_path)) as caught:
        quiet(other(), tmp_path, backend="serial")
    assert named in caught.value.found
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


leaves = st.integers(0, 2) | st.sampled_from("ab")
plain = st.recursive(
    leaves, lambda x: st.lists(x, max_size=2) | st.dictionaries(st.sampled_from("ab"), x, max_size=2)
)


@given(plain, plain)
def test_descriptions_differ_exactly_if_a_difference_is_found(a, b):
    assert not difference(a, a)
    assert bool(difference(a, b)) == (a != b)


def test_two_processes_cannot_write_one_sweep(tmp_path):
    pytest.importorskip("fcntl", reason="this system has no locks of this kind")
    sweep = small_sweep()
    with begun(sweep, tmp_path), refused(ResultError, file=str(tmp_path)):
        quiet(sweep, tmp_path, backend="serial")
    quiet(sweep, tmp_path, backend="serial")


def test_an_incomplete_last_line_does_not_count_and_is_made_again(tmp_path):
    sweep = small_sweep()
    whole = quiet(sweep, tmp_path, backend="serial")
    path = tmp_path / "runs.jsonl"
    content = path.read_bytes()
    for cut in (1, 30, len(content.splitlines()[-1])):
        path.write_bytes(content[:-cut])
        assert len(load(tmp_path)) == len(sweep) - 1
        assert quiet(sweep, tmp_path, backend="serial") == whole
        assert path.read_bytes() == content


@pytest.mark.parametrize(
    "line", [b"", b"nonsense", b"[1, 2]", b'{"run": 1}', b"\xff\xfe", b"[" * 100_000, "same"]
)
def test_a_damaged_line_is_named_with_its_file(line, tmp_path):
    sweep = small_sweep()
    quiet(sweep, tmp_path, backend="serial")
    path = tmp_path / "runs.jsonl"
    lines = path.read_bytes().splitlines()
    lines[2] = lines[1] if line == "same" else line
    path.write_bytes(b"\n".join([*lines, b""]))
    for read in (lambda: load(tmp_path), lambda: quiet(sweep, tmp_path, backend="serial")):
        with refused(SweepFileError, file=str(path), line=3):
            read()


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": "other"}', '{"format": "synctrl sweep 1"}'])
def test_a_damaged_description_is_named_with_its_file(content, tmp_path):
    quiet(small_sweep(), tmp_path, backend="serial")
    (tmp_path / "sweep.json").write_text(content)
    with refused(ResultError, file=str(tmp_path / "sweep.json")):
        load(tmp_path)


def test_a_folder_without_a_sweep_is_named(tmp_path):
    with refused(ResultError, file=str(tmp_path)):
        load(tmp_path)


def test_a_function_of_the_user_that_fails_is_named_with_its_run(tmp_path):
    sweep = Sweep(base(), [Factor("own", Grid([1, 0]), lambda e, v: 1 / v and e)], dt=DT, engine="pinocchio")
    with refused(SweepError, "run 1"):
        quiet(sweep, tmp_path, backend="serial")
    assert list(load(tmp_path).index) == [0]


def test_what_cannot_be_sent_is_said(tmp_path):
    pytest.importorskip("cloudpickle", reason="pip install 'synctrl[sweep]'")
    own = Factor("own", Grid([1, 2]), partial(lambda experiment, value, lock: experiment, lock=Lock()))
    with refused(InputError, "sweep"):
        quiet(Sweep(base(), [own], dt=DT, engine="pinocchio"), tmp_path)


def test_the_description_is_plain_json(tmp_path):
    quiet(small_sweep(), tmp_path, backend="serial")
    about = json.loads((tmp_path / "sweep.json").read_text())
    assert [factor["name"] for factor in about["factors"]] == ["beta", "model_error"]
    assert about["columns"][:3] == ["run", "beta", "model_error"]
