"""Ways through time: a fixed-step fourth-order method, and SciPy's adaptive ones.

Each is a generator of `Sample`, one per logged instant, so that the caller has everything up to the moment in
which something fails. Disturbances and breaks of desired motions are only met at the ends of steps: within a
step everything is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import isfinite
from threading import current_thread, main_thread
from typing import Any, NamedTuple

import numpy as np

from ..control.controller import Signals
from ..coupling.cell import Reference
from ..errors import InputError, NonFiniteError, SynctrlError
from .clock import Clock, Stretch, before
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule
from .handover import up_to_a_failure, user_failure
from .step_error import StepError

ADAPTIVE = ("RK45", "RK23", "DOP853", "Radau", "BDF", "LSODA")
#: weights of the four stages, times 6
_SIMPSON = np.array([1.0, 2.0, 2.0, 1.0])
#: steps whose references are evaluated together
BLOCK = 256
#: steps of an adaptive method between two logged instants, after which it is taken to be stuck
MAX_TRIES = 10_000


class Sample(NamedTuple):
    """State and signals at one instant, and whether it belongs into the log."""

    t: float
    y: np.ndarray
    disturbance: np.ndarray
    signals: Signals
    logged: bool = True


class Step(NamedTuple):
    """One step of a run.

    Attributes:
        t, t_next: its start and end, s.
        stages: what is desired at its start, in its middle, and just before its end.
        window: which torque of the schedule acts.
        number: which multiple of dt it begins at or after.
        checked: whether it begins at that multiple.
        logged: whether it begins at an instant that is logged.
        joined: whether all goes on smoothly from the step before.
    """

    t: float
    t_next: float
    stages: tuple[Reference, Reference, Reference]
    window: int
    number: int
    checked: bool
    logged: bool
    joined: bool


def rk4(
    loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule, step_error: StepError
) -> Iterator[Sample]:
    """The classical Runge-Kutta method of fourth order, one step per instant of the clock."""
    rates = np.zeros((4, loop.size))
    k1, k2, k3, k4 = map(loop.state, rates)
    y, following, stage = loop.state(loop.initial_state()), loop.state(), loop.state()
    pushes, h = [tau if tau.any() else None for tau in schedule.torques], 0.0
    for t, t_next, (start, middle, end), window, _, checked, logged, joined in steps(loop, clock, schedule):
        push, now = pushes[window], loop.at(0.5 * (t + t_next))
        signals = now.derive(start, y, push, k1)
        step_error.add(t, y.v, h if joined else 0.0, k4.v - k1.v, k1.v)
        h = t_next - t
        if checked:
            yield Sample(t, y.flat, schedule.torques[window], signals, logged)
        now.derive(middle, stage.ahead(y, 0.5 * h, k1.flat), push, k2)
        now.derive(middle, stage.ahead(y, 0.5 * h, k2.flat), push, k3)
        now.derive(end, stage.ahead(y, h, k3.flat), push, k4)
        y, following = now.settled(following.ahead(y, h / 6, _SIMPSON.dot(rates))), y
    step_error.add(clock.end, y.v)
    yield final(loop, clock, y.flat, schedule.torques[window])


def adaptive(
    loop: ClosedLoop,
    clock: Clock,
    schedule: DisturbanceSchedule,
    method: str,
    rtol: float,
    atol: float,
) -> Iterator[Sample]:
    """One of SciPy's methods with error control, restarted at every jump.

    Raises:
        InputError: LSODA outside the main thread, of a SciPy that has memory for one problem only.
    """
    import scipy.integrate

    _check_thread(method, scipy.__version__)
    y = loop.initial_state()
    logged = clock.logged
    borders = np.concatenate(([0.0], clock.jumps, [clock.end]))
    for t0, t1 in pairwise(borders):
        disturbance = schedule.torque(0.5 * (t0 + t1))
        rhs = _right_hand_side(loop.at(0.5 * (t0 + t1)), disturbance, t1)
        instants = logged[(logged >= t0) & (logged < t1)]
        solver = getattr(scipy.integrate, method)(rhs, t0, y, t1, rtol=rtol, atol=atol)
        for t, state in _states(solver, instants):
            yield _sample(loop, t, state, disturbance)
        if solver.status == "failed":
            raise _stuck(loop, method, solver.t, rhs(solver.t, solver.y))
        y = solver.y.copy()
    yield final(loop, clock, y, disturbance)


def _check_thread(method: str, version: str) -> None:
    """Before version 1.17 SciPy's LSODA kept its state in one place, where runs would spoil each other."""
    old = tuple(map(int, version.split(".")[:2])) < (1, 17)
    if method == "LSODA" and old and current_thread() is not main_thread():
        raise InputError(
            f"integrator: LSODA of SciPy {version} solves one problem at a time, so it runs in the main "
            f"thread only, found thread '{current_thread().name}'; use another method, or SciPy 1.17 or newer"
        )


