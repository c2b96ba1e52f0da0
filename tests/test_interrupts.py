"""Whatever ends a run that has begun hands over what was computed, bit for bit that of the run without it."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import (
    CartesianSpace,
    Cell,
    Controller,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Gains,
    Hold,
    Member,
    load_robot,
)
from synctrl.compiled import stepper, tables
from synctrl.errors import CouplingError, NonFiniteError, RunInterrupted, SimulationError, TrajectoryError
from synctrl.simulation import advance
from synctrl.simulation import engines as runs
from synctrl.simulation.advance import up_to_a_failure
from synctrl.simulation.closed_loop import ClosedLoop
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import LAYOUT

ARM = load_robot("planar2r")
GAINS = Gains(Lambda=4.0, beta=4.0, K_r=1.0, K_eps=2.0, Gamma=0.2)
ENGINES = ["pinocchio", "compiled"]
#: in the middle of step 20 of a millisecond, and nowhere else
FAULT = 0.0205


class Strike(Exception):
    """What no part of the toolkit raises."""


class Faulty:
    """A desired motion that does something else at one instant.

    Args:
        act: what it does then.
        always: whether it does so from then on, when asked for one instant, as solvers do.
    """

    dimension, breaks = 2, ()

    def __init__(self, act, always=False):
        self.path, self.act, self.always = Cubic([0.3, 1.0], [0.6, 0.7], 1.0), act, always

    def __call__(self, t):
        t = np.asarray(t, dtype=float)
        later = (t > FAULT - 1e-4) & (t.size == 1)
        struck = later if self.always else np.abs(t - FAULT) < 1e-4
        return self.act(self.path(t), struck) if struck.any() else self.path(t)


def raising(error):
    def act(motion, struck):
        raise error

    return act


def undefined(motion, struck):
    return motion._replace(x_dot=np.where(struck[..., None], np.nan, motion.x_dot))


def untouched(motion, struck):
    return motion


def experiment(act=untouched, coupling=None, always=False, **options) -> Experiment:
    """Two arms in joint space, the second of them with a motion that may fail."""
    members = [Member(ARM, Cubic([0.3, 1.0], [0.5, 0.8], 1.0)), Member(ARM, Faulty(act, always))]
    return Experiment(Cell(members, coupling or Coupling.pair()), GAINS, 0.1, **options)


def assert_begins(kept, whole, rows):
    """The first rows of a run, bit for bit."""
    assert len(kept.t) == rows
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(kept, name), getattr(whole, name)[:rows], err_msg=name)


@pytest.fixture(scope="module")
def whole():
    """The run that nothing ends, by engine and period: `whole(engine, control_period)`."""
    known = {}

    def run(engine, control_period=None):
        key = engine, control_period
        if key not in known:
            known[key] = experiment().simulate(engine=engine, control_period=control_period)
        return known[key]

    return run


# -- functions of the user's ------------------------------------------------------------------------------


@pytest.mark.parametrize("control_period", [None, 4e-3])
@pytest.mark.parametrize("engine", ENGINES)
def test_an_exception_in_a_desired_motion_keeps_all_steps_before_it(engine, control_period, whole):
    cause = Strike("on strike")
    with refused(SimulationError, "the desired motion of robot 2", robot=1) as stop:
        experiment(raising(cause)).simulate(engine=engine, control_period=control_period)
    assert stop.value.__cause__ is cause
    assert (stop.value.robot, stop.value.time) == (1, pytest.approx(FAULT))
    assert stop.value.result.status == f"stopped: {stop.value}"
    assert_begins(stop.value.result, whole(engine, control_period), 20)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_error_of_our_own_in_a_desired_motion_stays_what_it_is(engine, whole):
    cause = TrajectoryError("no more")
    with pytest.raises(TrajectoryError) as stop:
        experiment(raising(cause)).simulate(engine=engine)
    assert stop.value is cause
    assert_begins(cause.result, whole(engine), 20)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_desired_motion_that_is_no_number_is_named(engine, whole):
    with refused(NonFiniteError, cause="motion") as stop:
        experiment(undefined).simulate(engine=engine)
    assert (stop.value.robot, stop.value.time) == (1, pytest.approx(FAULT))
    assert_begins(stop.value.result, whole(engine), 20)


def weights(act):
    """Weights that are 1, and fail in step 20."""

    def at(t):
        still = np.zeros(2)
        return act(np.ones(2)) if abs(t - FAULT) < 1e-4 else (np.ones(2), still, still)

    return Coupling.pair(c=at)


def strike(c):
    raise Strike("weightless")


@pytest.mark.parametrize(
    ("act", "kind", "subject", "found"),
    [
        (strike, SimulationError, "the weights of the coupling", "Strike"),
        (lambda c: (np.nan * c, c, c), CouplingError, "c", pytest.approx(np.nan, nan_ok=True)),
        (lambda c: (0 * c, 0 * c, 0 * c), CouplingError, "c", ((0.0, 0.0), (0.0, 0.0))),
    ],
)
@pytest.mark.parametrize("engine", ENGINES)
def test_weights_that_fail_on_the_way_keep_all_steps_before(engine, act, kind, subject, found):
    good = experiment(coupling=weights(lambda c: (c, 0 * c, 0 * c))).simulate(engine=engine)
    with refused(kind, subject, found=found, time=pytest.approx(FAULT)) as stop:
        experiment(coupling=weights(act)).simulate(engine=engine)
    assert_begins(stop.value.result, good, 20)


WAYS = {"pinocchio": {}, "compiled": {"engine": "compiled"}, "RK45": {"integrator": "RK45"}}


class Ceasing:
    """A desired position that fails from some instant on, and stays so."""

    dimension, breaks = 2, ()

    def __init__(self, place, error):
        self.hold, self.error = Hold(place), error

    def __call__(self, t):
        if (np.asarray(t) > FAULT).any():
            raise self.error
        return self.hold(t)


def ceasing_motion(error):
    """Two arms in Cartesian space; the desired motion of the second one fails for good."""
    q = [0.3, 1.0]
    place = ARM.tip_position(q)[:2]
    members = [Member(ARM, Hold(place), q), Member(ARM, Ceasing(place, error), q)]
    return Experiment(Cell(members, Coupling.pair(), CartesianSpace("xy")), GAINS, 0.1)


def ceasing_weights(error):
    """Two arms whose weights fail for good."""

    def at(t):
        if t > FAULT:
            raise error
        return np.ones(2), np.zeros(2), np.zeros(2)

    return experiment(coupling=Coupling.pair(c=at))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("make", "subject"),
    [(ceasing_motion, "the desired motion of robot 2"), (ceasing_weights, "the weights of the coupling")],
)
def test_a_function_that_fails_for_good_loses_nothing_that_came_before(make, subject, way):
    cause = ZeroDivisionError("no more")
    with refused(SimulationError, subject) as stop:
        make(cause).simulate(**WAYS[way])
    assert stop.value.__cause__ is cause
    kept = stop.value.result
    assert kept.status == f"stopped: {stop.value}"
    if way == "RK45":  # its steps are its own: what it had logged before the one that met the fault
        assert len(kept.t) >= 1 and (kept.t < FAULT + 1e-9).all()
    else:
        assert len(kept.t) == 20 and stop.value.time == pytest.approx(0.021)


class Law(Controller):
    """A law that fails in its so-many-th evaluation."""

    calls = 0

    def evaluate(self, *arguments):
        self.calls += 1
        signals = super().evaluate(*arguments)
        return self.fail(signals) if self.calls == 4 * 20 + 2 else signals  # in the second stage of step 20


class Striking(Law):
    def fail(self, signals):
        raise Strike("no torque today")


class Interrupted(Law):
    def fail(self, signals):
        raise KeyboardInterrupt


class Undefined(Law):
    def fail(self, signals):
        return replace(signals, tau=signals.tau * [[1.0, 1.0], [1.0, np.nan]])


def under(law: type[Law]) -> Experiment:
    """The experiment under another law."""

    class Own(Experiment):
        def closed_loop(self, plant="pinocchio"):
            return ClosedLoop(law(self.cell, self.gains), Plant(self.cell))

    base = experiment()
    return Own(base.cell, base.gains, base.duration)


def test_an_exception_in_a_law_names_its_function_and_keeps_all_steps(whole):
    with refused(SimulationError) as stop:
        under(Striking).simulate()
    assert "'Striking.fail' (" in stop.value.subject
    assert isinstance(stop.value.__cause__, Strike)
    assert stop.value.time == pytest.approx(0.02)
    assert_begins(stop.value.result, whole("pinocchio"), 21)


def test_a_law_that_gives_no_number_is_named_and_not_its_gains(whole):
    with refused(NonFiniteError, cause="part") as stop:
        under(Undefined).simulate()
    assert stop.value.robot == 1 and stop.value.time == pytest.approx(0.02)
    assert_begins(stop.value.result, whole("pinocchio"), 21)


@pytest.mark.parametrize("method", ["DOP853", "Radau"])
def test_solvers_take_no_exception_of_a_law_for_their_own(method):
    class Picky(Law):
        def fail(self, signals):
            raise ValueError("not with me")

    with refused(SimulationError) as stop:
        under(Picky).simulate(integrator=method)
    assert "Picky.fail'" in stop.value.subject
    assert isinstance(stop.value.__cause__, ValueError)
    assert len(stop.value.result.t) >= 1


class Stuck(Plant):
    """A plant that fails as soon as something moves."""

    def move(self, q, v, tau, hidden):
        if np.abs(v).max() > 0.01:
            raise ZeroDivisionError("stuck")
        return super().move(q, v, tau, hidden)


def test_an_exception_in_a_plant_names_its_function():
    with refused(SimulationError) as stop:
        experiment(plant_type=Stuck).simulate()
    assert "'Stuck.move'" in stop.value.subject and isinstance(stop.value.__cause__, ZeroDivisionError)
    assert np.abs(stop.value.result.v).max() <= 0.01 < 0.011
    assert len(stop.value.result.t) > 1


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("error", [Strike("enough"), KeyboardInterrupt()])
def test_a_progress_function_that_fails_loses_nothing(engine, error, whole):
    def progress(t):
        if t > 0.03:
            raise error

    expected = RunInterrupted if isinstance(error, KeyboardInterrupt) else SimulationError
    with pytest.raises(expected) as stop:
        experiment().simulate(engine=engine, progress=progress)
    assert isinstance(error, KeyboardInterrupt) or "progress failed" in str(stop.value)
    kept = stop.value.result
    assert kept.t[-1] > 0.0295
    assert_begins(kept, whole(engine), len(kept.t))


# -- interrupts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("control_period", [None, 4e-3])
@pytest.mark.parametrize("engine", ENGINES)
def test_an_interrupt_hands_over_what_was_computed(engine, control_period, whole):
    with pytest.raises(RunInterrupted) as stop:
        experiment(raising(KeyboardInterrupt)).simulate(engine=engine, control_period=control_period)
    assert isinstance(stop.value, KeyboardInterrupt)
    assert stop.value.result.status == f"stopped: {stop.value}"
    assert_begins(stop.value.result, whole(engine, control_period), 20)


@pytest.mark.parametrize("method", ["RK45", "LSODA"])
def test_an_interrupt_of_a_solver_does_so_too(method):
    with pytest.raises(RunInterrupted) as stop:
        experiment(raising(KeyboardInterrupt), always=True).simulate(integrator=method)
    good = experiment().simulate(integrator=method)
    kept = stop.value.result
    assert 1 <= len(kept.t) <= 21
    np.testing.assert_allclose(kept.q, good.q[: len(kept.t)], rtol=0, atol=1e-9)


def test_an_interrupt_within_a_step_does_so_too(whole):
    with pytest.raises(RunInterrupted) as stop:
        under(Interrupted).simulate()
    assert stop.value.time == pytest.approx(0.02)
    assert_begins(stop.value.result, whole("pinocchio"), 21)


def test_an_interrupt_before_the_start_hands_over_nothing_but_an_empty_result(monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("synctrl.simulation.engines.check_reachable", interrupt)
    with pytest.raises(RunInterrupted) as stop:
        experiment().simulate()
    assert len(stop.value.result.t) == 0


def failing_once(monkeypatch, name, error):
    """Let a function of the module that makes runs fail the first time."""
    made, failures = getattr(runs, name), [error]

    def fail(*arguments):
        if failures:
            raise failures.pop()
        return made(*arguments)

    monkeypatch.setattr(runs, name, fail)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("error", "expected"), [(KeyboardInterrupt(), RunInterrupted), (MemoryError(), SimulationError)]
)
def test_what_comes_while_the_result_is_made_does_not_lose_it(engine, error, expected, whole, monkeypatch):
    good = whole(engine)
    failing_once(monkeypatch, "step_report", error)
    with pytest.raises(expected) as stop:
        experiment().simulate(engine=engine)
    assert stop.value.result.status == f"stopped: {stop.value}"
    assert_begins(stop.value.result, good, len(good.t))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["diagnosed", "step_report"])
def test_an_interrupt_while_a_failure_is_looked_into_does_not_lose_its_rows(engine, name, whole, monkeypatch):
    failing_once(monkeypatch, name, KeyboardInterrupt())
    with pytest.raises(RunInterrupted) as stop:
        experiment(undefined).simulate(engine=engine)
    assert_begins(stop.value.result, whole(engine), 20)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("error", [np.linalg.LinAlgError("singular"), Strike("no plant")])
def test_an_error_whose_cause_cannot_be_found_is_told_as_it_is(engine, error, whole, monkeypatch):
    failing_once(monkeypatch, "diagnosed", error)
    with refused(NonFiniteError, robot=1, cause="motion") as stop:
        experiment(undefined).simulate(engine=engine)
    assert stop.value.result.status == f"stopped: {stop.value}"
    assert_begins(stop.value.result, whole(engine), 20)


def test_an_interrupted_run_can_be_sent_to_another_process():
    with pytest.raises(RunInterrupted) as stop:
        experiment(raising(KeyboardInterrupt)).simulate()
    copy = pickle.loads(pickle.dumps(stop.value))
    assert (str(copy), copy.time, copy.result) == (str(stop.value), stop.value.time, stop.value.result)


CHILD = """
import signal
import sys
from synctrl.errors import RunInterrupted
from synctrl.experiments import planar_four

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it otherwise
told = []

