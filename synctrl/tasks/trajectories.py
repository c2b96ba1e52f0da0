"""Desired motion: position, velocity and acceleration as functions of time.

A trajectory is called with one time or with an array of times and returns `Motion`. At an instant in its
`breaks`, where a derivative jumps, it has the value from the right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance, positive_number, same_size
from ..errors import InputError, TrajectoryError
from .chebyshev import Function, NotSmoothError, fit_smooth

#: factors, (...), and a vector, (m,) -> the vector times each of them, (..., m)
_times = np.multiply.outer
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
    """A straight line from `start` to `end`: `progress` is how much of it is behind, and its derivatives."""

    breaks: tuple[float, ...] = ()
    progress: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]

    def __init__(self, start: ArrayLike, end: ArrayLike):
        self.start = finite_array("start", start, (None,))
        self.end = finite_array("end", end, self.start.shape)
        self.dimension = self.start.size

    def __call__(self, t: ArrayLike) -> Motion:
        way = self.end - self.start
        s, s_dot, s_ddot = self.progress(np.asarray(t, dtype=float))
        return Motion(self.start + _times(s, way), _times(s_dot, way), _times(s_ddot, way))


class Hold(_PointToPoint):
    """A fixed desired position.

    Args:
        position: (m,), in rad or m.
    """

    def __init__(self, position: ArrayLike):
        super().__init__(position, position)

    def progress(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        still = np.zeros_like(t)
        return still, still, still


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

    def progress(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        T = self.duration
        moving = (t >= 0) & (t < T)
        a = np.clip(t / T, 0.0, 1.0)
        s = a * a * (3 - 2 * a)
        return s, moving * 6 * a * (1 - a) / T, moving * (6 - 12 * a) / T**2


class ExponentialApproach(_PointToPoint):
    """x(t) = start + (end - start) (1 - exp(-rate t)), the desired motion of section V-B.

    Args:
        start, end: positions, (m,), in rad or m.
        rate: 1/s.
    """

    def __init__(self, start: ArrayLike, end: ArrayLike, rate: float = 1.0):
        super().__init__(start, end)
        self.rate = positive_number("rate", rate)

    def progress(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        k = self.rate
        left = np.exp(-k * t)
        return 1 - left, k * left, -k * k * left


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
            few = f"a circle needs a task of at least 2 dimensions, found {m}"
            raise TrajectoryError(few, subject="center", found=m)
        self.radius = positive_number("radius", radius)
        self.speed = finite_number("speed", speed)
        self.phase = finite_number("phase", phase)
        self.first = same_size("first", np.eye(m)[0] if first is None else first, m)
        self.second = same_size("second", np.eye(m)[1] if second is None else second, m)
        axes = np.array([self.first, self.second])
        if not np.allclose(axes @ axes.T, np.eye(2), atol=1e-9):
            raise TrajectoryError.expected("orthonormal axes", axes, "first, second")

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
        self._functions = functions_of_time(position=position, velocity=velocity, acceleration=acceleration)
        self.breaks = instants(breaks)
        self.dimension = np.size(position(0.0))
        self(0.0)

    def __call__(self, t: ArrayLike) -> Motion:
        return Motion(*(values_at(*named, t, (self.dimension,)) for named in self._functions.items()))


class Certified:
    """What one function of time says alone, with two derivatives that are found and certified.

    Between its breaks it becomes Chebyshev polynomials, see `chebyshev`, whose derivatives are exact. They
    are off by at most 1e-8 of its size times its fastest rate, or it is refused.

    Args:
        function: of time, in s; gives matrices, (1, a, b).
        duration: it can be used from 0 to this time, s.
        breaks: instants at which a derivative jumps, s.

    Raises:
        InputError: a duration that is not positive, or breaks that are no numbers.
        TrajectoryError: a function that is not smooth enough.
    """

    def __init__(self, function: Function, duration: float, breaks: Sequence[float]):
        self.breaks = instants(breaks)
        try:
            self._function = fit_smooth(function, positive_number("duration", duration), self.breaks)
        except NotSmoothError as error:
            raise TrajectoryError(
                f"the {MOTION_PARTS[error.order]} cannot be found: {error}, with `breaks` where a derivative "
                "jumps"
            ).about(MOTION_PARTS[error.order], time=error.time) from None
        self.duration = self._function.duration

    def _at(self, t: ArrayLike) -> np.ndarray:
        """Value and two derivatives, (3, ..., a, b), at times, s; at a break from the right."""
        times = np.asarray(t, dtype=float)
        outside = self._function.first_outside(times.ravel())
        if outside is not None:
            raise TrajectoryError(
                f"expected a time from 0 to {self.duration:g} s, for which the motion was made, found "
                f"t = {outside:g} s; make it for a longer duration"
            ).about("t", found=outside)
        found = self._function.at(times.ravel())[:, :, 0]
        return found.reshape(3, *times.shape, *found.shape[2:])


class SmoothTrajectory(Certified):
    """A desired motion given by a Python function of one time for its position alone.

    Args:
        position: function of t returning (m,); smooth between the breaks.
        duration: it can be used from 0 to this time, s.
        breaks: instants at which a derivative jumps, s.

    Raises:
        InputError: no function, a duration that is not positive, or breaks that are no numbers.
        TrajectoryError: not finite vectors of one size, or not smooth enough for a relative error of 1e-8; or
            a time, in a later call, that is outside the duration.
    """

    def __init__(self, position: Callable[[float], ArrayLike], duration: float, breaks: Sequence[float] = ()):
        functions_of_time(position=position)
        self.dimension = int(np.size(position(0.0)))
        shape = (self.dimension,)
        super().__init__(lambda t: values_at("position", position, t, shape)[None, :, None], duration, breaks)

    def __call__(self, t: ArrayLike) -> Motion:
        return Motion(*self._at(t)[..., 0])


# -- functions of a user's own -----------------------------------------------------------------------------


def functions_of_time(**functions: Callable) -> dict[str, Callable]:
    """Functions by name, all of which are some: an `InputError` has the name of one that is not."""
    for name, function in functions.items():
        instance(name, function, Callable, "a function of time")  # type: ignore[arg-type]
    return functions


def instants(breaks: ArrayLike) -> tuple[float, ...]:
    """Breaks as numbers, s."""
    return tuple(finite_array("breaks", breaks, (None,)).tolist())


def values_at(
    name: str, function: Callable, t: ArrayLike, shape: tuple[int, ...], check: Callable | None = None
) -> np.ndarray:
    """What a function of one time gives at t, s, one time or many, (...): finite arrays, (..., *shape).

    Args:
        name, function, shape: what messages call it, and the shape of its values.
        t: s.
        check: called with name and value in the place of `finite_array`, if they have to be more than finite.

    Raises:
        TrajectoryError: what is refused by an `InputError`; with the time.
    """
    read, times, found = check or partial(finite_array, shape=shape), np.asarray(t, dtype=float), []
    for tk in times.ravel().tolist():
        try:
            found.append(read(name, function(tk)))
        except InputError as error:
            failure = TrajectoryError(f"{error} at t = {tk:g} s")
            raise failure.about(name, found=error.found, time=tk) from error
    return np.array(found).reshape(*times.shape, *shape)
