"""Adaptation within bounds: estimates stay in a convex set that is known to hold the truth.

The part of the rate that points outwards is taken away in a layer inside the border, so that the rate stays
Lipschitz. What a step still carries across the border is projected back afterwards, in the norm of Gamma^+:
so estimates come no farther from any point of the set, and the storage cannot rise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...tasks.algebra import limited
from ..gains import RaggedGain, spread_rows
from .gradient import MetricGradient, metric_of
from .metric import Metric, distance, listed, read_metric
from .protocol import Seen

#: width of the layer of a box, as a share of the box
BOX_LAYER = 0.05
#: width of the layer of a ball, as a share of the radius
BALL_LAYER = 0.1
#: instead of a length of zero, by which nothing is divided
TINY = 1e-300


class Box:
    """(14) with every entry of theta_hat between two bounds.

    Outward rates fade to 0 over a layer of 5 % of the width; the power "projection",
    tilde^T Gamma^+ (removed rate), is at most 0 if theta lies inside the layers.

    Args:
        Gamma: as in `Gradient`, but diagonal.
        lower, upper: bounds, (P,) or (n, P), in the units of theta.

    Raises:
        InputError: a full Gamma, or bounds that are not numbers or not lower below upper.
    """

    def __init__(self, Gamma: ArrayLike | RaggedGain, lower: ArrayLike, upper: ArrayLike):
        gain = read_metric(Gamma)
        if isinstance(gain, tuple):
            raise InputError(
                "expected a diagonal Gamma, because a box is projected on entry by entry, found matrices; "
                "Ball takes any Gamma",
                subject="Gamma",
            )
        self.Gamma = gain
        self.lower, self.upper = finite_array("lower", lower), finite_array("upper", upper)

    def bind(self, cell: Cell) -> BoundBox:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma or bounds of another size, or a first estimate outside.
        """
        sizes = [parameters.theta.size for parameters in cell.parameters]
        bounds = [spread_rows(name, getattr(self, name), sizes) for name in ("lower", "upper")]
        _check_box(cell, *bounds)
        return BoundBox(cell, metric_of(self.Gamma, cell), *bounds)

    def as_dict(self) -> dict[str, Any]:
        bounds = {"lower": self.lower.tolist(), "upper": self.upper.tolist()}
        return {"name": "Box", "Gamma": listed(self.Gamma), **bounds}


class Ball:
    """(14) with theta_hat within a distance of theta_hat0, in the norm of Gamma^+.

    The outward rate fades to 0 over a layer of 10 % of the radius; the power "projection",
    tilde^T Gamma^+ (removed rate), is at most 0 if theta lies within 90 % of the radius.

    Args:
        Gamma: as in `Gradient`.
        radius: sqrt(N·m), above 0; of all robots, or (n,).

    Raises:
        InputError: a Gamma that `Gradient` would not take, or a radius that is not above 0.
    """

    def __init__(self, Gamma: ArrayLike | RaggedGain, radius: ArrayLike):
        self.Gamma = read_metric(Gamma)
        self.radius = finite_array("radius", radius)
        for value in np.ravel(self.radius):
            positive_number("radius", float(value))

    def bind(self, cell: Cell) -> BoundBall:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma or radii of another size.
        """
        if self.radius.shape not in ((), (cell.n,)):
            raise InputError.expected(f"a number or shape ({cell.n},)", self.radius.shape, "radius")
        return BoundBall(cell, metric_of(self.Gamma, cell), np.broadcast_to(self.radius, cell.n))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Ball", "Gamma": listed(self.Gamma), "radius": self.radius.tolist()}


class Projected(MetricGradient, ABC):
    """(14) less a part that points outwards."""

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return super().rate(z, seen) - self.removed(z, seen.gradient)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        removed = self.metric.lowered(theta - z) * self.removed(z, seen.gradient)
        return {**super().powers(z, theta, seen), "projection": float(np.sum(removed))}

    @abstractmethod
    def removed(self, z: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """The rate that is taken away, (n, P)."""


class BoundBox(Projected):
    """`Box` for the robots of a cell."""

    def __init__(self, cell: Cell, metric: Metric, lower: np.ndarray, upper: np.ndarray):
        super().__init__(cell, metric)
        self.lower, self.upper = lower, upper
        self._layer = np.where(upper > lower, BOX_LAYER * (upper - lower), 1.0)  # none beyond a robot's own

    def removed(self, z: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        above = limited(1 - (self.upper - z) / self._layer, 0.0, 1.0)
        below = limited(1 - (z - self.lower) / self._layer, 0.0, 1.0)
        up, down = limited(gradient, 0.0, np.inf), limited(gradient, -np.inf, 0.0)
        return self.metric.raised(above * up + below * down)

    def settle(self, z: np.ndarray) -> np.ndarray:
        return limited(z, self.lower, self.upper)


class BoundBall(Projected):
    """`Ball` for the robots of a cell."""

    def __init__(self, cell: Cell, metric: Metric, radius: np.ndarray):
        super().__init__(cell, metric)
        self.radius = radius

    def removed(self, z: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """p Gamma n (n^T Gamma g)+/(n^T Gamma n), where Gamma n is theta_hat - theta_hat0, up to a factor."""
        far = z - self.theta_hat0
        length = distance(self.metric, far)
        inside = limited((length / self.radius - 1) / BALL_LAYER + 1, 0.0, 1.0)
        along = (far * gradient).sum(axis=1)
        share = inside * limited(along, 0.0, np.inf) / limited(length**2, TINY, np.inf)
        return share[:, None] * far

    def settle(self, z: np.ndarray) -> np.ndarray:
        far = z - self.theta_hat0
        length = distance(self.metric, far)
        excess = 1 - self.radius / limited(length, self.radius, np.inf)  # 0 inside, where z stays what it is
        return z - excess[:, None] * far


def _check_box(cell: Cell, lower: np.ndarray, upper: np.ndarray) -> None:
    """Refuse bounds that are not in order, or leave the first estimate outside."""
    for i, (name, parameters) in enumerate(zip(cell.names, cell.parameters, strict=True)):
        for k, what in enumerate(parameters.names):
            low, high, first = float(lower[i, k]), float(upper[i, k]), float(cell.theta_hat0[i, k])
            if not low < high:
                raise InputError(
                    f"expected lower below upper, found {low:g} and {high:g} for {what}",
                    subject=f"{name}, Box",
                    found=(low, high),
                )
            if not low <= first <= high:
                raise InputError.expected(
                    f"theta_hat0 of {what} from {low:g} to {high:g}", first, f"{name}, Box"
                )
