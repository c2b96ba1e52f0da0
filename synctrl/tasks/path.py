"""Paths: curves by their arc length s, with axes that go along, and motions along them.

The axes are F = [t n b]: t along growing s, n = up x t / |up x t| to the left of it, and b = t x n. They turn
with F_s = [w] F; on a plane curve whose normal is `up` this is w = kappa b, with the curvature kappa positive
where the path bends to the left.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, finite_array, finite_number, instance
from ..errors import TrajectoryError
from .poses import check_dimension
from .trajectories import Motion, Trajectory
from .ways import arc_lengths, chords, over_time

#: degree of the spline, three derivatives of which are continuous once it goes by arc length
DEGREE = 5
#: points at which a function is asked, and at least that many of the spline by arc length
SAMPLES, NODES = 600, 500
#: how far the length of a tangent of that spline may be off 1
UNEVEN = 1e-4
#: how close a tangent may come to `up`, as the sine of the angle between them
UPRIGHT = 0.05
#: steps of Newton's method to a projection, at most, and where they end, m
PROJECTIONS, PROJECTED = 8, 1e-10


class Place(NamedTuple):
    """A place on a path, or several.

    Attributes:
        position: (..., 3), m.
        bend: second derivative of the position by arc length, (..., 3), 1/m.
        axes: F = [t n b], (..., 3, 3).
        turn, turn_s: w and w_s, (..., 3), rad/m and rad/m^2.
    """

    position: np.ndarray
    bend: np.ndarray
    axes: np.ndarray
    turn: np.ndarray
    turn_s: np.ndarray

    @property
    def tangent(self) -> np.ndarray:
        """t, (..., 3)."""
        return self.axes[..., 0]


class Path:
    """A smooth curve through points, by arc length from 0 to `length`; beyond its ends it goes on straight.

    Args:
        points: at least 6 points in order, (k, 3), m.
        up: direction that is never along the path, (3,); the normal of a path in a plane.

    Raises:
        InputError: points that are none or too few, or two neighbours at one place.
        TrajectoryError: a sharp bend, or a path that goes along `up` somewhere.

    Attributes:
        points, up: as given.
        length: m.
    """

    def __init__(self, points: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)):
        self.points = through = finite_array("points", points, (None, 3))
        count("number of points", len(through), DEGREE + 1)
        self.up = finite_array("up", up, (3,))
        by_length, lengths = _by_length(through)
        self.length = float(lengths[-1])
        self._places = self._tabulated(by_length, lengths)

    @classmethod
    def from_function(
        cls,
        curve: Callable[[float], ArrayLike],
        start: float,
        end: float,
        up: ArrayLike = (0.0, 0.0, 1.0),
    ) -> Self:
        """The path that a function of one number goes, from `start` to `end`.

        Args:
            curve: number -> point, (3,), m; smooth.
            start, end, up: numbers, and as in `Path`.

        Raises:
            InputError, TrajectoryError: see `Path`; also no function, or points of another size.
        """
        instance("curve", curve, Callable, "a function of one number")  # type: ignore[arg-type]
        numbers = np.linspace(finite_number("start", start), finite_number("end", end), SAMPLES)
        return cls([finite_array(f"curve at {u:g}", curve(float(u)), (3,)) for u in numbers], up)

    def at(self, s: ArrayLike) -> Place:
        """The places at arc lengths s, (...), m."""
        s = np.asarray(s, dtype=float)
        on = np.minimum(np.maximum(s, 0.0), self.length)
        rows, beyond = self._places(on), s - on
        axes = rows[..., 6:15].reshape(*s.shape, 3, 3)
        if beyond.any():
            rows[..., :3] += beyond[..., None] * axes[..., 0]
            rows[beyond != 0, 3:6] = rows[beyond != 0, 15:] = 0.0
        return Place(rows[..., :3], rows[..., 3:6], axes, rows[..., 15:18], rows[..., 18:])

    def project(self, position: ArrayLike, near: ArrayLike) -> np.ndarray:
        """Arc lengths, (...), of the places next to positions, (..., 3), m, found from arc lengths near them.

        The positions have to be closer to the path than its radius of curvature.
        """
        p, s = np.asarray(position, dtype=float), np.asarray(near, dtype=float)
        for _ in range(PROJECTIONS):
            place = self.at(s)
            away = p - place.position
            step = (place.tangent * away).sum(-1) / (1 - (place.bend * away).sum(-1))
            s = s + step
            if (np.abs(step) < PROJECTED).all():
                break
        return s

    # -- internals ----------------------------------------------------------------------------------------

    def _tabulated(self, by_length: Any, lengths: np.ndarray) -> Any:
        """A spline through the numbers of `Place` at some arc lengths."""
        from scipy.interpolate import make_interp_spline

        r, r_s, bend, bend_s = (by_length(lengths, k) for k in range(4))
        self._refuse_bends(lengths, r_s)
        axes = _axes(r_s, self.up)
        parts = r, bend, axes.reshape(-1, 9), *_turning(axes, bend, bend_s, self.up)
        return make_interp_spline(lengths, np.concatenate(parts, axis=1), k=DEGREE)

    def _refuse_bends(self, lengths: np.ndarray, tangents: np.ndarray) -> None:
        off = np.abs(np.linalg.norm(tangents, axis=1) - 1)
        if not off.max() < UNEVEN:
            at = float(lengths[np.argmax(off)])
            sharp = f"expected points close enough for a smooth curve, found a sharp bend at s = {at:.3g} m"
            raise TrajectoryError(sharp, subject="points", found=at)
        sine = np.linalg.norm(np.cross(self.up, tangents), axis=1)
        if not sine.min() > UPRIGHT * np.linalg.norm(self.up):
            at = float(lengths[np.argmin(sine)])
            along = f"expected a direction that the path never takes, found it taken at s = {at:.3g} m"
            raise TrajectoryError(along, subject="up", found=at)


class AlongPath:
    """A desired motion along a path.

    Args:
        path: the path.
        way: arc length over time, a trajectory of one number, m.

    Raises:
        InputError: no path, or no trajectory of one number.
    """

    dimension = 3

    def __init__(self, path: Path, way: Trajectory):
        instance("path", path, Path, "a Path")
        check_dimension("way", way, 1)
        self.path, self.way, self.breaks = path, way, tuple(way.breaks)

    def __call__(self, t: ArrayLike) -> Motion:
        way = self.way(t)
        place = self.path.at(way[0][..., 0])
        return Motion(place.position, *over_time(way, place.tangent, place.bend))

    def lag(self, t: float, position: np.ndarray) -> float:
        """How far a position, (3,), next to the path is behind where it should be at t, s: m along the path.

        A robot that is to stand still is not behind.
        """
        s, speed, _ = (float(part[0]) for part in self.way(t))
        return float(np.sign(speed)) * (s - float(self.path.project(position, s)))


# -- internals ---------------------------------------------------------------------------------------------


def _by_length(points: np.ndarray) -> tuple[Any, np.ndarray]:
    """A spline by arc length through points, and the arc lengths of its nodes, m."""
    from scipy.interpolate import make_interp_spline

    numbers = np.append(0.0, np.cumsum(chords(points)))
    curve = make_interp_spline(numbers, points, k=DEGREE)
    edges = np.linspace(0.0, numbers[-1], max(NODES, len(points)))
    lengths = np.append(0.0, np.cumsum(arc_lengths(curve, edges[:-1], edges[1:])))
    return make_interp_spline(lengths, curve(edges), k=DEGREE), lengths


def _axes(tangent: np.ndarray, up: np.ndarray) -> np.ndarray:
    """F = [t n b], (..., 3, 3)."""
    t, left = (a / np.linalg.norm(a, axis=-1, keepdims=True) for a in (tangent, np.cross(up, tangent)))
    return np.stack((t, left, np.cross(t, left)), axis=-1)


def _turning(
    axes: np.ndarray, bend: np.ndarray, bend_s: np.ndarray, up: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """w = t x t_s + q t and w_s, (..., 3), with the q = (up x t_s) b / |up x t| that keeps n level."""
    t, n, b = np.moveaxis(axes, -1, 0)
    size, level, level_s = (_dot(np.cross(up, x), y) for x, y in ((t, n), (bend, b), (bend_s, b)))
    q = level / size
    turn = np.cross(t, bend) + q * t
    grown = _dot(np.cross(up, bend), n)  # of size
    q_s = (level_s + _dot(np.cross(up, bend), np.cross(turn, b)) - q * grown) / size
    return turn, np.cross(t, bend_s) + q_s * t + q * bend


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1, keepdims=True)
