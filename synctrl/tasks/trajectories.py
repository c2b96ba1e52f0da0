"""Desired motion: position, velocity and acceleration as functions of time.

A trajectory is called with one time or with an array of times and returns `Motion`. At an instant in its
`breaks`, where a derivative jumps, it has the value from the right.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance, positive_number
from ..errors import InputError, TrajectoryError

#: what a `Motion` has, in words
MOTION_PARTS = ("position", "velocity", "acceleration")


class Motion(NamedTuple):
    """Desired position, velocity and acceleration, each (m,), or (T, m) for T times."""

    x: np.ndarray
    x_dot: np.ndarray
    x_ddot: np.ndarray


class Trajectory(Protocol):
    """A desired motion of dimension m, smooth except at the instants in `breaks`."""

    @property
    def dimension(self) -> int:
        """m."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Instants at which a derivative jumps, in s."""

    def __call__(self, t: ArrayLike) -> Motion:
        """Motion at t, in s."""


class _PointToPoint:
    """A straight line from `start` to `end`, travelled as a fraction of time."""

    breaks: tuple[float, ...] = ()

    def __init__(self, start: ArrayLike, end: ArrayLike):
        self.start = finite_array("start", start, (None,))
        self.end = finite_array("end", end, self.start.shape)
        self.dimension = self.start.size

    def _along(self, s: np.ndarray, s_dot: np.ndarray, s_ddot: np.ndarray) -> Motion:
        way = self.end - self.start
        return Motion(self.start + _times(s, way), _times(s_dot, way), _times(s_ddot, way))


class Hold(_PointToPoint):
    """A fixed desired position."""

    def __init__(self, position: ArrayLike):
        super().__init__(position, position)

    def __call__(self, t: ArrayLike) -> Motion:
        still = np.zeros_like(np.asarray(t, dtype=float))
        return self._along(still, still, still)


class Cubic(_PointToPoint):
    """Cubic polynomial from rest to rest, then held: s = 3 a^2 - 2 a^3 with a = t / duration.

    Args:
        start, end: positions, (m,), in rad or m.
        duration: s.

    Raises:
        InputError: sizes differ, a value is not finite, or the duration is not positive.
    """

    def __init__(self, start: ArrayLike, end: ArrayLike, duration: float):
        super().__init__(start, end)
        self.duration = positive_number("duration", duration)
        self.breaks = (0.0, self.duration)

    def __call__(self, t: ArrayLike) -> Motion:
        T = self.duration
        t = np.asarray(t, dtype=float)
        moving = (t >= 0) & (t < T)
        a = np.clip(t / T, 0.0, 1.0)
        s = a * a * (3 - 2 * a)
        return self._along(s, moving * 6 * a * (1 - a) / T, moving * (6 - 12 * a) / T**2)


class ExponentialApproach(_PointToPoint):
    """x(t) = start + (end - start) (1 - exp(-rate t)), the desired motion of section V-B.

    Args:
        start, end: positions, (m,), in rad or m.
        rate: 1/s.
    """

    def __init__(self, start: ArrayLike, end: ArrayLike, rate: float = 1.0):
        super().__init__(start, end)
        self.rate = positive_number("rate", rate)

    def __call__(self, t: ArrayLike) -> Motion:
        k = self.rate
        left = np.exp(-k * np.asarray(t, dtype=float))
        return self._along(1 - left, k * left, -k * k * left)


class Circle:
    """x(t) = center + radius (cos(a) first + sin(a) second), a = phase + speed t.

    Args:
        center: (m,), m.
        radius: m.
        speed: angular speed, rad/s; negative for the other sense.
        phase: angle at t = 0, rad.
        first, second: the circle's axes, (m,), orthonormal; by default the first two axes of the task.

    Raises:
        InputError: a value of the wrong size or not finite, or a radius that is not positive.
        TrajectoryError: axes that are not orthonormal, or a task of one dimension.
    """

    breaks: tuple[float, ...] = ()

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        speed: float,
        phase: float = 0.0,
        first: ArrayLike | None = None,
        second: ArrayLike | None = None,
    ):
        self.center = finite_array("center", center, (None,))
        self.dimension = m = self.center.size
        if m < 2:
            raise TrajectoryError(
                f"a circle needs a task of at least 2 dimensions, found {m}", subject="center", found=m
            )
        self.radius = positive_number("radius", radius)
        self.speed = finite_number("speed", speed)
        self.phase = finite_number("phase", phase)
        self.first = finite_array("first", np.eye(m)[0] if first is None else first, (m,))
        self.second = finite_array("second", np.eye(m)[1] if second is None else second, (m,))
        axes = np.array([self.first, self.second])
        if not np.allclose(axes @ axes.T, np.eye(2), atol=1e-9):
            raise TrajectoryError(
                f"expected orthonormal axes, found {self.first} and {self.second}",
                subject="first, second",
                found=(self.first, self.second),
            )

    def __call__(self, t: ArrayLike) -> Motion:
        w = self.speed
        angle = self.phase + w * np.asarray(t, dtype=float)
        outward = self.radius * (_times(np.cos(angle), self.first) + _times(np.sin(angle), self.second))
        along = self.radius * (_times(np.cos(angle), self.second) - _times(np.sin(angle), self.first))
        return Motion(self.center + outward, w * along, -w * w * outward)


class FunctionTrajectory:
    """A desired motion given by Python functions of one time.

    Before a run the derivatives are held against differences. `SmoothTrajectory` finds them by itself.

    Args:
        position, velocity, acceleration: functions of t returning (m,).
        breaks: instants at which a derivative jumps, s.

    Raises:
        InputError: no functions, or breaks that are no numbers.
        TrajectoryError: the three do not return finite vectors of one size, at t = 0 or in a later call.
    """

    def __init__(
        self,
        position: Callable[[float], ArrayLike],
        velocity: Callable[[float], ArrayLike],
        acceleration: Callable[[float], ArrayLike],
        breaks: tuple[float, ...] = (),
    ):
        self._functions = dict(zip(MOTION_PARTS, (position, velocity, acceleration), strict=True))
        for name, function in self._functions.items():
            instance(name, function, Callable, "a function of time")  # type: ignore[arg-type]
        self.breaks = tuple(finite_array("breaks", breaks, (None,)).tolist())
        self.dimension = np.size(position(0.0))
        self(0.0)

    def __call__(self, t: ArrayLike) -> Motion:
        times = np.asarray(t, dtype=float)
        parts = [
            [value_at(name, function, tk, finite_array, (self.dimension,)) for tk in times.ravel().tolist()]
            for name, function in self._functions.items()
        ]
        return Motion(*(np.array(part).reshape(*times.shape, self.dimension) for part in parts))


def value_at(name: str, function: Callable, t: float, check: Callable, *expected: Any) -> np.ndarray:
    """What a function of one time gives at t, checked.

    Args:
        name: of the function, for messages.
        function: of t.
        t: s.
        check: `finite_array` or another that raises an `InputError`, called with name, value and `expected`.

    Raises:
        TrajectoryError: what `check` refuses; with the time.
    """
    try:
        return check(name, function(t), *expected)
    except InputError as error:
        raise TrajectoryError(f"{error} at t = {t:g} s").about(name, found=error.found, time=t) from error


def _times(factor: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """factor (...) times vector (m,) -> (..., m)."""
    return np.asarray(factor)[..., None] * vector
