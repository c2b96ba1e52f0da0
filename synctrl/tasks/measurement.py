"""What is measured of robots at an instant: their tips, task coordinates, and when these mean nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..robots.forest import Forest, Selection, forests
from ..robots.robot import Robot
from .redundancy import Inversion

Positions = tuple[np.ndarray, np.ndarray, np.ndarray]
Poses = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Kinematics(Protocol):
    """Where tips are and how they move with the joints, in world axes: of all robots of a cell, or of one."""

    def positions(self, q: np.ndarray, v: np.ndarray) -> Positions:
        """Positions and velocities, (2, ..., 3), J of the velocities and its derivative, (..., 3, nv)."""

    def poses(self, q: np.ndarray, v: np.ndarray) -> Poses:
        """Positions and velocities, (2, ..., 3); rotation matrices, (..., 3, 3); then (..., 6, nv), twice."""


class Tips:
    """Where the tips of robots are and how they move with the joints, in world axes."""

    def __init__(self, robots: Sequence[Robot]):
        self._robots = robots

    @cached_property
    def _forests(self) -> list[tuple[Selection, Forest]]:
        return forests(self._robots)

    @cached_property
    def positions(self) -> Callable[[np.ndarray, np.ndarray], Positions]:
        """Positions and velocities of the tips, the velocities' Jacobians, and the Jacobians' derivatives.

        Of q and v, (n, nv), it gives (2, n, 3), m and m/s; then (n, 3, nv), twice. Columns of joints that a
        robot does not have are zero.
        """
        return self._forests[0][1].tips if len(self._forests) == 1 else self._positions_together

    @cached_property
    def poses(self) -> Callable[[np.ndarray, np.ndarray], Poses]:
        """The same with rotation matrices, and with Jacobians of linear and angular velocities.

        Of q and v, (n, nv), it gives (2, n, 3), m and m/s; (n, 3, 3); then (n, 6, nv), twice.
        """
        return self._forests[0][1].poses if len(self._forests) == 1 else self._poses_together

    def _positions_together(self, q: np.ndarray, v: np.ndarray) -> Positions:
        n, nv = q.shape
        motion, (J, J_dot) = np.empty((2, n, 3)), np.zeros((2, n, 3, nv))
        for rows, forest in self._forests:
            k = forest.nv
            motion[:, rows], J[rows, :, :k], J_dot[rows, :, :k] = forest.tips(q[rows, :k], v[rows, :k])
        return motion, J, J_dot

    def _poses_together(self, q: np.ndarray, v: np.ndarray) -> Poses:
        n, nv = q.shape
        motion, R, (J, J_dot) = np.empty((2, n, 3)), np.empty((n, 3, 3)), np.zeros((2, n, 6, nv))
        for rows, forest in self._forests:
            k = forest.nv
            motion[:, rows], R[rows], J[rows, :, :k], J_dot[rows, :, :k] = forest.poses(
                q[rows, :k], v[rows, :k]
            )
        return motion, R, J, J_dot


def poses_over_time(
    robots: Sequence[Robot], q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, (T, n, 3), orientations, (T, n, 3, 3), and twists, (T, n, 6), of tips, in world axes.

    Args:
        robots: the n robots.
        q, v: joint positions and velocities, (T, n, nv).
    """
    tips, (T, n) = Tips(robots), q.shape[:2]
    p, R, nu = np.empty((T, n, 3)), np.empty((T, n, 3, 3)), np.empty((T, n, 6))
    for k, motion in enumerate(zip(q, v, strict=True)):
        (p[k], _), R[k], J, _ = tips.poses(*motion)
        nu[k] = np.matvec(J, motion[1])
    return p, R, nu


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
    def inverse_damping(self) -> np.ndarray:
        """lambda of damped inverse kinematics, (n,), unit of J; 0 where nothing is damped."""
        lambdas = None if self.inversion is None else self.inversion.damping
        return np.zeros(self.error.shape[-2]) if lambdas is None else lambdas[..., 0]

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
