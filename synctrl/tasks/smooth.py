"""Desired motion given by its position alone: velocity and acceleration are found, and certified.

Between its breaks a motion becomes Chebyshev polynomials, see `chebyshev`, whose derivatives are exact. They
are off by at most 1e-8 of the size of the motion times its fastest rate, or the motion is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number
from ..errors import TrajectoryError
from . import rotations
from .chebyshev import Function, NotSmoothError, SmoothFunction, fit_smooth
from .poses import Turning
from .trajectories import MOTION_PARTS, Motion, value_at


class SmoothTrajectory:
    """A desired motion given by a Python function of one time for its position alone.

    Args:
        position: function of t returning (m,); smooth between the breaks.
        duration: it can be used from 0 to this time, s.
        breaks: instants at which a derivative jumps, s.

    Raises:
        InputError: no function, a duration that is not positive, or breaks that are no numbers.
        TrajectoryError: not finite vectors of one size, or not smooth enough for a relative error of 1e-8.
    """

    def __init__(self, position: Callable[[float], ArrayLike], duration: float, breaks: Sequence[float] = ()):
        instance("position", position, Callable, "a function of time")  # type: ignore[arg-type]
        self.dimension = int(np.size(position(0.0)))

        def rows(t: float) -> np.ndarray:
            return value_at("position", position, t, finite_array, (self.dimension,))[None, :, None]

        self._function, self.breaks = _certified(rows, duration, breaks)
        self.duration = self._function.duration

    def __call__(self, t: ArrayLike) -> Motion:
        """Motion at t, in s.

        Raises:
            TrajectoryError: t is outside the time it was made for.
        """
        times = np.asarray(t, dtype=float)
        parts = _at(self._function, times.ravel())
        return Motion(*(part.reshape(*times.shape, self.dimension) for part in parts))


class SmoothOrientation:
    """A desired orientation given by a Python function of one time for its rotation alone.

    The angular velocity is that of R' = [w] R, in world axes.

    Args:
        rotation: function of t returning a rotation matrix, (3, 3); smooth between the breaks.
        duration, breaks: see `SmoothTrajectory`.

    Raises:
        InputError: no function, a duration that is not positive, or breaks that are no numbers.
        TrajectoryError: no rotation matrices, or not smooth enough for a relative error of 1e-8.
    """

    def __init__(self, rotation: Callable[[float], ArrayLike], duration: float, breaks: Sequence[float] = ()):
        instance("rotation", rotation, Callable, "a function of time")  # type: ignore[arg-type]

        def matrices(t: float) -> np.ndarray:
            return value_at("rotation", rotation, t, rotations.rotation_matrix)[None]

        self._function, self.breaks = _certified(matrices, duration, breaks)
        self.duration = self._function.duration

    def __call__(self, t: ArrayLike) -> Turning:
        """Orientation at t, in s.

        Raises:
            TrajectoryError: t is outside the time it was made for.
        """
        times = np.asarray(t, dtype=float)
        R, R_dot, R_ddot = _at(self._function, times.ravel()).reshape(3, *times.shape, 3, 3)
        w = _axial(R_dot @ R.mT)
        w_dot = _axial(R_ddot @ R.mT + R_dot @ R_dot.mT)
        return Turning(_orthonormal(R), w, w_dot)


def _certified(
    function: Function, duration: float, breaks: Sequence[float]
) -> tuple[SmoothFunction, tuple[float, ...]]:
    """A function of shape (1, a, b) from 0 to `duration`, and its breaks."""
    instants = tuple(finite_array("breaks", breaks, (None,)).tolist())
    try:
        return fit_smooth(function, positive_number("duration", duration), instants), instants
    except NotSmoothError as error:
        raise TrajectoryError(
            f"the {MOTION_PARTS[error.order]} cannot be found: {error}, with `breaks` where a derivative "
            "jumps"
        ).about(MOTION_PARTS[error.order], time=error.time) from None


def _at(function: SmoothFunction, times: np.ndarray) -> np.ndarray:
    """A function of shape (1, a, b) and two derivatives, (3, T, a, b), at a break from the right."""
    outside = function.first_outside(times)
    if outside is not None:
        raise TrajectoryError(
            f"expected a time from 0 to {function.duration:g} s, for which the motion was made, found "
            f"t = {outside:g} s; make it for a longer duration"
        ).about("t", found=outside)
    return function.at(times)[:, :, 0]


def _axial(A: np.ndarray) -> np.ndarray:
    """The w of the skew part of A = [w], (..., 3, 3) -> (..., 3)."""
    skew = 0.5 * (A - A.mT)
    return np.stack((skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]), axis=-1)


def _orthonormal(R: np.ndarray) -> np.ndarray:
    """The rotation next to a matrix that is one but for 1e-8: a step of Newton's method."""
    return 1.5 * R - 0.5 * R @ R.mT @ R
