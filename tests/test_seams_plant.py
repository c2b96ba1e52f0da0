"""A plant of one's own, with a state of its own: run, logged, certified, saved and swept as the package's."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from refusals import refused
from seams.lagging_motors import LaggingMotors, T

from synctrl import Experiment, Result
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.errors import InputError, SimulationError
from synctrl.experiments import planar_four
from synctrl.simulation.plant import Plant
from synctrl.sweep import Grid, Sweep, gain, load

WAYS = {
    "continuous": {},
    "sampled": {"control_period": 4e-3},
    "adaptive": {"integrator": "RK45", "rtol": 1e-10, "atol": 1e-12},
}


def lagging(kind: type = LaggingMotors, **options) -> Experiment:
    return replace(planar_four(**options), plant_type=kind)


@pytest.fixture(scope="module")
def runs():
    """Runs with motors that lag, each computed once."""
    made = {name: lagging().simulate(0.2, dt=5e-4, **options) for name, options in WAYS.items()}
    return made.__getitem__


@pytest.mark.parametrize("name", WAYS)
def test_the_torque_of_the_motors_is_logged_as_the_state_and_by_its_own_name(runs, name):
    run = runs(name)
    motors = run.outputs["motor_torque"]
    assert motors.shape == run.tau.shape
    assert run.unit("motor_torque") == "N·m"
    assert run.info["outputs"]["motor_torque"]["axes"] == ["time", "robot", "joint"]
    np.testing.assert_array_equal(run.outputs["plant_state"].reshape(motors.shape), motors)
    assert (motors[0] == 0).all() and np.abs(motors[-1]).max() > 1e-2


@pytest.mark.parametrize("name", WAYS)
def test_the_motors_follow_the_torque_that_was_asked_with_their_lag(runs, name):
    run = runs(name)
    h, motors = 5e-4, run.outputs["motor_torque"]
    if name == "sampled":  # the torque of an instant acts until the next one
        expected = run.tau[:-1] + (motors[:-1] - run.tau[:-1]) * np.exp(-h / T)
        np.testing.assert_allclose(motors[1:], expected, rtol=1e-3, atol=1e-4 * np.abs(motors).max())
        return
    rate = (motors[2:] - motors[:-2]) / (2 * h)
    rest = np.abs(T * rate - (run.tau - motors)[1:-1])[40:]  # after the motors have been switched on
    assert rest.max() < 1e-3 * np.abs(run.tau).max()


@pytest.mark.parametrize("name", WAYS)
def test_the_torque_of_the_motors_is_what_moves_the_robots(runs, name):
    run, k = runs(name), 100
    robots, motors = planar_four().cell.robots, run.outputs["motor_torque"]
    rate = (run.v[k + 1] - run.v[k - 1]) / (run.t[k + 1] - run.t[k - 1])
    for i, robot in enumerate(robots):
        expected = robot.forward_dynamics(run.q[k, i], run.v[k, i], motors[k, i])
        np.testing.assert_allclose(rate[i], expected, atol=2e-2 * np.abs(rate).max())


def test_a_plant_that_lags_is_certified_to_be_bounded_and_outside_the_theorem_by_name(runs):
    certificate = certify(runs("continuous"))
    assert certificate.verdict == "bounded by Theorem A"
    assert certificate.closes
    (found,) = certificate.outside
    assert "forces that the model does not contain" in found and "LaggingMotors" in found
    assert not certificate.doubts


def test_the_power_outside_the_theorem_is_that_of_the_torque_that_the_motors_owe(runs):
    run = runs("continuous")
    owed = run.tau - run.outputs["motor_torque"]
    record = lyapunov(run)
    np.testing.assert_allclose(
        record.power["other"], (run.v_error * owed).sum(axis=(1, 2)), atol=1e2 * record.rounding.max()
    )


def test_without_the_state_in_the_log_nothing_is_certified(runs):
    run = runs("continuous")
    outputs = {name: array for name, array in run.outputs.items() if name != "plant_state"}
    info = {**run.info, "outputs": {name: run.info["outputs"][name] for name in outputs}}
    with refused(InputError, "experiment", found="plant_state"):
        certify(replace(run, outputs=outputs, info=info))


def test_the_state_survives_the_file(runs, tmp_path):
    run = runs("continuous")
    loaded = Result.load(run.save(tmp_path / "run.npz"))
    assert loaded == run
    assert certify(loaded, lagging()).as_dict() == certify(run).as_dict()


def test_the_step_with_a_state_is_of_fourth_order():
    ends = [lagging().simulate(0.04, dt=dt) for dt in (1e-3, 5e-4, 2.5e-4)]
    gaps = [
        np.abs(a.outputs["plant_state"][-1] - b.outputs["plant_state"][-1]).max() for a, b in pairwise(ends)
    ]
    assert 12 < gaps[0] / gaps[1] < 22


def test_a_sweep_takes_a_plant_of_ones_own(tmp_path):
    study = Sweep(lagging(), [gain("beta", Grid([1.0, 5.0]))], duration=0.05, engine="pinocchio")
    study.run(tmp_path, backend="serial", progress=False)
    table = load(tmp_path)
    for beta, peak in zip(table["beta"], table["tracking_peak"], strict=True):
        experiment = lagging()
        alone = replace(experiment, gains=experiment.gains.replace(beta=beta)).simulate(0.05)
        assert peak == np.abs(alone.tracking_error).max()


def test_the_compiled_engine_refuses_a_plant_of_ones_own_by_name():
    with refused(InputError, "plant", found="seams.lagging_motors.LaggingMotors"):
        lagging().simulate(0.01, engine="compiled")


class Reporting(LaggingMotors):
    """Motors that say how much torque they gave at most."""

    def report(self, hidden):
        return {"largest_motor_torque": float(np.abs(hidden).max(initial=0.0))}


def test_a_plant_may_say_in_the_result_what_became_of_its_state():
    run = lagging(Reporting).simulate(0.05)
    assert run.info["largest_motor_torque"] == np.abs(run.outputs["motor_torque"]).max() > 0


class Wrong(LaggingMotors):
    """Motors whose state has another size than its rate."""

    def move(self, q, v, tau, hidden):
        v_dot, rate = super().move(q, v, tau, hidden)
        return v_dot, rate[:-1]


def test_a_rate_of_another_size_than_the_state_is_refused_before_the_run():
    with refused(InputError, "plant Wrong", found=(7,)):
        lagging(Wrong).simulate(0.01)


@pytest.mark.parametrize(
    ("made", "found"),
    [(lambda a, b: a, "ndarray"), (lambda a, b: None, "NoneType"), (lambda a, b: (a, b, b), 3)],
    ids=["one array", "nothing", "three"],
)
def test_a_plant_that_gives_no_pair_of_rates_is_refused_before_the_run(made, found):
    def move(self, *given):
        return made(*LaggingMotors.move(self, *given))

    with refused(InputError, "plant Made", found=found):
        lagging(type("Made", (LaggingMotors,), {"move": move})).simulate(0.01)


class Listing(LaggingMotors):
    """Motors that list how fast their state changes."""

    def move(self, q, v, tau, hidden):
        v_dot, rate = super().move(q, v, tau, hidden)
        return v_dot, rate.tolist()


def test_a_rate_may_be_a_list_of_numbers():
    np.testing.assert_array_equal(lagging(Listing).simulate(0.01).q, lagging().simulate(0.01).q)


@pytest.mark.parametrize("start", [[0.0] * 8, None, 1.0, np.zeros((2, 4)), np.full(8, np.nan)], ids=repr)
def test_a_state_that_is_no_row_of_finite_numbers_is_refused_by_name(start):
    with refused(InputError, "plant Started, hidden0"):
        lagging(type("Started", (LaggingMotors,), {"hidden0": start}))


class Failing(LaggingMotors):
    """Motors that break."""

    def move(self, q, v, tau, hidden):
        raise ZeroDivisionError("broken")


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS)
def test_a_plant_that_fails_ends_the_run_which_hands_over_what_it_has(options):
    with refused(SimulationError) as stop:
        lagging(Failing).simulate(0.01, **options)
    assert stop.value.subject.startswith("'Failing.move' (")
    assert stop.value.result.status.startswith("stopped")


def over(time, *axes):
    return np.zeros((len(time), *(2 for _ in axes))), "N", ("time", *axes)


@pytest.mark.parametrize(
    ("method", "account", "part", "found"),
    [
        ("outputs", lambda hidden: None, "outputs", None),
        ("outputs", lambda hidden: {"heat": 3}, "outputs, heat", None),
        ("outputs", lambda hidden: {"heat": over(hidden[1:])}, "outputs, heat", None),
        ("outputs", lambda hidden: {"heat": (*over(hidden)[:2], ("robot",))}, "outputs, heat", None),
        ("outputs", lambda hidden: {"heat": over(hidden, "robot")}, "outputs, heat", None),
        ("outputs", lambda hidden: {"plant_state": over(hidden)}, "outputs", "plant_state"),
        ("outputs", lambda hidden: {"tau": over(hidden)}, "outputs", "tau"),
        ("report", lambda hidden: None, "report", None),
        ("report", lambda hidden: {"gains": 2}, "report", "gains"),
        ("report", lambda hidden: {"dt": 2}, "report", "dt"),
    ],
)
def test_a_plant_that_says_nothing_sensible_of_itself_loses_no_row(method, account, part, found):
    kind = type("Talking", (LaggingMotors,), {method: lambda self, hidden: account(hidden)})
    with refused(InputError, f"plant Talking, {part}", found=found) as stop:
        lagging(kind).simulate(0.01)
    assert_whole(stop.value)


@pytest.mark.parametrize("method", ["outputs", "report"])
def test_a_plant_that_fails_to_say_something_of_itself_loses_no_row(method):
    kind = type("Talking", (LaggingMotors,), {method: lambda self, hidden: 1 / 0})
    with refused(SimulationError) as stop:
        lagging(kind).simulate(0.01)
    assert isinstance(stop.value.__cause__, ZeroDivisionError)
    assert_whole(stop.value)


def assert_whole(error):
    """An error has all rows that the run would have had."""
    whole = lagging().simulate(0.01)
    np.testing.assert_array_equal(error.result.q, whole.q)
    np.testing.assert_array_equal(error.result.outputs["plant_state"], whole.outputs["plant_state"])


def test_a_run_that_stops_gives_its_own_reason_even_if_the_plant_fails_to_say_what_became_of_it():
    kind = type("Twice", (Failing,), {"outputs": lambda self, hidden: 1 / 0})
    with refused(SimulationError) as stop:
        lagging(kind).simulate(0.01)
    assert stop.value.subject.startswith("'Failing.move' (")


def test_a_plant_without_a_state_of_its_own_adds_nothing_to_the_log():
    run = planar_four().simulate(0.01)
    assert "plant_state" not in run.outputs


class Counting(Plant):
    """A plant that only remembers a number."""

    hidden0 = np.array([3.0])


def test_a_state_that_nothing_moves_stays_as_it_is():
    run = lagging(Counting).simulate(0.01)
    assert (run.outputs["plant_state"] == 3.0).all()
    np.testing.assert_array_equal(run.q, planar_four().simulate(0.01).q)
