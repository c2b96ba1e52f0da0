"""Poses and Jacobians of the tips of all robots of a cell, gathered into arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..robots.robot import Robot


class Tips:
    """Where the tips are and how they move with the joints, in world axes.

    Columns of joints that a robot does not have are zero. The arrays are scratch memory, filled by `update`.

    Attributes:
        position: (n, 3), m.
        rotation: (n, 3, 3).
        J, J_dot: Jacobian (linear velocity, then angular) and its time derivative, (n, 6, nv).
    """

    def __init__(self, robots: Sequence[Robot]):
        n, nv = len(robots), max(robot.nv for robot in robots)
        self.position = np.zeros((n, 3))
        self.rotation = np.zeros((n, 3, 3))
        self.J = np.zeros((n, 6, nv))
        self.J_dot = np.zeros((n, 6, nv))
        self._robots = [
            (i, robot, robot.nv, self.J[i, :, : robot.nv], self.J_dot[i, :, : robot.nv])
            for i, robot in enumerate(robots)
        ]

    def update(self, q: np.ndarray, v: np.ndarray) -> None:
        """Move to joint positions and velocities, (n, nv)."""
        for i, robot, nv, J, J_dot in self._robots:
            pose, J[:], J_dot[:] = robot.tip_kinematics(q[i, :nv], v[i, :nv])
            self.position[i], self.rotation[i] = pose.translation, pose.rotation
