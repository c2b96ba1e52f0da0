"""Adaptation that forgets: estimates are drawn back to what they began with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...checks import positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...tasks.algebra import limited
from ..gains import RaggedGain
from .gradient import MetricGradient, metric_of
from .metric import Metric, distance, listed, read_metric
from .protocol import Seen


class Rate(Protocol):
    """How fast estimates leak."""

    def nu(self, far: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Rate of each robot, (n,), 1/s.

        Args:
            far: |theta_hat - theta_hat0| in the norm of Gamma^+, (n,), sqrt(N·m).
            speed: |s_q|, (n,), rad/s.
        """

    def as_dict(self) -> dict[str, float | str]:
        """Name and settings as plain data."""


class Sigma(NamedTuple):
    """A constant rate sigma: everything stays bounded; without disturbance it costs convergence.

    Args:
        sigma: 1/s.
    """

    sigma: float

    def nu(self, far: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return self.sigma + 0.0 * far

    def as_dict(self) -> dict[str, float | str]:
        return {"name": "Sigma", "sigma": self.sigma}


class Switching(NamedTuple):
    """nu = sigma clip(far/radius - 1, 0, 1): no leakage within the radius.

    If theta is within the radius of theta_hat0, the power of the leakage is at most 0 and the theorem stays.

    Args:
        sigma: 1/s.
        radius: sqrt(N·m).
    """

    sigma: float
    radius: float

    def nu(self, far: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return self.sigma * limited(far / self.radius - 1, 0.0, 1.0)

    def as_dict(self) -> dict[str, float | str]:
        return {"name": "Switching", "sigma": self.sigma, "radius": self.radius}


class EModification(NamedTuple):
    """nu = sigma |s_q|: bounded; without disturbance it converges only to a set.

    Args:
        sigma: 1/rad.
    """

    sigma: float

    def nu(self, far: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return self.sigma * speed

    def as_dict(self) -> dict[str, float | str]:
        return {"name": "EModification", "sigma": self.sigma}


class Leakage:
    """theta_hat' = Gamma Y^T s_q - nu (theta_hat - theta_hat0).

    The leakage is a rate, the same for every entry whatever its unit. Its power is "leakage",
    nu tilde^T Gamma^+ (theta_hat - theta_hat0) <= -nu V_th + nu/2 |theta - theta_hat0|^2 in the norm of
    Gamma^+.

    Args:
        Gamma: as in `Gradient`.
        rate: nu, a number in 1/s, or `Sigma(sigma)`, `Switching(sigma, radius)` or `EModification(sigma)`.

    Raises:
        InputError: a Gamma that `Gradient` would not take, or rates or a radius that are not above 0.
    """

    def __init__(self, Gamma: ArrayLike | RaggedGain, rate: float | Rate):
        self.Gamma = read_metric(Gamma)
        self.rate = read_rate(rate)

    def bind(self, cell: Cell) -> BoundLeakage:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma of another size.
        """
        return BoundLeakage(cell, metric_of(self.Gamma, cell), self.rate)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Leakage", "Gamma": listed(self.Gamma), "rate": dict(self.rate.as_dict())}


class BoundLeakage(MetricGradient):
    """`Leakage` for the robots of a cell."""

    def __init__(self, cell: Cell, metric: Metric, rate: Rate):
        super().__init__(cell, metric)
        self._rate = rate

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return super().rate(z, seen) - self.nu(z, seen)[:, None] * (z - self.theta_hat0)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        drawn = (self.metric.lowered(theta - z) * (z - self.theta_hat0)).sum(axis=1)
        return {**super().powers(z, theta, seen), "leakage": float(np.sum(self.nu(z, seen) * drawn))}

    def nu(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        """Rate of each robot, (n,), 1/s."""
        speed = np.sqrt((seen.s_q**2).sum(axis=1))
        return self._rate.nu(distance(self.metric, z - self.theta_hat0), speed)


def read_rate(rate: Any) -> Rate:
    """A rate of leakage as its user gives it."""
    if hasattr(rate, "nu"):
        for name, value in getattr(rate, "_asdict", dict)().items():
            positive_number(f"rate, {name}", value)
        return rate
    if isinstance(rate, (int, float, np.number)):
        return Sigma(positive_number("rate", rate))
    raise InputError.expected("a number in 1/s, or for example Switching(1.0, radius=2.0)", rate, "rate")
