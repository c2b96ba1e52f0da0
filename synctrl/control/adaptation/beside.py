"""A state of the controller's own that rides behind that of an adaptation, whatever learns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .protocol import BoundAdaptation, Seen, after_sample


class Beside:
    """`BoundAdaptation` whose z is that of an adaptation, and behind it k further numbers in every row.

    It learns as the adaptation does. Subclasses say how their own numbers move, by `rate`, and what they do.

    Args:
        adaptation: what learns, for the robots of a cell.
        own: the further numbers of every robot at t = 0, (k,).

    Attributes:
        adaptation: what learns.
    """

    def __init__(self, adaptation: BoundAdaptation, own: ArrayLike):
        self.adaptation: Any = adaptation
        first = adaptation.start()
        self._Z, self._first = first.shape[1], np.concatenate((first, np.tile(own, (len(first), 1))), axis=1)

    def learned(self, z: np.ndarray) -> np.ndarray:
        """State of the adaptation in states z, (..., n, Z + k): (..., n, Z)."""
        return z[..., : self._Z]

    def own(self, z: np.ndarray) -> np.ndarray:
        """What is behind it, (..., n, k)."""
        return z[..., self._Z :]

    def start(self) -> np.ndarray:
        return self._first.copy()

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return self.adaptation.estimate(self.learned(z))

    def settle(self, z: np.ndarray) -> np.ndarray:
        learned = self.learned(z)
        settled = self.adaptation.settle(learned)
        return z if settled is learned else np.concatenate((settled, self.own(z)), axis=1)

    def leap(self, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
        """What is learned as the adaptation has it, and what is behind it along its rate."""
        learned = after_sample(self.adaptation, self.learned(z), self.learned(z_dot), h)
        return np.concatenate((learned, self.own(z) + h * self.own(z_dot)), axis=1)

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        return self.adaptation.storage(self.learned(z), theta)

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        return self.adaptation.storage_rate(self.learned(z), self.learned(z_dot), theta)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        return self.adaptation.powers(self.learned(z), theta, seen)
