"""What happens to robots in windows of time, untold to the controller: torques from outside, and payloads.

A robot picks up a body that moves as its tip does at that instant, and lets go of one that moves on as it
did: no impulse acts, positions and velocities are continuous, and accelerations jump. Energy and momentum of
robot and body together are those they had apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import finite_array, finite_number, index, instance, window
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.payload import Payload as Payload
from ..robots.payload import carrying
from ..robots.robot import Robot


class Windows:
    """The time between edges, instants at which something jumps, in order, s."""

    def __init__(self, edges: Iterable[float]):
        self.edges = tuple(sorted({float(edge) for edge in edges}))

    def windows(self, times: np.ndarray) -> np.ndarray:
        """Which window the times lie in, counted from 0; at an edge the one from the right."""
        return np.searchsorted(self.edges, times, side="right")


@dataclass(frozen=True, eq=False)
class Disturbance:
    """A constant joint torque on one robot for start <= t < stop.

    Args:
        robot: index of the robot, counted from 0.
        torque: (nv,), or one number for every joint, N·m.
        start, stop: s.

    Raises:
        InputError: not finite, or a window that is empty or starts before 0.
    """

    robot: int
    torque: Any
    start: float
    stop: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", finite_array("disturbance, torque", self.torque))
        finite_number("disturbance, stop", self.stop)  # it has an end, unlike a payload
        window("disturbance", self.start, self.stop)

    def as_dict(self) -> dict[str, Any]:
        """The same as plain data."""
        return {
            "robot": int(self.robot),
            "torque": self.torque.tolist(),
            "start": float(self.start),
            "stop": float(self.stop),
        }


class DisturbanceSchedule(Windows):
    """Torques of all disturbances together, piecewise constant in time.

    Args:
        cell: the cell they act on.
        disturbances: the disturbances.

    Attributes:
        torques: torque on every joint before, between and after the edges, (edges + 1, n, nv), N·m.

    Raises:
        InputError: a robot that is not in the cell, or a torque of the wrong size.
    """

    def __init__(self, cell: Cell, disturbances: Sequence[Disturbance]):
        instance("disturbances", disturbances, Sequence, "a sequence of Disturbance objects")
        for disturbance in disturbances:
            _check(cell, disturbance)
        super().__init__(edge for d in disturbances for edge in (d.start, d.stop))
        bounds = (0.0, *self.edges, np.inf)
        self.torques = np.zeros((len(bounds) - 1, cell.n, cell.nv))
        for torque, begin in zip(self.torques, bounds[:-1], strict=True):
            for d in disturbances:
                if d.start <= begin < d.stop:
                    torque[d.robot, : cell.robots[d.robot].nv] += d.torque

    def torque(self, t: float) -> np.ndarray:
        """Torque on every joint, (n, nv), N·m; at an edge the value from the right."""
        return self.torques[int(self.windows(np.array(t)))]


def _check(cell: Cell, disturbance: Disturbance) -> None:
    instance("disturbances", disturbance, Disturbance, "Disturbance objects")
    nv = cell.robots[index("disturbance, robot", disturbance.robot, cell.n)].nv
    if disturbance.torque.shape not in ((), (nv,)):
        raise InputError.expected(
            f"a number or shape ({nv},)", disturbance.torque.shape, "disturbance, torque"
        )


class PayloadSchedule(Windows):
    """What the robots carry, piecewise constant in time.

    Args:
        robots: the robots.
        payloads: the payloads.

    Attributes:
        free: the robots as they are without payloads, n of them.
        robots: the robots with their loads before, between and after the edges, edges + 1 rows of n.

    Raises:
        InputError: a robot that is not there, or a frame that does not move.
        FrameNotFound: no such frame.
    """

    def __init__(self, robots: Sequence[Robot], payloads: Sequence[Payload]):
        for payload in payloads:
            instance("payloads", payload, Payload, "Payload objects")
            index("payload, robot", payload.robot, len(robots))
        super().__init__(t for p in payloads for t in (p.start, p.stop) if t is not None and t > 0)
        self.free = tuple(robots)
        self.robots = [
            tuple(_loaded(robot, i, payloads, t) for i, robot in enumerate(robots))
            for t in (0.0, *self.edges)
        ]

    @property
    def carried(self) -> np.ndarray:
        """Most that payloads add to the inertial parameters of each robot, (n,), as a share of these."""
        added = [[_length(r, free) for r, free in zip(row, self.free, strict=True)] for row in self.robots]
        return np.max(added, axis=0) / [_length(free) for free in self.free]


def _length(robot: Robot, free: Robot | None = None) -> float:
    """Of the inertial parameters of a robot, or of their difference from those of another."""
    known = 0.0 if free is None else free.inertial_parameters
    return float(np.linalg.norm(robot.inertial_parameters - known))


def _loaded(robot: Robot, i: int, payloads: Sequence[Payload], t: float) -> Robot:
    for payload in payloads:
        if payload.robot == i and payload.carried_at(t):
            robot = carrying(robot, payload)
    return robot
