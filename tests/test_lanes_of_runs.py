"""Runs in lanes: each has the bits that it has alone, of its measures and of how it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from refusals import refused
from side_by_side import WIDTHS, Outcome, in_lanes
from test_lanes import arms, cache, cut, damped, learning, loaded, moving, rubbing

from synctrl import Cell, Experiment, Gains, Hold
from synctrl.analysis.metrics import error_metrics
from synctrl.compiled.batch import Batch, Measured
from synctrl.compiled.stepper import found_check
from synctrl.control.adaptation import Natural
from synctrl.errors import InputError, NonFiniteError, SingularJacobianError
from synctrl.experiments import planar_four

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

__all__ = ["cache"]  # the same code in the same cache
BANDS = {"tracking_error": 1e-3, "sync_error": 5e-4}
#: runs in a test: no multiple of a number of lanes above 1
COUNT = 5
GAINS = "Lambda", "beta", "K_eps", "K_r", "Gamma"


class Told(NamedTuple):
    """A run to be made many times.

    Attributes:
        experiment: the planned one.
        options: how it is planned.
        columns: what differs from it, (COUNT, ...) each.
    """

    experiment: Experiment
    options: dict
    columns: dict[str, np.ndarray]

    def batch(self, width: int) -> Batch:
        """What makes them in so many lanes."""
        duration, period, log_dt = (self.options.get(x) for x in ("duration", "control_period", "log_dt"))
        return Batch(self.experiment.plan(duration, 1e-3, period, log_dt=log_dt), BANDS, width=width)

    def some(self, k: slice) -> tuple[dict[str, np.ndarray], int]:
        """Columns of some of them, and how many these are."""
        return {name: array[k] for name, array in self.columns.items()}, len(range(COUNT)[k])

    def experiment_of(self, k: int) -> Experiment:
        """The experiment of one of them, which has its own gains, q, v or z."""
        cell, own = self.experiment.cell, {name: column[k] for name, column in self.columns.items()}
        gains = {name: array[0] if len(array) == 1 else array for name, array in own.items() if name in GAINS}
        starts = {"q": cell.q0, "v": cell.v0, "z": cell.theta_hat0, **own}
        members = [
            replace(member, q0=q, v0=v, theta_hat0=z)
            for member, q, v, z in zip(cell.members, *(starts[name] for name in "qvz"), strict=True)
        ]
        changed = Cell(members, cell.coupling, cell.space)
        return replace(self.experiment, cell=changed, gains=self.experiment.gains.replace(**gains))


def told(make: Callable[[], Experiment], *names: str, **options) -> Told:
    """Runs with other numbers of these names, which the planned run has the first of."""
    experiment, rng = make(), np.random.default_rng(5)
    loop, run = experiment.closed_loop(), experiment.plan(0.01, 1e-3)
    controller = loop.controller
    planned = {
        "q": loop.cell.q0,
        "v": loop.cell.v0,
        "z": controller.adaptation.start(),
        "disturbance": run.schedule.torques,
        "pi": np.array(
            [[robot.inertial_parameters for robot in robots] for robots in loop.plant.schedule.robots]
        ),
        "limits": loop.plant.torque_limits,
        "Gamma": getattr(controller.adaptation, "Gamma", None),
        **{name: np.atleast_2d(getattr(controller, name)) for name in ("Lambda", "beta", "K_eps", "K_r")},
    }
    columns = {}
    for name in names:
        column = np.repeat(planned[name][None], COUNT, axis=0)
        column[1:] *= rng.uniform(0.9, 1.1, (COUNT - 1, *(1,) * planned[name].ndim))
        columns[name] = column
    if "v" in names:
        columns["v"][1:] += rng.uniform(-3, 3, columns["v"][1:].shape)
    return Told(experiment, {"duration": 0.012, **options}, columns)


RUNS: dict[str, Callable[[], Told]] = {
    "gains": partial(told, partial(arms, 3), "Lambda", "beta", "K_eps", "K_r", "Gamma"),
    "starts": partial(told, partial(arms, 3), "q", "v", "z"),
    "starts, sampled": partial(told, partial(arms, 3), "q", "v", "z", control_period=3e-3),
    "loads and pushes": partial(told, loaded, "pi", "disturbance"),
    "loads and pushes, sampled": partial(told, loaded, "pi", "disturbance", control_period=2e-3, log_dt=4e-3),
    "nothing": partial(told, loaded),
    "friction": partial(told, partial(rubbing, False), "v", "Gamma"),
    "saturation": partial(told, cut, "limits", "q"),
    "damped": partial(told, damped, "q", "K_eps"),
    "moving weights": partial(told, lambda: arms(5, moving()), "q", "K_r"),
    "leaps": partial(told, partial(learning, lambda _: Natural(0.1), 3), "q", "beta", control_period=2e-3),
    "a log that is thinned": partial(told, partial(arms, 2), "q", log_dt=4e-3),
}

#: those of which the code takes long to compile
LONG = "leaps", "saturation"


def numbers(measured: Measured) -> dict[str, np.ndarray]:
    """Everything that was measured, by name, runs first."""
    found = measured._asdict()
    count = found.pop("instants")
    errors = {name: found.pop(name)._asdict() for name in ("tracking_error", "sync_error")}
    parts = {f"{name} {part}": array for name, each in errors.items() for part, array in each.items()}
    return {**found, **parts, "instants": np.full(len(measured.status), count)}


def bits(measured: Measured, rows: slice = slice(None)) -> dict[str, bytes]:
    """What was measured of some runs, bit for bit; NaN is NaN."""
    found = {name: array[rows] for name, array in numbers(measured).items()}
    return {name: np.where(np.isnan(array), np.nan, array).tobytes() for name, array in found.items()}


@pytest.mark.parametrize("name", RUNS)
def test_a_run_has_the_bits_that_it_has_alone_whoever_is_beside_it(name):
    those = RUNS[name]()
    single = those.batch(1)
    alone = [bits(single.measure(*those.some(slice(k, k + 1)))) for k in range(COUNT)]
    assert len({each["tracking_error ise"] for each in alone}) == (COUNT if those.columns else 1)
    for width in WIDTHS if name not in LONG else WIDTHS[::3]:
        found = those.batch(width).measure(those.columns, COUNT)
        assert not found.status.any()
        for k, expected in enumerate(alone):
            assert bits(found, slice(k, k + 1)) == expected, (width, k)


def measures_of(run: Outcome) -> dict[str, np.ndarray]:
    """The measures of a logged run, by the names of `numbers`."""
    found = {}
    for kind, band in BANDS.items():
        metrics = error_metrics(run.arrays["t"], run.arrays[kind], band)
        parts = "peak", "ise", "settling_time", "final"
        found |= {f"{kind} {part}": getattr(metrics, part) for part in parts}
    return {**found, "peak_torque": np.abs(run.arrays["tau"]).max(axis=0)}


@pytest.mark.parametrize("k", [1, 4])
@pytest.mark.parametrize("name", ["gains", "starts", "starts, sampled"])
def test_a_column_is_what_an_experiment_of_its_own_would_have(name, k):
    those = RUNS[name]()
    logged = in_lanes(those.experiment_of(k), 4, **those.options)
    found = numbers(those.batch(4).measure(those.columns, COUNT))
    for part, expected in measures_of(logged).items():
        np.testing.assert_array_equal(found[part][k], expected, err_msg=part)
    error, speed, time = found["step_error"][k]
    assert (error / speed, time) == (logged.info["step_error"]["estimate"], logged.info["step_error"]["time"])


@pytest.mark.parametrize("width", [1, 4])
@pytest.mark.parametrize("name", RUNS)
def test_measures_are_those_of_the_log_of_the_run_with_its_robots_in_lanes(name, width):
    """One source, in which lanes are runs here and robots there."""
    those = RUNS[name]()
    logged = in_lanes(those.experiment, width, **those.options)
    found = numbers(those.batch(4).measure(*those.some(slice(2))))
    for part, expected in measures_of(logged).items():
        np.testing.assert_array_equal(found[part][0], expected, err_msg=part)
    at, told = found["step_error"][0], logged.info["step_error"]
    assert at[2] == told["time"] and found["joint"][0] == told["robot"] * 2 + told["joint"]
    assert found["instants"][0] == len(logged.arrays["t"])


def test_torque_that_is_cut_off_is_counted_at_logged_instants():
    those = RUNS["saturation"]()
    logged = in_lanes(those.experiment, 1, **those.options)
    beyond = np.abs(logged.arrays["tau"]) > those.experiment.closed_loop().plant.torque_limits
    np.testing.assert_array_equal(those.batch(4).measure(*those.some(slice(3))).cut[0], beyond.sum(axis=0))
    assert 0 < beyond.sum() < beyond.size


# -- runs that end early ----------------------------------------------------------------------------------


def ending(wild: set[int]) -> Told:
    """Runs some of which diverge, at instants of their own."""
    those = told(partial(arms, 3), "Gamma", "q", duration=0.02)
    for k in wild:
        those.columns["Gamma"][k, k % 3] = 10.0 ** (6 + k / 2)
    return those


@pytest.mark.parametrize("width", WIDTHS[1:])
@pytest.mark.parametrize("wild", [{0}, {4}, {1, 2}, {0, 1, 2, 3, 4}], ids=str)
def test_a_run_that_diverges_ends_as_alone_and_leaves_the_others_alone(wild, width):
    those = ending(wild)
    found = those.batch(width).measure(those.columns, COUNT)
    assert set(np.flatnonzero(found.status)) == wild
    single = those.batch(1)
    for k in range(COUNT):
        alone = single.measure(*those.some(slice(k, k + 1)))
        expected, seen = bits(alone), bits(found, slice(k, k + 1))
        if k in wild:  # how many instants were looked at is said of runs that come to their end
            expected.pop("instants"), seen.pop("instants")
        assert seen == expected, k
    for kind in ("tracking_error", "sync_error"):
        for part in getattr(found, kind):
            np.testing.assert_array_equal(np.isnan(part).all(axis=(1, 2)), found.status != 0)


def crossing(_: set[int]) -> Told:
    """Runs in which some arms are at a singular configuration soon, at one and at several robots."""
    those = told(
        partial(arms, 3, motion=Hold, gains=Gains(1e-3, 1e-3, 1e-2, 1e-3, 1e-6)), "q", "v", duration=0.02
    )
    for k, robot in ((0, 2), (2, 1), (2, 0), (4, 1)):
        those.columns["q"][k, robot, 1], those.columns["v"][k, robot, 1] = 0.01 * (k + 1), -4.0
    return those


@pytest.mark.parametrize(
    ("make", "kind"), [(ending, NonFiniteError), (crossing, SingularJacobianError)], ids=["wild", "singular"]
)
def test_a_run_ends_as_the_engine_ends_it_with_its_robots_in_lanes(make, kind):
    """The same instant, the same robot, the same number that was too large."""
    those = make({0, 2, 4})
    found, loop = those.batch(4).measure(those.columns, COUNT), those.experiment.closed_loop()
    for k in (0, 2, 4):
        error = in_lanes(those.experiment_of(k), 8, duration=0.02).error
        assert error is not None and error[0] is kind
        assert found.stop_time[k] == error[2]
        if kind is SingularJacobianError:  # of what runs away the joint that ran is named
            assert found.robot[k] == error[3]
            assert (found_check(loop, int(found.status[k])), found.value[k]) in {
                ("condition", error[-1]),
                ("side", 0.0),
            }


@pytest.mark.parametrize("name", ["leaps", "loads and pushes, sampled"])
def test_nothing_of_runs_is_left_when_the_next_ones_begin(name):
    those = RUNS[name]()
    batch, none = those.batch(2), ({}, COUNT)
    first, other, again = (
        batch.measure(*what) for what in (those.some(slice(COUNT)), none, those.some(slice(COUNT)))
    )
    assert bits(first) == bits(again) != bits(other)
    for k in range(COUNT):
        assert bits(those.batch(1).measure(*those.some(slice(k, k + 1)))) == bits(first, slice(k, k + 1))


@pytest.mark.parametrize("width", WIDTHS[:2])
def test_what_runs_have_of_their_own_leaves_the_planned_run_alone(width):
    those = RUNS["gains"]()
    run = those.experiment.plan(0.005, 1e-3)
    batch, controller = Batch(run, BANDS, width=width), run.loop.controller
    planned = {name: getattr(controller, name).copy() for name in ("Lambda", "beta", "K_eps", "K_r")}
    before = batch.measure({}, 1)
    batch.measure(those.columns, COUNT)
    assert bits(batch.measure({}, 1)) == bits(before)
    for name, expected in planned.items():
        np.testing.assert_array_equal(getattr(controller, name), expected)


def test_what_runs_have_no_column_for_is_refused():
    batch = Batch(arms(2).plan(0.01, 1e-3), BANDS, width=1)
    for name in ("tau", "nonsense", "desired"):
        with pytest.raises(InputError):
            batch.measure({name: np.zeros((1, 2, 2))}, 1)


# -- what is refused --------------------------------------------------------------------------------------


def test_no_run_and_columns_that_code_would_not_read_are_refused_by_name():
    batch = Batch(planar_four().plan(0.01, 1e-3), {"tracking_error": 0.01, "sync_error": 0.01})
    with refused(InputError, "count", found=0):
        batch.measure({}, 0)
    for name in ("base", "true_base", "viscous", "coulomb", "smoothing", "tau"):
        with refused(InputError, "columns", found=name):
            batch.measure({name: np.zeros((1, 1))}, 1)


def test_own_measures_have_the_same_bits_in_any_number_of_lanes():
    own = [lambda at: np.sum(at.v * at.v), lambda at: np.sum(at.tau * at.v), lambda at: at.x[0, 0]]
    bands, Lambda = {"tracking_error": 0.01, "sync_error": 0.01}, np.linspace(5.0, 9.0, 5)
    columns = {"Lambda": np.repeat(Lambda[:, None, None], 2, axis=2)}
    found = [
        Batch(planar_four().plan(0.05, 1e-3), bands, {}, width, own).measure(columns, 5).own
        for width in (1, 2, 4, 8)
    ]
    assert found[0].shape == (5, 3, 3)
    assert len(np.unique(found[0][:, 0, 1])) == 5
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


@pytest.mark.parametrize(
    "value", [lambda at: 1.0 if at.v[0, 0] > 0 else 0.0, lambda at: at.v, lambda at: at.speed]
)
def test_own_measures_that_cannot_be_traced_are_refused_by_number(value):
    bands = {"tracking_error": 0.01, "sync_error": 0.01}
    with refused(InputError, "own measure 1"):
        Batch(planar_four().plan(0.01, 1e-3), bands, own=[lambda at: at.x[0, 0], value])
