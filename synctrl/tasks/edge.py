"""The frame of a nozzle that goes along a closed edge in the plane of a plate.

The nozzle points at the edge along a = R_e e_z, from the distance d. It is tilted by gamma to the outside in
the plane normal to the edge, and does not turn with the tangent, for else the wrist would wind up by a whole
turn a lap. With t, n and kappa of `ClosedCurve` and z across the plane,

    R_e = exp(gamma t) R_down,   w_e = kappa ((1 - cos gamma) z - sin gamma n),   R_e' = [w_e] R_e
    rho = p - d a,   rho' = t - d w_e x a,   rho'' = -kappa n - d (w_e' x a + w_e x a'),   a' = w_e x a

where a prime is a derivative along the edge. Where kappa jumps, a tilted nozzle would jump in velocity.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_number, instance, non_negative_number
from ..errors import InputError
from .closed_curve import DRAWN, ClosedCurve, sampled
from .poses import PoseTrajectory, Turning, check_dimension
from .rotations import exp
from .trajectories import Motion, Trajectory
from .ways import over_time

DOWN, Z = np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1.0])


class NozzleFrame(NamedTuple):
    """The frame of a nozzle along an edge, in the axes of the plate, with its derivatives by arc length.

    Attributes:
        rho, rho_s, rho_ss: place, (..., 3), m, and its derivatives.
        R: orientation, (..., 3, 3).
        w, w_s: w_e of R' = [w_e] R, (..., 3), rad/m, and its derivative.
    """

    rho: np.ndarray
    rho_s: np.ndarray
    rho_ss: np.ndarray
    R: np.ndarray
    w: np.ndarray
    w_s: np.ndarray


class Edge(ClosedCurve):
    """A closed edge in the plane z = 0 of a plate, and how a nozzle stands to it.

    Args:
        points: see `ClosedCurve`.
        tilt: gamma, by which the nozzle is tilted to the outside, rad, below a right angle.
        stand_off: d, distance of the nozzle from the edge, m.

    Raises:
        InputError: see `ClosedCurve`; or a nozzle that is further outside than the edge bends inwards there.

    Attributes:
        tilt, stand_off: as given.
    """

    def __init__(self, points: ArrayLike, tilt: float = 0.0, stand_off: float = 0.0):
        super().__init__(points)
        self.tilt, self.stand_off = finite_number("tilt", tilt), non_negative_number("stand_off", stand_off)
        if not abs(self.tilt) < np.pi / 2:
            raise InputError.expected("an angle below a right one", self.tilt, "tilt")
        self._check_offset()

    @classmethod
    def of(
        cls,
        curve: Callable[[float], ArrayLike],
        period: float = 2 * np.pi,
        tilt: float = 0.0,
        stand_off: float = 0.0,
    ) -> Self:
        """The edge along a function of any parameter.

        Args:
            curve, period: see `sampled`.
            tilt, stand_off: see `Edge`.

        Raises:
            InputError: see `Edge` and `sampled`; or a curvature that jumps, if the nozzle is tilted.
        """
        tilt, (points, smooth) = finite_number("tilt", tilt), sampled(curve, period)
        if tilt and not smooth:
            raise InputError.expected(
                "an edge whose curvature does not jump, for a nozzle that is tilted", tilt, "tilt"
            )
        return cls(points, tilt, stand_off)

    def nozzle(self, s: ArrayLike) -> NozzleFrame:
        """The frame of the nozzle at arc lengths s, (...), m."""
        p, t, n, kappa, kappa_s = self.at(s)
        lean, d = np.sin(self.tilt), self.stand_off
        axis = (1 - np.cos(self.tilt)) * Z - lean * n
        w, w_s = kappa * axis, kappa_s * axis - kappa**2 * lean * t
        R = exp(self.tilt * t) @ DOWN
        a = R[..., 2]
        a_s = np.cross(w, a)
        a_ss = np.cross(w_s, a) + np.cross(w, a_s)
        return NozzleFrame(p - d * a, t - d * a_s, -kappa * n - d * a_ss, R, w, w_s)

    def _check_offset(self) -> None:
        """Refuse a nozzle that would stand still or go back somewhere while the edge goes on."""
        s, off = self.length * np.arange(10 * DRAWN) / (10 * DRAWN), self.stand_off * np.sin(self.tilt)
        kappa = self.at(s).kappa[:, 0]
        worst = int(np.argmin(off * kappa))
        if off * kappa[worst] <= -1:
            radius, place = 1 / abs(float(kappa[worst])), float(s[worst])
            what = f"a nozzle less than {radius:.3g} m beside the edge, as it bends at {place:.3g} m"
            raise InputError.expected(what, float(abs(off)), "stand_off")


class AlongEdge(PoseTrajectory):
    """Motion of a nozzle's frame along an edge, in the axes of the plate.

    Args:
        edge: the edge.
        way: s(t), the arc length over time, a trajectory of one number, m.

    Raises:
        InputError: no edge, or no such trajectory.
    """

    def __init__(self, edge: Edge, way: Trajectory):
        instance("edge", edge, Edge, "an Edge")
        check_dimension("way", way, 1)
        self.edge, self.way = edge, way
        super().__init__(_Places(edge, way), _Turns(edge, way))

    def tangent(self, t: ArrayLike) -> np.ndarray:
        """Tangents of the edge where the frame is at times t, (...), s: (..., 3)."""
        return self.edge.at(self.way(t).x[..., 0]).t


class _Along:
    """Something of the nozzle's frame along an edge over time."""

    def __init__(self, edge: Edge, way: Trajectory):
        self.edge, self.way, self.breaks = edge, way, tuple(way.breaks)


class _Places(_Along):
    dimension = 3

    def __call__(self, t: ArrayLike) -> Motion:
        way = self.way(t)
        rho, *by_length = self.edge.nozzle(way[0][..., 0])[:3]
        return Motion(rho, *over_time(way, *by_length))


class _Turns(_Along):
    def __call__(self, t: ArrayLike) -> Turning:
        way = self.way(t)
        R, *by_length = self.edge.nozzle(way[0][..., 0])[3:]
        return Turning(R, *over_time(way, *by_length))
