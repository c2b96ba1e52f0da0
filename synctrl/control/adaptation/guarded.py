"""Adaptation that does not learn faster than its loop can follow.

Estimates and velocity errors make a loop, s_q'' = -M^-1 Y Gamma Y^T s_q where nothing else acts. Its
frequency grows with the reference motion, so errors that torque limits keep from being corrected make it too
fast for any step or sampling period. The guard slows learning down there, for each robot by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array, instance, offers, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...tasks.algebra import limited
from .gradient import metric_of
from .metric import distance, read_metric
from .projection import Ball
from .protocol import Adaptation, Seen

#: 1/s; what a step of 1 ms follows
RATE = 300.0
#: radius of the ball that a saturating experiment has by default, over the distance of what it is to hold
ROOM = 1.5
#: error of theta_hat0 that it is to hold at least, as a share of theta
UNKNOWN = 0.2


class Guarded:
    """An adaptation whose gradient is multiplied by p = min(1, rate^2 / tr(Gamma Y^T M_0^-1 Y)).

    M_0 is the mass matrix of the robot's description at q0, which stands for a lower bound of all others. The
    power is "guard", (1 - p) s_q^T Y tilde, of either sign. With p = 1 it is the adaptation itself, bit for
    bit.

    Args:
        adaptation: one with a Gamma: `Gradient`, `Leakage`, `Box` or `Ball`.
        rate: fastest loop, 1/s, above 0; by default 300, 0.3 over a step of 1 ms.

    Raises:
        InputError: no adaptation, or a rate that is not above 0.
    """

    def __init__(self, adaptation: Adaptation, rate: float = RATE):
        offers("adaptation", adaptation, ("bind", "as_dict"), "an adaptation, for example Ball(0.3, 2.0)")
        self.adaptation, self.rate = adaptation, positive_number("rate", rate)

    def bind(self, cell: Cell) -> BoundGuarded:
        """This adaptation for a cell.

        Raises:
            InputError: an adaptation without a Gamma, or whose Gamma may change, or one that does not fit.
        """
        inner: Any = self.adaptation.bind(cell)
        if not hasattr(getattr(inner, "metric", None), "raised"):  # of `Composite` it is one of each state
            raise InputError(
                "Guarded expects an adaptation with one Gamma, for example Gradient, Leakage, Box or Ball, "
                f"found {type(self.adaptation).__name__}",
                subject="adaptation",
                found=type(self.adaptation).__name__,
            )
        return BoundGuarded(cell, inner, self.rate)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Guarded", "rate": self.rate, "adaptation": self.adaptation.as_dict()}


class BoundGuarded:
    """`Guarded` for the robots of a cell; its state is that of the adaptation it slows down."""

    def __init__(self, cell: Cell, adaptation: Any, rate: float):
        self._adaptation, self.metric, self._square = adaptation, adaptation.metric, rate**2
        self.start, self.estimate, self.settle = adaptation.start, adaptation.estimate, adaptation.settle
        self.storage, self.storage_rate = adaptation.storage, adaptation.storage_rate
        self._root = np.zeros((cell.n, cell.nv, cell.nv))
        for root, robot, q in zip(self._root, cell.robots, cell.q0, strict=True):
            nv = robot.nv
            root[:nv, :nv] = np.linalg.inv(np.linalg.cholesky(robot.mass_matrix(q[:nv])))

    @property
    def Gamma(self) -> np.ndarray:  # noqa: N802
        """Gamma of the adaptation, (n, P) or (n, P, P)."""
        return self.metric.Gamma

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self._adaptation.rate(z, self._slowed(seen))

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        slowed = self._slowed(seen)
        lost = (seen.gradient - slowed.gradient) * (theta - self.estimate(z))
        return {**self._adaptation.powers(z, theta, slowed), "guard": float(np.sum(lost))}

    def share(self, seen: Seen) -> np.ndarray:
        """p of each robot, (n,)."""
        rows = (self._root @ seen.regressor).swapaxes(0, 1)
        trace = sum((row * self.metric.raised(row)).sum(axis=1) for row in rows)
        return self._square / limited(np.asarray(trace), self._square, np.inf)

    def _slowed(self, seen: Seen) -> Seen:
        """What the adaptation sees instead: p Y for Y."""
        p = self.share(seen)
        return replace(seen, gradient=p[:, None] * seen.gradient, regressor=p[:, None, None] * seen.regressor)


def bounded(cell: Cell, Gamma: Any, carried: ArrayLike = 0.0) -> Guarded:
    """(14) that stays bounded whatever torque is cut off: guarded, in a ball that holds the truth.

    The radius is 1.5 times the distance of theta from theta_hat0 in the norm of Gamma^+, or of 20 % of theta
    if that is more, and of what is carried. Who runs a simulation knows theta; on real robots a `Ball` takes
    a radius that is believed.

    Args:
        cell: the robots.
        Gamma: as in `Gradient`.
        carried: what payloads add to the parameters of all robots, or of each, (n,), as a share of theta.

    Raises:
        InputError: no cell, a Gamma that `Gradient` would not take, or Gamma or shares of another size.
    """
    instance("cell", cell, Cell, "a Cell")
    more = finite_array("carried", carried)
    if more.shape not in ((), (cell.n,)):
        raise InputError.expected(f"a number or shape ({cell.n},)", more.shape, "carried")
    metric = metric_of(read_metric(Gamma), cell)
    error, size = (distance(metric, part) for part in (cell.theta - cell.theta_hat0, cell.theta))
    radius = ROOM * (np.maximum(error, UNKNOWN * size) + more * size)
    return Guarded(Ball(Gamma, np.where(radius > 0, radius, 1.0)))  # any serves where nothing is adapted
