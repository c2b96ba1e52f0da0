"""A plant with more joints than the controller knows: the others are held by controllers of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..control.gains import spread
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.mechanism import joint_limits
from ..robots.model import joined, unit_for
from ..robots.robot import Robot
from .plant import Output, Plant

#: outputs of a run with held joints
HELD = ("held_position", "held_velocity", "held_torque")
HELD_AXES = ("time", "robot", "held joint")


@dataclass(frozen=True, eq=False)
class Pid:
    """Controllers that hold joints where they are at t = 0: tau = P d - D v + I int d, d = q(0) - q.

    Args:
        P, I, D: gains, numbers or one per joint, N·m/rad, N·m/(rad s) and N·m·s/rad.

    Raises:
        InputError: not finite, or negative.
    """

    P: Any
    I: Any
    D: Any

    def __post_init__(self) -> None:
        for name in "PID":
            gain = finite_array(name, getattr(self, name))
            least = float(gain.min(initial=0.0))
            if least < 0:
                raise InputError.expected("gains of at least 0", least, name)
            object.__setattr__(self, name, gain)


class HeldJointsPlant(Plant):
    """Robots of which the controller commands some joints, while PID controllers hold the others.

    Its own state has, for every robot, positions, velocities and the integral of d of its held joints,
    (n, 3, held joints). The integral starts where it carries the weight of what the joints hold.

    Args:
        cell: what the controller knows: robots of which every joint is, by name, one of the real robot's.
        robots: what really stands there, one per robot of the cell, all with the same number of held joints.
        pid: their controllers.
        at: where the joints are held, number or one per joint, rad.
        options: of `Plant`.

    Raises:
        InputError: robots that do not fit those of the cell, or numbers that do not fit the held joints.
    """

    def __init__(self, cell: Cell, *, robots: Sequence[Robot], pid: Pid, at: ArrayLike = 0.0, **options: Any):
        if len(robots) != cell.n:
            raise InputError.expected(f"{cell.n}, one per robot of the cell", len(robots), "robots")
        super().__init__(cell, robots=robots, **options)
        self.pid = pid
        split = [_split(known, real) for known, real in zip(cell.robots, robots, strict=True)]
        self._known, self._held = ([part[k] for part in split] for k in range(2))
        self._count = len(self._held[0])
        if any(len(held) != self._count for held in self._held):
            raise InputError("expected the same number of held joints for all of them", subject="robots")
        for name in "PID":
            spread(f"pid, {name}", getattr(pid, name), (self._count,))
        self.at_rest = spread("at", finite_array("at", at), (self._count,))
        limits = [joint_limits(robot).torque[held] for robot, held in zip(robots, self._held, strict=True)]
        self._held_limits = np.array(limits)
        self.hidden0 = self._start()
        self._real_nv = width = max(robot.nv for robot in robots)
        self._known_at = np.concatenate([i * width + np.array(known) for i, known in enumerate(self._known)])
        self._held_at = np.concatenate([i * width + np.array(held) for i, held in enumerate(self._held)])
        self._joints_at = np.concatenate([i * cell.nv + np.arange(r.nv) for i, r in enumerate(cell.robots)])

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        if hidden.size != self.hidden0.size:
            raise InputError.expected(f"{self.hidden0.size} numbers of the held joints", hidden.size, "state")
        rows = hidden.reshape(-1, 3, self._count)
        held_tau = self._torque(rows)
        state = np.zeros((3, self.cell.n, self._real_nv))
        flat = state.reshape(3, -1)
        for part, known, held in zip(
            flat, (q, v, tau - self.friction(v)), (rows[:, 0], rows[:, 1], held_tau), strict=True
        ):
            part[self._known_at], part[self._held_at] = known.ravel()[self._joints_at], held.ravel()
        a = self._dynamics(*state).ravel()
        v_dot, hidden_dot = np.zeros(v.shape), np.empty(rows.shape)
        v_dot.ravel()[self._joints_at] = a[self._known_at]
        hidden_dot[:, 0], hidden_dot[:, 2] = rows[:, 1], self.at_rest - rows[:, 0]
        hidden_dot[:, 1] = a[self._held_at].reshape(-1, self._count)
        return v_dot, hidden_dot.ravel()

    def outputs(self, hidden: np.ndarray) -> dict[str, Output]:
        """Positions, velocities and torques of the held joints, each (T, n, held joints)."""
        rows = hidden.reshape(len(hidden), -1, 3, self._count)
        held = [robot.joint_units[k] for robot, at in zip(self.robots, self._held, strict=True) for k in at]
        parts = ("rad", rows[:, :, 0]), ("rad/s", rows[:, :, 1]), ("N·m", self._torque(rows))
        axes = "time", "robot", "held joint"
        return {
            name: (part.copy(), joined(unit_for(unit, joint) for joint in held), axes)
            for name, (unit, part) in zip(HELD, parts, strict=True)
        }

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """How far the held joints were moved, in rad or m: `held_joints`, one entry per robot."""
        moved = np.abs(hidden.reshape(len(hidden), -1, 3, self._count)[:, :, 0] - self.at_rest)
        return {
            "held_joints": [
                {
                    "joints": [robot.joint_names[k] for k in held],
                    "largest": moved[:, i].max(axis=0, initial=0.0).tolist(),
                    "final": moved[-1, i].tolist() if len(moved) else [],
                }
                for i, (robot, held) in enumerate(zip(self.robots, self._held, strict=True))
            ]
        }

    def _torque(self, rows: np.ndarray) -> np.ndarray:
        """What the PID controllers give, (..., held joints), of states (..., 3, held joints)."""
        pid, (q, v, integral) = self.pid, np.moveaxis(rows, -2, 0)
        tau = pid.P * (self.at_rest - q) - pid.D * v + pid.I * integral
        return np.clip(tau, -self._held_limits, self._held_limits) if self.saturate else tau

    def _start(self) -> np.ndarray:
        hidden = np.zeros((self.cell.n, 3, self._count))
        hidden[:, 0] = self.at_rest
        for i, robot in enumerate(self.robots):
            q = np.zeros(robot.nv)
            q[self._known[i]], q[self._held[i]] = self.cell.q0[i, : len(self._known[i])], self.at_rest
            weight = robot.gravity(q)[self._held[i]]
            hidden[i, 2] = np.divide(weight, self.pid.I, out=np.zeros(self._count), where=self.pid.I > 0)
        return hidden.ravel()


def _split(known: Robot, real: Robot) -> tuple[list[int], list[int]]:
    """Joints of the real robot that the controller knows, in its order, and the others."""
    missing = [name for name in known.joint_names if name not in real.joint_names]
    if missing:
        names = ", ".join(missing)
        raise InputError(
            f"expected robot '{real.name}' to have the joints of '{known.name}', found none called {names}",
            subject="robots",
            found=names,
        )
    found = [real.joint_names.index(name) for name in known.joint_names]
    return found, [k for k in range(real.nv) if k not in found]
