"""Poses and Jacobians of the tips of all robots of a cell, gathered into arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from ..robots.forest import Forest, Selection, forests
from ..robots.robot import Robot

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
