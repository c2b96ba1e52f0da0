"""When to evaluate: the grid of logged instants, and the smooth intervals between jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import positive_number
from ..errors import InputError

MAX_STEPS = 10_000_000


@dataclass(frozen=True)
class Clock:
    """Instants of a run.

    Attributes:
        logged: instants to log, (T,), s: multiples of dt, and the end.
        times: the same with every jump in between added, s.
        jumps: instants inside the run at which the right-hand side jumps, s.
    """

    logged: np.ndarray
    times: np.ndarray
    jumps: np.ndarray

    @property
    def joined(self) -> np.ndarray:
        """Whether the right-hand side goes on smoothly from the step before each of the times, (T,)."""
        joined = ~np.isin(self.times, self.jumps)
        joined[[0, -1]] = False
        return joined


def make_clock(duration: float, dt: float, edges: Sequence[float], breaks: Sequence[float] = ()) -> Clock:
    """A clock that lands exactly on every jump.

    What is closer than 1e-9 dt to a multiple of dt counts as that multiple, so that 0.7 = 700 dt whatever the
    rounding. At a break the multiple gives way, because a desired motion asks on which side of it a time
    lies; at an edge it stays, so that the instants do not depend on disturbances. If duration is not a
    multiple of dt the last step is shorter.

    Args:
        duration: length of the run, s.
        dt: distance of logged instants, s.
        edges: instants at which a disturbance jumps, s.
        breaks: instants at which a desired motion jumps, s.

    Raises:
        InputError: duration or dt not positive, dt longer than the run, or more than ten million steps.
    """
    duration, dt = positive_number("duration", duration), positive_number("dt", dt)
    if dt > duration:
        raise InputError(f"dt: expected at most the duration of {duration:g} s, found {dt:g} s")
    if duration / dt > MAX_STEPS:
        raise InputError(f"dt: {duration:g} s in steps of {dt:g} s are more than {MAX_STEPS} steps")
    count = int(np.ceil(duration / dt - 1e-9))
    logged = np.append(np.arange(count) * dt, duration)
    for instant in breaks:
        near = 1 + np.abs(logged[1:] - instant).argmin()
        logged[near] = _snap(logged[near], instant, dt)
    snapped = [_snap(edge, logged[np.abs(logged - edge).argmin()], dt) for edge in edges]
    jumps = np.unique([jump for jump in (*breaks, *snapped) if 0 < jump < logged[-1]])
    return Clock(logged, np.union1d(logged, jumps), jumps)


def before(t: float) -> float:
    """The last number before t: where a function is evaluated for its value from the left."""
    return float(np.nextafter(t, -np.inf))


def _snap(t: float, to: float, dt: float) -> float:
    return to if abs(t - to) <= 1e-9 * dt else t