def progress(t):
    told.append(t)
    if len(told) == 1:
        print("running", flush=True)

try:
    planar_four().simulate(600.0, engine=sys.argv[1], log_dt=0.01, progress=progress)
except RunInterrupted as stop:
    run = stop.result
    print(run.status == f"stopped: {stop}", len(run.t), run.t[-1], told[-1])
"""


@pytest.mark.parametrize("engine", ENGINES)
def test_ctrl_c_ends_a_run_at_once_and_keeps_it(engine):
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, engine], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert child.stdout.readline() == "running\n"
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=120)
    finally:
        child.kill()
    assert (child.returncode, err) == (0, "")
    named, rows, reached, told = out.split()
    assert named == "True"
    assert float(told) - 0.01 <= float(reached) < 600.0
    assert float(reached) == pytest.approx(0.01 * (int(rows) - 1))


# -- blocks -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("control_period", [None, 2e-3])
@pytest.mark.parametrize("engine", ENGINES)
def test_bits_do_not_depend_on_the_blocks_in_which_a_run_is_made(engine, control_period, monkeypatch):
    push = [Disturbance(0, 0.5, 0.0213, 0.0402)]
    run = experiment(disturbances=push, coupling=weights(lambda c: (c, 0 * c, 0 * c)))
    options = {"engine": engine, "control_period": control_period, "duration": 0.06}
    expected = run.simulate(**options)
    for block, away in ((1, 0.05), (7, 1e-12), (1000, 1e-12), (1000, 1e9)):
        monkeypatch.setattr(tables, "BLOCK_STEPS", block)
        monkeypatch.setattr(stepper, "AWAY", away)
        monkeypatch.setattr(advance, "BLOCK", block)
        assert run.simulate(**options) == expected


@given(per_step=st.floats(1e-7, 0.02), count=st.integers(1, 5000))
def test_the_library_is_back_within_its_time_at_any_speed(per_step, count):
    pace, steps = stepper.Pace(), 0
    for first, last in pace.parts(count):
        assert first == steps < last
        assert (last - first) * per_step <= stepper.AWAY
        pace.learn(last - first, (last - first) * per_step)
        steps = last
    assert steps == count


@given(first=st.integers(0, 50), length=st.integers(1, 70), fault=st.integers(0, 120))
def test_what_is_made_ends_right_before_the_step_that_fails(first, length, fault):
    def make(start, stop):
        if start <= fault < stop:
            raise Strike(start, stop)
        return range(start, stop)

    made = []
    parts = up_to_a_failure(make, first, first + length)
    if first <= fault < first + length:
        with pytest.raises(Strike) as stop:
            _steps(parts, made)
        assert stop.value.args == (fault, fault + 1)
        assert made == list(range(first, fault))
    else:
        assert _steps(parts, made) == list(range(first, first + length))


def _steps(parts, made):
    for part in parts:
        made.extend(part)
    return made


def test_an_interrupt_from_outside_is_not_waited_for():
    calls = []

    def make(start, stop):
        calls.append((start, stop))
        if len(calls) == 1:
            raise KeyboardInterrupt
        return range(start, stop)

    with pytest.raises(KeyboardInterrupt):
        next(up_to_a_failure(make, 0, 64))
