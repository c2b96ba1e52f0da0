"""The true cell: rigid-body dynamics of every robot, with friction the controller does not know."""

from __future__ import annotations

import numpy as np

from ..tasks.cell import Cell


class Plant:
    """Accelerations of all robots by Pinocchio's articulated-body algorithm.

    Args:
        cell: the robots, with their true parameters and friction.
    """

    def __init__(self, cell: Cell):
        shape = (cell.n, cell.nv)
        self._robots = [(i, robot, robot.nv) for i, robot in enumerate(cell.robots)]
        self._v_dot = np.zeros(shape)
        self.viscous, self.coulomb = np.zeros(shape), np.zeros(shape)
        self.smoothing = np.ones((cell.n, 1))
        for i, member in enumerate(cell.members):
            nv = member.robot.nv
            self.viscous[i, :nv] = member.friction.viscous
            self.coulomb[i, :nv] = member.friction.coulomb
            self.smoothing[i] = member.friction.smoothing
        self.friction = self._friction if self.viscous.any() or self.coulomb.any() else _frictionless

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques tau, (n, nv), and friction."""
        tau = tau - self.friction(v)
        for i, robot, nv in self._robots:
            self._v_dot[i, :nv] = robot.acceleration(q[i, :nv], v[i, :nv], tau[i, :nv])
        return self._v_dot

    def _friction(self, v: np.ndarray) -> np.ndarray:
        return self.viscous * v + self.coulomb * np.tanh(v / self.smoothing)


def _frictionless(v: np.ndarray) -> np.ndarray | float:
    return 0.0
