"""Poses and Jacobians of the tips of all robots of a cell, gathered into arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..robots.robot import Robot
from .rows import joint_rows


class Tips:
    """Where the tips of robots are and how they move with the joints, in world axes."""

    def __init__(self, robots: Sequence[Robot]):
        self._rows = joint_rows(robots)
        self._kinematics = [robot.tip_kinematics for robot in robots]
        self._shape = len(robots), 6, max(robot.nv for robot in robots)

    def at(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Poses of the tips, their Jacobians (linear velocity, then angular) and the Jacobians' derivatives.

        Columns of joints that a robot does not have are zero.

        Args:
            q, v: joint positions and velocities, (n, nv).

        Returns:
            Rotations and positions as homogeneous matrices, (n, 4, 4), m; then (n, 6, nv), twice.
        """
        pose, J, J_dot = np.empty((len(q), 4, 4)), np.zeros(self._shape), np.zeros(self._shape)
        by_robot = zip(self._kinematics, pose, *map(self._rows, (J, J_dot, q, v)), strict=True)
        for kinematics, pose_i, J_i, J_dot_i, q_i, v_i in by_robot:
            placement, J_i[...], J_dot_i[...] = kinematics(q_i, v_i)
            pose_i[...] = placement.homogeneous
        return pose, J, J_dot