def _states(solver: Any, instants: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """The solver's state at every instant, as soon as it has got there; ends early if it fails."""
    passed, tries = int(instants.size and instants[0] == solver.t), 0
    if passed:
        yield solver.t, solver.y
    while solver.status == "running":
        _step(solver)
        tries += 1
        count = int(np.searchsorted(instants, solver.t, side="right"))
        if solver.status != "failed" and count > passed:
            reached, passed, tries, output = instants[passed:count], count, 0, solver.dense_output()
            yield from ((t, output(t)) for t in reached)  # one by one: bits do not depend on what is logged
        if tries > MAX_TRIES:
            solver.status = "failed"


def _step(solver: Any) -> None:
    """One step; numbers that an implicit method cannot calculate with are a failure like others."""
    try:
        solver.step()
    except SynctrlError:
        raise
    except ValueError:
        solver.status = "failed"


def _stuck(loop: ClosedLoop, method: str, t: float, y_dot: np.ndarray) -> NonFiniteError:
    """The error of a method that cannot go on, with the robot whose state changes fastest."""
    v_dot = np.nan_to_num(np.abs(loop.split(y_dot)[1]), nan=np.inf).max(axis=1)
    i = int(v_dot.argmax())
    return NonFiniteError(
        f"{method} got stuck at t = {t:g} s, where {loop.cell.names[i]} accelerates with "
        f"{v_dot[i]:.3g} rad/s²",
        time=float(t),
        robot=i,
    )


def steps(loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule) -> Iterator[Step]:
    """Every step of the clock; all that come before an instant whose references cannot be had, and its error.

    Raises:
        SynctrlError: a desired motion or weight fails.
    """

    def make(first: int, last: int) -> list[Step]:
        return list(_tabulated(loop, clock, clock.stretch(first, last), schedule))

    for first, last in clock.stretches(BLOCK):
        for made in up_to_a_failure(make, first, last):
            yield from made


def _tabulated(
    loop: ClosedLoop, clock: Clock, stretch: Stretch, schedule: DisturbanceSchedule
) -> Iterator[Step]:
    """The steps of a stretch, their references evaluated together."""
    table, n = loop.cell.reference_table(stretch.stages.ravel()), len(stretch.starts)
    stages = (loop.cell.instants(table, slice(i * n, (i + 1) * n)) for i in range(3))
    columns = stretch.number, stretch.checked, stretch.logged, clock.joined(stretch.first, stretch.starts)
    return map(
        Step,
        stretch.starts.tolist(),
        stretch.times[1:].tolist(),
        zip(*stages, strict=True),
        schedule.windows(stretch.middles).tolist(),
        *(column.tolist() for column in columns),
    )


def _right_hand_side(
    loop: ClosedLoop, disturbance: np.ndarray, end: float
) -> Callable[[float, np.ndarray], np.ndarray]:
    """t, y -> y' on a smooth interval, with values from the left at its end."""

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        if not isfinite(t):  # the solver is lost, and nothing is desired then
            return np.full(loop.size, np.nan)
        reference = loop.cell.references(np.array([min(t, before(end))]))[0]
        try:
            return loop.evaluate(reference, y, disturbance)[0]
        except SynctrlError:
            raise
        except Exception as error:  # solvers have a meaning of their own for some
            raise user_failure(error, t) from error

    return rhs


def _sample(loop: ClosedLoop, t: float, y: np.ndarray, disturbance: np.ndarray) -> Sample:
    reference = loop.cell.references(np.array([t]))[0]
    return Sample(float(t), y, disturbance, loop.evaluate(reference, y, disturbance)[1])


def final(loop: ClosedLoop, clock: Clock, y: np.ndarray, disturbance: np.ndarray) -> Sample:
    """The sample at the end of the run."""
    return _sample(loop, clock.end, y, disturbance)
