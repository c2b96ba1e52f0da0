"""The true cell: rigid-body dynamics of every robot, with friction the controller does not know."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np

from ..checks import instance
from ..robots.robot import Robot
from ..tasks.cell import Cell
from .limits import torque_limits
from .payloads import Payload, PayloadSchedule

Dynamics = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Positions, velocities and torques of one robot's joints -> accelerations."""


def pinocchio_dynamics(robot: Robot) -> Dynamics:
    """Forward dynamics by Pinocchio's articulated-body algorithm."""
    return robot.acceleration


def mujoco_dynamics(robot: Robot) -> Dynamics:
    """Forward dynamics by MuJoCo, from its own reading of the robot's URDF."""
    from .mujoco_plant import MujocoArm

    return MujocoArm(robot).acceleration


#: libraries that can compute the plant
PHYSICS: dict[str, Callable[[Robot], Dynamics]] = {
    "pinocchio": pinocchio_dynamics,
    "mujoco": mujoco_dynamics,
}


class Plant:
    """Accelerations of all robots under torque and friction, with the payloads they carry.

    A kind of plant with more joints than the controller knows overrides `hidden0`, `move` and `report`.

    Args:
        cell: the robots, with their true parameters and friction.
        physics: library that computes it, one of `PHYSICS`.
        payloads: what the robots pick up and put down.
        saturate: whether torques are cut off at the limits of the robots' descriptions.
        robots: what really stands there, if it is not what the controller knows.

    Attributes:
        viscous, coulomb: coefficients of friction, (n, nv), N·m·s/rad and N·m.
        smoothing: velocity at which Coulomb friction reaches tanh(1) of its value, (n, 1), rad/s.
        torque_limits: (n, nv), N·m; infinite without saturation.
        robots: what stands there, with the loads it carries now.
        payloads: the payloads.
        schedule: when they are carried.
    """

    #: state of its own at t = 0, for instance of joints the controller does not know
    hidden0 = np.zeros(0)

    def __init__(
        self,
        cell: Cell,
        *,
        physics: str = "pinocchio",
        payloads: Sequence[Payload] = (),
        saturate: bool = False,
        robots: Sequence[Robot] | None = None,
    ):
        instance("payloads", payloads, Sequence, "a sequence of Payload objects")
        self.cell, self.physics = cell, physics
        self.payloads, self.saturate = tuple(payloads), saturate
        self.schedule = PayloadSchedule(cell.robots if robots is None else robots, self.payloads)
        self.robots = self.schedule.robots[0]
        self._set_friction()
        self.torque_limits = torque_limits(cell) if saturate else np.full((cell.n, cell.nv), np.inf)
        self._arms = self._dynamics(0)
        self._stages: dict[int, Plant] = {0: self}

    # -- what happens -------------------------------------------------------------------------------------

    def at(self, t: float) -> Plant:
        """The plant as it is at time t: with the payloads carried then; at an edge from the right."""
        if not self.schedule.edges:
            return self
        window = int(self.schedule.windows(np.array(t)))
        if window not in self._stages:
            self._stages[window] = self._stage(window)
        return self._stages[window]

    def applied(self, tau: np.ndarray) -> np.ndarray:
        """What reaches the joints of torques tau that the controller commands, (..., n, nv), N·m."""
        return np.clip(tau, -self.torque_limits, self.torque_limits) if self.saturate else tau

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques tau, (n, nv), and friction."""
        tau = tau - self.friction(v)
        v_dot = np.zeros(tau.shape)
        by_robot = zip(self._arms, *map(self.cell.rows, (q, v, tau, v_dot)), strict=True)
        for (_, _, dynamics), q_i, v_i, tau_i, v_dot_i in by_robot:
            v_dot_i[...] = dynamics(q_i, v_i, tau_i)
        return v_dot

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`acceleration`, and the rate of the plant's own state."""
        return self.acceleration(q, v, tau), hidden

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What a result says of the plant's own state at its logged instants, (T, size of the state)."""
        return {}

    # -- internals ----------------------------------------------------------------------------------------

    def _set_friction(self) -> None:
        cell = self.cell
        self.viscous, self.coulomb = np.zeros((2, cell.n, cell.nv))
        self.smoothing = np.ones((cell.n, 1))
        for i, member in enumerate(cell.members):
            nv = member.robot.nv
            self.viscous[i, :nv] = member.friction.viscous
            self.coulomb[i, :nv] = member.friction.coulomb
            self.smoothing[i] = member.friction.smoothing
        self.friction = self._friction if self.viscous.any() or self.coulomb.any() else _frictionless

    def _dynamics(self, window: int) -> list[tuple[int, int, Dynamics]]:
        """Index, number of joints and dynamics of every robot in a window of the schedule."""
        make = PHYSICS[self.physics]
        return [(i, robot.nv, make(robot)) for i, robot in enumerate(self.schedule.robots[window])]

    def _stage(self, window: int) -> Plant:
        """A copy with the loads of another window."""
        stage = copy(self)
        stage.robots, stage._arms = self.schedule.robots[window], self._dynamics(window)
        return stage

    def _friction(self, v: np.ndarray) -> np.ndarray:
        return self.viscous * v + self.coulomb * np.tanh(v / self.smoothing)


def _frictionless(v: np.ndarray) -> np.ndarray | float:
    return 0.0
