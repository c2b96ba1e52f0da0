"""What is desired at one instant: motions and weights."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from ..checks import finite_array
from .weights import Weights


@dataclass(slots=True)
class Reference:
    """What is desired at one instant, or with a leading axis of time at several.

    Attributes:
        desired: xd, xd' and xd'', (3, n, m); then what else the space asks for, see `further` of `Space`.
        weights: c, c', c'' and c^-1, each (n, m, m).
        t: the instant, s, or all of them, (T,); NaN where nobody asks.
    """

    desired: np.ndarray
    weights: Weights
    t: Any = nan

    xd = property(lambda self: self.desired[..., 0, :, :])
    xd_dot = property(lambda self: self.desired[..., 1, :, :])
    xd_ddot = property(lambda self: self.desired[..., 2, :, :])
    c = property(lambda self: self.weights.c)
    c_dot = property(lambda self: self.weights.c_dot)
    c_ddot = property(lambda self: self.weights.c_ddot)
    c_inv = property(lambda self: self.weights.c_inv)

    def check(self, n: int, m: int, rows: int = 3) -> None:
        """Refuse what is no desired motion, of so many rows, and weights of n robots at one instant.

        Raises:
            InputError: another size, or numbers that are not finite.
        """
        finite_array("reference: xd, xd' and xd''", self.desired, (rows, n, m))
        for name, weight in zip(("c", "c'", "c''", "c^-1"), self.weights, strict=True):
            finite_array(f"reference: {name}", weight, (n, m, m))
