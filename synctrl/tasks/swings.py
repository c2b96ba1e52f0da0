"""Motions to and fro that have a name, so that a file can say them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, positive_number
from .trajectories import Circle, FunctionTrajectory, Motion


class Swing(FunctionTrajectory):
    """x(t) = offset + amplitude (1 - cos(w t)) / 2, w = 2 pi / period, at rest at t = 0.

    Every second component goes at twice the speed, so that the way out is not the way back.

    Args:
        amplitude: how far it goes, (m,), in rad or m.
        period: after which it is back, s.
        offset: where it begins, a number or (m,).

    Raises:
        InputError: a value of the wrong size or not finite, or a period that is not positive.
    """

    def __init__(self, amplitude: ArrayLike, period: float, offset: ArrayLike = 0.0):
        self.amplitude = finite_array("amplitude", amplitude, (None,))
        self.period = positive_number("period", period)
        self.offset = finite_array("offset", offset)
        if self.offset.ndim:
            finite_array("offset", offset, self.amplitude.shape)
        self._w = 2 * np.pi / self.period * np.where(np.arange(self.amplitude.size) % 2, 2.0, 1.0)
        self._half = 0.5 * self.amplitude
        super().__init__(self._position, self._velocity, self._acceleration)

    def _position(self, t: float) -> np.ndarray:
        return self.offset + self._half * (1 - np.cos(self._w * t))

    def _velocity(self, t: float) -> np.ndarray:
        return self._half * self._w * np.sin(self._w * t)

    def _acceleration(self, t: float) -> np.ndarray:
        return self._half * self._w * self._w * np.cos(self._w * t)


class Sway:
    """x(t) = to sin(w t) + away (1 - cos(w t)), about 0 and to one side of it.

    Args:
        to, away: how far, (m,), in rad or m.
        speed: w, rad/s.

    Raises:
        InputError: a value of the wrong size or not finite.
    """

    breaks: tuple[float, ...] = ()

    def __init__(self, to: ArrayLike, away: ArrayLike, speed: float):
        self.to = finite_array("to", to, (None,))
        self.away = finite_array("away", away, self.to.shape)
        self.speed = finite_number("speed", speed)
        self.dimension = self.to.size

    def __call__(self, t: ArrayLike) -> Motion:
        to, away, W = self.to, self.away, self.speed
        sine, cosine = (f(W * np.asarray(t, float)[..., None]) for f in (np.sin, np.cos))
        position, acceleration = to * sine + away * (1 - cosine), away * cosine - to * sine
        return Motion(position, W * (to * cosine + away * sine), W * W * acceleration)


class FigureEight(Circle):
    """x(t) = center + along sin(a) first + across sin(2 a) second, a = phase + speed t.

    Args:
        center: the crossing, (m,), m.
        along, across: half of its length and of its width, m.
        speed: of the angle a, rad/s; negative for the other sense.
        phase: a at t = 0, rad.
        first, second: its axes, (m,), orthonormal; by default the first two axes of the task.

    Raises:
        InputError: a value of the wrong size or not finite, or a length or width that is not positive.
        TrajectoryError: axes that are not orthonormal, or a task of one dimension.
    """

    def __init__(
        self,
        center: ArrayLike,
        along: float,
        across: float,
        speed: float,
        phase: float = 0.0,
        first: ArrayLike | None = None,
        second: ArrayLike | None = None,
    ):
        self.along, self.across = positive_number("along", along), positive_number("across", across)
        super().__init__(center, self.along, speed, phase, first, second)

    def __call__(self, t: ArrayLike) -> Motion:
        w = self.speed
        angle = (self.phase + w * np.asarray(t, dtype=float))[..., None]
        one, two = self.along * self.first, self.across * self.second
        outward = np.sin(angle) * one
        twice = np.sin(2 * angle) * two
        velocity = np.cos(angle) * one + 2 * np.cos(2 * angle) * two
        return Motion(self.center + outward + twice, w * velocity, -w * w * (outward + 4 * twice))
