"""What a space measures of robots at an instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .redundancy import Inversion


@dataclass(slots=True)
class Measurement:
    """Task coordinates of all robots and their desired motion, such that e' = xd' - x'.

    Attributes:
        motion: x and x', (2, n, m).
        error: e and e', (2, n, m).
        rates: xd' and xd'', (2, n, m).
        J, J_inv, J_dot: (n, m, nv), (n, nv, m) and (n, m, nv), or None in joint space. J_inv is J^-1, or a
            right inverse of a redundant arm's J.
        inversion: how J_inv was found.
    """

    motion: np.ndarray
    error: np.ndarray
    rates: np.ndarray
    J: np.ndarray | None = None
    J_inv: np.ndarray | None = None
    J_dot: np.ndarray | None = None
    inversion: Inversion | None = None

    x = property(lambda self: self.motion[0])
    x_dot = property(lambda self: self.motion[1])
    e = property(lambda self: self.error[0])
    e_dot = property(lambda self: self.error[1])
    xd_dot = property(lambda self: self.rates[0])
    xd_ddot = property(lambda self: self.rates[1])

    @property
    def orientation(self) -> np.ndarray:
        """Sizes of the orientation errors of poses, (..., 1), rad."""
        return np.sqrt((self.error[0][..., 3:] ** 2).sum(-1, keepdims=True))

    @property
    def condition(self) -> np.ndarray:
        """Condition numbers of the Jacobians by the Frobenius norm, (..., 1)."""
        return np.sqrt(_sum_of_squares(self.J) * _sum_of_squares(self.J_inv))


def _sum_of_squares(A: Any) -> np.ndarray:
    """Of all entries, (..., 1)."""
    return (A * A).reshape(*A.shape[:-2], -1).sum(-1, keepdims=True)
