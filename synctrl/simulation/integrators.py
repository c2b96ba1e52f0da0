"""Ways through time: a fixed-step fourth-order method, and SciPy's adaptive ones.

Each is a generator of `Sample`, one per logged instant, so that the caller has everything up to the moment in
which something fails. Disturbances and breaks of desired motions are only met at the ends of steps: within a
step everything is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..control.controller import Signals
from ..errors import NonFiniteError
from ..tasks.cell import Reference
from .clock import Clock, before
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule

ADAPTIVE = ("RK45", "RK23", "DOP853", "Radau", "BDF", "LSODA")
#: steps whose references are evaluated together
BLOCK = 256


class Sample(NamedTuple):
    """State and signals at one instant."""

    t: float
    y: np.ndarray
    disturbance: np.ndarray
    signals: Signals


def rk4(loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule) -> Iterator[Sample]:
    """The classical Runge-Kutta method of fourth order, one step per instant of the clock."""
    y = loop.initial_state()
    logged = np.isin(clock.times, clock.logged)
    disturbance = schedule.torque(0.0)
    for k, (t, t_next, references) in enumerate(steps(loop, clock.times)):
        start, middle, end = references
        disturbance = schedule.torque(0.5 * (t + t_next))
        h = t_next - t
        k1, signals = loop.evaluate(start, y, disturbance)
        if logged[k]:
            yield Sample(t, y, disturbance, signals)
        k2, _ = loop.evaluate(middle, y + 0.5 * h * k1, disturbance)
        k3, _ = loop.evaluate(middle, y + 0.5 * h * k2, disturbance)
        k4, _ = loop.evaluate(end, y + h * k3, disturbance)
        y = y + (h / 6) * (k1 + 2 * (k2 + k3) + k4)
    yield final(loop, clock, y, disturbance)


def adaptive(
    loop: ClosedLoop,
    clock: Clock,
    schedule: DisturbanceSchedule,
    method: str,
    rtol: float,
    atol: float,
) -> Iterator[Sample]:
    """One of SciPy's methods with error control, restarted at every jump."""
    from scipy.integrate import solve_ivp

    y = loop.initial_state()
    borders = np.concatenate(([clock.logged[0]], clock.jumps, [clock.logged[-1]]))
    for t0, t1 in pairwise(borders):
        disturbance = schedule.torque(0.5 * (t0 + t1))
        rhs = _right_hand_side(loop, disturbance, t1)
        inside = clock.logged[(clock.logged >= t0) & (clock.logged < t1)]
        instants = np.append(inside, t1)
        solution = solve_ivp(rhs, (t0, t1), y, method=method, t_eval=instants, rtol=rtol, atol=atol)
        for t, state in zip(solution.t, solution.y.T, strict=True):
            if t < t1:
                yield _sample(loop, t, state, disturbance)
        if solution.status != 0:
            reached = solution.t[-1] if solution.t.size else t0
            raise NonFiniteError(f"{method} stopped near t = {reached:g} s: {solution.message}", time=reached)
        y = solution.y[:, -1].copy()
    yield final(loop, clock, y, disturbance)


def steps(
    loop: ClosedLoop, times: np.ndarray
) -> Iterator[tuple[float, float, tuple[Reference, Reference, Reference]]]:
    """Every step of the clock with what is desired at its start, in its middle, and just before its end."""
    for k in range(0, len(times) - 1, BLOCK):
        starts, ends = times[k : k + BLOCK + 1][:-1], times[k : k + BLOCK + 1][1:]
        tables = (
            loop.cell.references(starts),
            loop.cell.references(0.5 * (starts + ends)),
            loop.cell.references(np.nextafter(ends, -np.inf)),
        )
        yield from zip(starts.tolist(), ends.tolist(), zip(*tables, strict=True), strict=True)


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
