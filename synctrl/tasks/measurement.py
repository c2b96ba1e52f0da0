"""What a space measures of robots at an instant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

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


def limits_of(space: Any) -> Mapping[str, float]:
    """Names and limits of what a `BoundSpace` watches, in the order in which they are looked at."""
    return getattr(space, "limits", {})


class Beyond(NamedTuple):
    """A number of a robot that makes its task coordinates mean nothing.

    Attributes:
        name: what it is, as the space calls it.
        robot: index of the robot, counted from 0.
        value: the number, NaN if it is none.
        limit: what it should have been below.
    """

    name: str
    robot: int
    value: float
    limit: float


def first_beyond(space: Any, task: Measurement) -> Beyond | None:
    """The first number that has reached its limit, or is none, in the order of the space's limits.

    Args:
        space: a `BoundSpace`; one without `limits` has nothing to look at.
        task: what it measured.
    """
    limits = limits_of(space)
    if not limits:
        return None
    values = space.watched(task)
    beyond = ~(values < [*limits.values()])
    if not beyond.any():
        return None
    k, robot = divmod(int(beyond.T.argmax()), len(values))
    name, limit = [*limits.items()][k]
    return Beyond(name, robot, float(values[robot, k]), limit)


def _sum_of_squares(A: Any) -> np.ndarray:
    """Of all entries, (..., 1)."""
    return (A * A).reshape(*A.shape[:-2], -1).sum(-1, keepdims=True)
