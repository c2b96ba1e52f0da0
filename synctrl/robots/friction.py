"""Joint friction of the true plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, positive_number
from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Friction:
    """Viscous and smoothed Coulomb friction: viscous v + coulomb tanh(v / smoothing).

    Args:
        viscous: number or (nv,), N·m·s/rad.
        coulomb: number or (nv,), N·m.
        smoothing: velocity at which Coulomb friction reaches tanh(1) of its value, rad/s.

    Raises:
        InputError: not finite, negative, or a smoothing velocity that is not positive.
    """

    viscous: Any = 0.0
    coulomb: Any = 0.0
    smoothing: float = 0.01

    def __post_init__(self) -> None:
        for name in ("viscous", "coulomb"):
            array = finite_array(name, getattr(self, name))
            if array.size and array.min() < 0:
                raise InputError.expected("coefficients of at least 0", array.min(), name)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "smoothing", positive_number("smoothing", self.smoothing))

    def equals(self, other: Friction) -> bool:
        """Whether another friction gives the same torques; the smoothing counts where it has a use."""
        same_curve = self.smoothing == other.smoothing or not self.coulomb.any()
        pairs = (self.viscous, other.viscous), (self.coulomb, other.coulomb)
        return same_curve and all(bool(np.all(mine == its)) for mine, its in pairs)

    def torque(self, v: np.ndarray) -> np.ndarray:
        """Torque by which friction opposes the velocities v, (..., nv), in N·m."""
        return friction_torque(v, self.viscous, self.coulomb, self.smoothing)


def friction_torque(
    v: np.ndarray, viscous: np.ndarray, coulomb: np.ndarray, smoothing: ArrayLike
) -> np.ndarray:
    """viscous v + coulomb tanh(v / smoothing), by which friction opposes the velocities v, (..., nv), in N·m.

    Args:
        v: (..., nv), rad/s.
        viscous, coulomb, smoothing: see `Friction`; each a number or an array that fits v.
    """
    return viscous * v + coulomb * np.tanh(v / smoothing)
