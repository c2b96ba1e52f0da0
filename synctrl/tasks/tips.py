"""Poses and Jacobians of the tips of all robots of a cell, gathered into arrays."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from ..robots.blocks import Rows
from ..robots.forest import Forest, forests
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
    def _forests(self) -> list[tuple[Rows, Forest]]:
        return forests(self._robots)

    @cached_property
    def _only(self) -> Forest | None:
        """The forest, if there is only one."""
        return self._forests[0][1] if len(self._forests) == 1 else None

    def positions(self, q: np.ndarray, v: np.ndarray) -> Positions:
        """Positions and velocities of the tips, the velocities' Jacobians, and the Jacobians' derivatives.

        Columns of joints that a robot does not have are zero.

        Args:
            q, v: joint positions and velocities, (n, nv).

        Returns:
            (2, n, 3), m and m/s; then (n, 3, nv), twice.
        """
        if self._only is not None:
            return self._only.tips(q, v)
        n, nv = q.shape
        motion, (J, J_dot) = np.empty((2, n, 3)), np.zeros((2, n, 3, nv))
        for rows, forest in self._forests:
            k = forest.nv
            motion[:, rows], J[rows, :, :k], J_dot[rows, :, :k] = forest.tips(q[rows, :k], v[rows, :k])
        return motion, J, J_dot

    def poses(self, q: np.ndarray, v: np.ndarray) -> Poses:
        """The same with rotation matrices, (n, 3, 3), and with Jacobians of linear and angular velocities.

        Args:
            q, v: joint positions and velocities, (n, nv).

        Returns:
            (2, n, 3), m and m/s; (n, 3, 3); then (n, 6, nv), twice.
        """
        if self._only is not None:
            return self._only.poses(q, v)
        n, nv = q.shape
        motion, R, (J, J_dot) = np.empty((2, n, 3)), np.empty((n, 3, 3)), np.zeros((2, n, 6, nv))
        for rows, forest in self._forests:
            k = forest.nv
            motion[:, rows], R[rows], J[rows, :, :k], J_dot[rows, :, :k] = forest.poses(
                q[rows, :k], v[rows, :k]
            )
        return motion, R, J, J_dot
