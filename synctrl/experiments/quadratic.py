"""A synchronization function that is not linear: example 3 of the paper, and why it cannot be controlled.

f = x_1^T x_1 + x_2^T x_2 - A = 0 with a number A. About the desired motion, eq. (5) reads

    c_1 e_1 + c_2 e_2 + e_1^T e_1 + e_2^T e_2 = 0   with   c_i = -2 xd_i^T.

The paper prints -2 for the coefficients of the second order; they are +1. The c_i are row vectors without
an inverse, so that the theorems do not cover this function even to first order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..coupling.expansion import Expansion
from ..coupling.synchronization import SynchronizationFunction
from ..errors import SynchronizationError
from ..tasks.trajectories import Circle

RADII = (0.3, 0.4)  # m
SPEED, DURATION = 1.0, 6.0  # rad/s, s


@dataclass(frozen=True)
class Analysis:
    """What is known of a synchronization function that is not linear.

    Attributes:
        expansion: its terms of first and second order on the desired motion.
        refusal: why it is not controlled.
    """

    expansion: Expansion
    refusal: str

    def __str__(self) -> str:
        return f"{self.expansion}\nrefused: {self.refusal}"


def desired_motion() -> tuple[Circle, Circle]:
    """Two circles about the origin, on which f = 0."""
    first, second = (Circle((0.0, 0.0), radius, SPEED) for radius in RADII)
    return first, second


def quadratic_analysis(t: float = 0.0) -> Analysis:
    """Expand the function on the desired motion, and ask for its coupling.

    Args:
        t: where on the motion, s.
    """
    A, paths = sum(radius**2 for radius in RADII), desired_motion()
    function = SynchronizationFunction(lambda x_1, x_2, t: x_1 @ x_1 + x_2 @ x_2 - A, 2, 2, unit="m")
    expansion = function.expand(np.array([path(t).x for path in paths]), t)
    try:
        function.coupling(paths, DURATION)
    except SynchronizationError as error:
        return Analysis(expansion, str(error))
    return Analysis(expansion, "")
