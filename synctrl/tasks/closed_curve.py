"""A closed curve in a plane, by arc length: a periodic spline through points.

With the tangent t, counter-clockwise, the normal n to the outside and the curvature kappa, t' = -kappa n and
n' = kappa t along the curve.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number
from ..errors import InputError
from .ways import arc_lengths, chords

#: points in which a curve is drawn and looked at
DRAWN = 400
#: steps of Newton's method from an arc length to its parameter
STEPS = 4
#: how far a spline through a function may miss it, as a share of its size: of a smooth one, and of any
SMOOTH, FOLLOWED = 1e-9, 1e-5
#: size of a curve, m, beyond which numbers do not go on
LARGEST = 1e9
#: points of a function, from the fewest to the most
FEWEST, MOST = 32, 4096


class CurvePoint(NamedTuple):
    """Points of a curve: place, tangent and outward normal, (..., 3), curvature and its derivative, (..., 1).

    In m, 1/m and 1/m^2; z is 0, and the curvature is positive where the curve bends as a circle does.
    """

    p: np.ndarray
    t: np.ndarray
    n: np.ndarray
    kappa: np.ndarray
    kappa_s: np.ndarray


class ClosedCurve:
    """A closed curve through points in the plane z = 0: a periodic spline of degree five.

    Its curvature is continuous; where the points have a corner, it goes round that in a bow.

    Args:
        points: counter-clockwise, the last one equal to the first, (N, 2), N > 6, m.

    Raises:
        InputError: an open curve, one that crosses itself or goes clockwise, or points that are equal one
            after another.

    Attributes:
        points: as given.
        length: m.
    """

    def __init__(self, points: ArrayLike):
        self.points, self._u = _closed(points)
        p = self.points
        self._spline = _periodic(self._u, p)
        self._s = np.append(0.0, np.cumsum(arc_lengths(self._spline, self._u[:-1], self._u[1:])))
        self.length = float(self._s[-1])
        _check_outline(self.outline())

    def at(self, s: ArrayLike) -> CurvePoint:
        """Points at arc lengths s, (...), m, of any size: after a lap it goes on from the beginning."""
        u = self._parameter(np.asarray(s, dtype=float))
        p, p_u, p_uu, p_uuu = (self._spline(u, k) for k in range(4))
        speed = np.linalg.norm(p_u, axis=-1)
        bend = _cross(p_u, p_uu)
        kappa = bend / speed**3
        kappa_u = _cross(p_u, p_uuu) / speed**3 - 3 * bend * np.vecdot(p_u, p_uu) / speed**5
        t = p_u / speed[..., None]
        n = np.stack((t[..., 1], -t[..., 0]), axis=-1)
        p, t, n = (np.insert(part, 2, 0.0, axis=-1) for part in (p, t, n))
        return CurvePoint(p, t, n, kappa[..., None], (kappa_u / speed)[..., None])

    def outline(self, count: int = DRAWN) -> np.ndarray:
        """Points at equal distances along the curve, (count, 3), m."""
        return self.at(self.length * np.arange(count) / count).p

    def _parameter(self, s: np.ndarray) -> np.ndarray:
        """u at arc lengths s, by Newton's method from the point before."""
        s = s % self.length
        piece = np.clip(np.searchsorted(self._s, s, side="right") - 1, 0, len(self._s) - 2)
        start, left = self._u[piece], s - self._s[piece]
        u = start + left / (self._s[piece + 1] - self._s[piece]) * (self._u[piece + 1] - start)
        for _ in range(STEPS):
            missed = arc_lengths(self._spline, start, u) - left
            u = u - missed / np.linalg.norm(self._spline(u, 1), axis=-1)
        return u


def sampled(curve: Callable[[float], ArrayLike], period: float) -> tuple[np.ndarray, bool]:
    """Points of a function, (N, 2), m, close enough for a spline to follow it, and whether it is smooth.

    Args:
        curve: of a number from 0 to `period`, at which it is where it began; gives points, (2,), m.
        period: in the unit of that number.

    Raises:
        InputError: no function of points, no period, or a curve with a corner.
    """
    instance("curve", curve, Callable, "a function of one number")  # type: ignore[arg-type]
    period, count = positive_number("period", period), FEWEST
    while True:
        u = period * np.arange(2 * count + 1) / (2 * count)
        fine, _ = _closed([finite_array("curve", curve(x), (2,)) for x in u.tolist()])
        missed = np.abs(_periodic(u[::2], fine[::2])(u[1::2]) - fine[1::2]).max() / np.ptp(fine, axis=0).max()
        if missed < SMOOTH or count >= MOST:
            break
        count *= 2
    if missed > FOLLOWED:
        raise InputError.expected("a curve without corners, or points", float(missed), "curve")
    return fine, bool(missed < SMOOTH)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _closed(points: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points that end where they began, each away from the one before, and the chords' length up to each."""
    p = finite_array("points", points, (None, 2))
    if len(p) < 7:
        raise InputError.expected("at least 7 points", len(p), "points")
    size, gap = float(np.ptp(p, axis=0).max()), float(np.linalg.norm(p[-1] - p[0]))
    if size > LARGEST:
        raise InputError.expected(f"points within {LARGEST:g} m", size, "points")
    if gap > 1e-9 * size:
        raise InputError.expected("a closed curve, of which the last point is the first", gap, "points")
    return p, np.append(0.0, np.cumsum(chords(p)))


def _periodic(u: np.ndarray, p: np.ndarray) -> Any:
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(u, np.append(p[:-1], p[:1], axis=0), k=5, bc_type="periodic")


def crossing(points: np.ndarray) -> tuple[int, int] | None:
    """The first two sides, counted from 0, of a closed polygon that cross; None if none do.

    Args:
        points: corners in order, (N, 2); side k goes from point k to the next.
    """
    ends = np.roll(points, -1, axis=0)
    left = [_cross((ends - points)[:, None], some[None] - points[:, None]) > 0 for some in (points, ends)]
    parted = left[0] != left[1]  # [i, j]: the ends of side j lie on different sides of side i
    crossed = np.triu(parted & parted.T, k=2)
    crossed[0, -1] = False  # the last side ends where the first one begins
    found = np.argwhere(crossed)
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


def _check_outline(outline: np.ndarray) -> None:
    """Refuse a curve that crosses itself or goes clockwise."""
    a = outline[:, :2]
    if (pair := crossing(a)) is not None:
        raise InputError.expected("a curve that does not cross itself", a[pair[0]], "points")
    area = 0.5 * float(_cross(a, np.roll(a, -1, axis=0)).sum())
    if area <= 0:
        raise InputError.expected("a curve that goes counter-clockwise, of an area above 0", area, "points")
