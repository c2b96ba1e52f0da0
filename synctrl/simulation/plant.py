"""The true cell: rigid-body dynamics of every robot, with friction the controller does not know."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np

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
    _stages: list[Plant]
    _arms: list[tuple[int, int, Dynamics]]

    def __init__(
        self,
        cell: Cell,
        *,
        physics: str = "pinocchio",
        payloads: Sequence[Payload] = (),
        saturate: bool = False,
        robots: Sequence[Robot] | None = None,
    ):
        self.cell, self.physics = cell, physics
        self.payloads, self.saturate = tuple(payloads), saturate
        self.robots = tuple(cell.robots if robots is None else robots)
        self.schedule = PayloadSchedule(self.robots, self.payloads)
        self._set_friction()
        self.torque_limits = torque_limits(cell) if saturate else np.full((cell.n, cell.nv), np.inf)
        self._make_stages()

    # -- what happens -------------------------------------------------------------------------------------

    def at(self, t: float) -> Plant:
        """The plant as it is at time t: with the payloads carried then; at an edge from the right."""
        return self._stages[int(self.schedule.windows(np.array(t)))]

    def applied(self, tau: np.ndarray) -> np.ndarray:
        """What reaches the joints of torques tau that the controller commands, (..., n, nv), N·m."""
        return np.clip(tau, -self.torque_limits, self.torque_limits) if self.saturate else tau

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques tau, (n, nv), and friction."""
        tau = tau - self.friction(v)
        v_dot = np.zeros(tau.shape)
        for i, nv, dynamics in self._arms:
            v_dot[i, :nv] = dynamics(q[i, :nv], v[i, :nv], tau[i, :nv])
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

    def _make_stages(self) -> None:
        """One plant per window of the schedule: this one, and copies of it with other loads."""
        stages = [self, *(copy(self) for _ in self.schedule.edges)]
        make = PHYSICS[self.physics]
        known: dict[int, Dynamics] = {}
        for stage, robots in zip(stages, self.schedule.robots, strict=True):
            known.update({id(robot): make(robot) for robot in robots if id(robot) not in known})
            stage.robots, stage._stages = robots, stages
            stage._arms = [(i, robot.nv, known[id(robot)]) for i, robot in enumerate(robots)]

    def _friction(self, v: np.ndarray) -> np.ndarray:
        return self.viscous * v + self.coulomb * np.tanh(v / self.smoothing)


def _frictionless(v: np.ndarray) -> np.ndarray | float:
    return 0.0
