"""A desired motion through points at given times."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice, count, finite_array
from ..errors import InputError, TrajectoryError
from .trajectories import Motion

#: of the spline: position to fourth derivative are continuous
DEGREE = 5
ENDS = "rest", "free"


class Spline:
    """A spline of degree five through points at given times.

    Args:
        times: in order, (k,), s.
        points: where it is then, (k, m), in rad or m.
        ends: "rest" begins and ends at rest, and holds the first point before and the last one after; "free"
            leaves the ends to the points, at least six of them, and has no motion outside of the times.

    Raises:
        InputError: not finite, other sizes, times that are not in order, or too few points.
        TrajectoryError: in a later call, a time at which it has no motion.
    """

    def __init__(self, times: ArrayLike, points: ArrayLike, ends: str = "rest"):
        self.times = finite_array("times", times, (None,))
        self.points = finite_array("points", points, (len(self.times), None))
        self.ends = choice("ends", ends, ENDS)
        count("number of points", len(self.points), 2 if ends == "rest" else DEGREE + 1)
        late = np.flatnonzero(np.diff(self.times) <= 0)
        if late.size:
            k = int(late[0]) + 1
            expected = f"times in order, each after {self.times[k - 1]:g} s"
            raise InputError.expected(f"{expected} at index {k}", float(self.times[k]), "times")
        self.dimension = int(self.points.shape[1])
        self.breaks = (float(self.times[0]), float(self.times[-1])) if ends == "rest" else ()
        self._spline = self._made()

    def __call__(self, t: ArrayLike) -> Motion:
        t, (start, end) = np.asarray(t, dtype=float), self.times[[0, -1]]
        outside = (t < start) | (t > end)
        if self.ends == "free" and outside.any():
            found = float(t[outside].ravel()[0])
            what = f"expected a time from {start:g} to {end:g} s, between the points, found t = {found:g} s"
            raise TrajectoryError(what).about("t", found=found)
        at = np.clip(t, start, end)
        return Motion(self._spline(at), self._spline(at, 1), self._spline(at, 2))

    def _made(self) -> Any:
        from scipy.interpolate import make_interp_spline

        still = [(order, np.zeros(self.dimension)) for order in (1, 2)]
        rest = {"bc_type": (still, still)} if self.ends == "rest" else {}
        return make_interp_spline(self.times, self.points, k=DEGREE, **rest)
