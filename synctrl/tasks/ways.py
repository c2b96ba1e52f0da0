"""Ways: the arc length s(t) along a curve over time, and what moves with it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_number, positive_number
from ..errors import InputError
from .trajectories import Motion

#: nodes of the quadrature between two parameters of a curve
NODES = 8
#: share of the whole length up to which neighbouring points of a curve are at one place
HALT = 1e-9


class RampUp:
    """From rest to a constant speed by a raised cosine; a trajectory of one number.

    Args:
        speed: in the end, m/s.
        ramp: how long it takes, s.

    Raises:
        InputError: no number, or a ramp that is not positive.
    """

    dimension = 1

    def __init__(self, speed: float, ramp: float):
        self.speed, self.ramp = finite_number("speed", speed), positive_number("ramp", ramp)
        self.breaks = (self.ramp,)

    def __call__(self, t: ArrayLike) -> Motion:
        t, k = np.asarray(t, dtype=float)[..., None], np.pi / self.ramp
        early, half = np.clip(t, 0.0, self.ramp), 0.5 * self.speed
        return Motion(
            half * (early - np.sin(k * early) / k) + self.speed * np.maximum(t - self.ramp, 0.0),
            half * (1 - np.cos(k * early)),
            half * k * np.sin(k * early),
        )


class Ramped:
    """Along a line from rest to rest, at one speed but for ramps by raised cosines; then held.

    Args:
        start, end: numbers, m.
        duration: of the way, s.
        ramp: how long it takes to get up to speed, and to come to rest, s; up to half of the duration.

    Raises:
        InputError: no numbers, a duration or ramp that is not positive, or a ramp that is too long.
    """

    dimension = 1

    def __init__(self, start: float, end: float, duration: float, ramp: float):
        self.start, self.end = finite_number("start", start), finite_number("end", end)
        self.duration, self.ramp = positive_number("duration", duration), positive_number("ramp", ramp)
        if self.ramp > self.duration / 2:
            raise InputError.expected(f"at most half of {self.duration:g} s", self.ramp, "ramp")
        self.breaks = (0.0, self.ramp, self.duration - self.ramp, self.duration)
        self.speed = (self.end - self.start) / (self.duration - self.ramp)
        self._up = RampUp(self.speed, self.ramp)

    def __call__(self, t: ArrayLike) -> Motion:
        now = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        gone, speed, growth = self._up(np.minimum(now, self.duration - now))  # seen from the closer end
        late = (now > self.duration / 2)[..., None]
        return Motion(
            np.where(late, self.end - gone, self.start + gone), speed, np.where(late, -growth, growth)
        )


def over_time(way: Motion, x_s: np.ndarray, x_ss: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative by time, (..., k), of what depends on the arc length alone.

    Args:
        way: s, s' and s'', (..., 1).
        x_s, x_ss: derivatives by the arc length, (..., k).
    """
    _, speed, growth = way
    return x_s * speed, x_ss * speed**2 + x_s * growth


def chords(points: np.ndarray) -> np.ndarray:
    """Distances of points from the ones before, (N - 1,), m.

    Args:
        points: (N, k), m.

    Raises:
        InputError: two neighbours at one place.
    """
    found = np.linalg.norm(np.diff(points, axis=0), axis=1)
    k = int(np.argmin(found))
    if found[k] <= HALT * found.sum():
        what = f"a distance between the points at {k} and {k + 1}"
        raise InputError.expected(what, float(found[k]), "points")
    return found


def arc_lengths(curve: Any, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Lengths of a curve between parameters, (...), that have at most one point of the curve between them.

    Args:
        curve: a spline of a parameter, `curve(u, k)` its k-th derivative.
        start, end: parameters, (...).
    """
    x, weights = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * (end - start)
    speed = np.linalg.norm(curve(start[..., None] + half[..., None] * (1 + x), 1), axis=-1)
    return half * (speed * weights).sum(axis=-1)
