"""Ways through time: a fixed-step fourth-order method, and SciPy's adaptive ones.

Each is a generator of `Sample`, one per logged instant, so that the caller has everything up to the moment in
which something fails. Disturbances and breaks of desired motions are only met at the ends of steps: within a
step everything is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..control.controller import Signals
from ..errors import NonFiniteError, SynctrlError
from ..tasks.cell import Reference
from .clock import Clock, before
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule
from .step_error import StepError

ADAPTIVE = ("RK45", "RK23", "DOP853", "Radau", "BDF", "LSODA")
#: weights of the four stages, times 6
_SIMPSON = np.array([1.0, 2.0, 2.0, 1.0])
#: steps whose references are evaluated together
BLOCK = 256
#: steps of an adaptive method between two logged instants, after which it is taken to be stuck
MAX_TRIES = 10_000


class Sample(NamedTuple):
    """State and signals at one instant."""

    t: float
    y: np.ndarray
    disturbance: np.ndarray
    signals: Signals


def rk4(
    loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule, step_error: StepError
) -> Iterator[Sample]:
    """The classical Runge-Kutta method of fourth order, one step per instant of the clock."""
    rates = np.zeros((4, loop.size))
    k1, k2, k3, k4 = map(loop.state, rates)
    y, following, stage = loop.state(loop.initial_state()), loop.state(), loop.state()
    logged = np.isin(clock.times, clock.logged).tolist()
    windows, pushes = _windows(schedule, clock), [tau if tau.any() else None for tau in schedule.torques]
    joined, h = clock.joined.tolist(), 0.0
    for k, (t, t_next, (start, middle, end)) in enumerate(steps(loop, clock.times)):
        push = pushes[windows[k]]
        now = loop.at(0.5 * (t + t_next))
        signals = now.derive(start, y, push, k1)
        step_error.add(t, y.v, h if joined[k] else 0.0, k4.v - k1.v, k1.v)
        h = t_next - t
        if logged[k]:
            yield Sample(t, y.flat, schedule.torques[windows[k]], signals)
        now.derive(middle, stage.ahead(y, 0.5 * h, k1.flat), push, k2)
        now.derive(middle, stage.ahead(y, 0.5 * h, k2.flat), push, k3)
        now.derive(end, stage.ahead(y, h, k3.flat), push, k4)
        y, following = following.ahead(y, h / 6, _SIMPSON.dot(rates)), y
    step_error.add(float(clock.times[-1]), y.v)
    yield final(loop, clock, y.flat, schedule.torques[windows[-1]])


def _windows(schedule: DisturbanceSchedule, clock: Clock) -> list[int]:
    """Which torque of the schedule acts in each step of the clock."""
    return schedule.windows(0.5 * (clock.times[:-1] + clock.times[1:])).tolist()


def adaptive(
    loop: ClosedLoop,
    clock: Clock,
    schedule: DisturbanceSchedule,
    method: str,
    rtol: float,
    atol: float,
) -> Iterator[Sample]:
    """One of SciPy's methods with error control, restarted at every jump."""
    import scipy.integrate

    y = loop.initial_state()
    borders = np.concatenate(([clock.logged[0]], clock.jumps, [clock.logged[-1]]))
    for t0, t1 in pairwise(borders):
        disturbance = schedule.torque(0.5 * (t0 + t1))
        rhs = _right_hand_side(loop.at(0.5 * (t0 + t1)), disturbance, t1)
        instants = clock.logged[(clock.logged >= t0) & (clock.logged < t1)]
        solver = getattr(scipy.integrate, method)(rhs, t0, y, t1, rtol=rtol, atol=atol)
        for t, state in _states(solver, instants):
            yield _sample(loop, t, state, disturbance)
        if solver.status == "failed":
            raise _stuck(loop, method, solver.t, rhs(solver.t, solver.y))
        y = solver.y.copy()
    yield final(loop, clock, y, disturbance)


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
            reached, passed, tries = instants[passed:count], count, 0
            yield from zip(reached, solver.dense_output()(reached).T, strict=True)
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


def steps(
    loop: ClosedLoop, times: np.ndarray
) -> Iterator[tuple[float, float, tuple[Reference, Reference, Reference]]]:
    """Every step of the clock with what is desired at its start, in its middle, and just before its end."""
    for k in range(0, len(times) - 1, BLOCK):
        starts, ends = times[k : k + BLOCK + 1][:-1], times[k : k + BLOCK + 1][1:]
        instants = starts, 0.5 * (starts + ends), np.nextafter(ends, -np.inf)
        table, n = loop.cell.reference_table(np.concatenate(instants)), len(starts)
        stages = (loop.cell.instants(table, slice(i * n, (i + 1) * n)) for i in range(3))
        yield from zip(starts.tolist(), ends.tolist(), zip(*stages, strict=True), strict=True)


def _right_hand_side(
    loop: ClosedLoop, disturbance: np.ndarray, end: float
) -> Callable[[float, np.ndarray], np.ndarray]:
    """t, y -> y' on a smooth interval, with values from the left at its end."""

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        reference = loop.cell.references(np.array([min(t, before(end))]))[0]
        return loop.evaluate(reference, y, disturbance)[0]

    return rhs


def _sample(loop: ClosedLoop, t: float, y: np.ndarray, disturbance: np.ndarray) -> Sample:
    reference = loop.cell.references(np.array([t]))[0]
    return Sample(float(t), y, disturbance, loop.evaluate(reference, y, disturbance)[1])


def final(loop: ClosedLoop, clock: Clock, y: np.ndarray, disturbance: np.ndarray) -> Sample:
    """The sample at the end of the run."""
    return _sample(loop, float(clock.times[-1]), y, disturbance)
