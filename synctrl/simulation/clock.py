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


def make_clock(duration: float, dt: float, jumps: Sequence[float]) -> Clock:
    """A clock that lands exactly on every jump.

    A jump closer than 1e-9 dt to a multiple of dt counts as that multiple, so that 0.7 = 700 dt whatever the
    rounding. If duration is not a multiple of dt the last step is shorter.

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
    inside = _snap(np.array([j for j in jumps if 0 < j < duration]), logged, 1e-9 * dt)
    inside = inside[(inside > 0) & (inside < duration)]
    return Clock(logged, np.union1d(logged, inside), np.unique(inside))


def before(t: float) -> float:
    """The last number before t: where a function is evaluated for its value from the left."""
    return float(np.nextafter(t, -np.inf))


def _snap(jumps: np.ndarray, grid: np.ndarray, tolerance: float) -> np.ndarray:
    nearest = grid[np.abs(grid[:, None] - jumps[None, :]).argmin(axis=0)] if jumps.size else jumps
    return np.where(np.abs(nearest - jumps) <= tolerance, nearest, jumps)
