"""Payloads that robots pick up and put down during a run; the controller is not told.

A robot picks up a body that moves as its tip does at that instant, and lets go of one that moves on as it
did: no impulse acts, positions and velocities are continuous, and accelerations jump. Energy and momentum of
robot and body together are those they had apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import index, instance, window
from ..robots.payload import Load, carrying
from ..robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Payload:
    """A rigid body that a robot carries for start <= t < stop.

    Args:
        robot: index of the robot, counted from 0.
        mass: kg.
        com: centre of mass in the frame, (3,), m.
        inertia: about the centre of mass in the frame's axes, (3, 3), or (3,) for its diagonal, kg·m^2; by
            default that of a uniform ball of the density of water.
        frame: name of the frame that holds it; by default the robot's tip.
        start, stop: when it is picked up and put down, s; by default it is there from the beginning, and is
            not put down.

    Raises:
        InputError: numbers that no body can have, or a window that is empty or starts before 0.
    """

    robot: int
    mass: float
    com: Any = (0.0, 0.0, 0.0)
    inertia: Any = None
    frame: str | None = None
    start: float = 0.0
    stop: float | None = None

    def __post_init__(self) -> None:
        load = Load(self.mass, self.com, self.inertia, self.frame)
        for name in ("mass", "com", "inertia"):
            object.__setattr__(self, name, getattr(load, name))
        window("payload", self.start, self.stop)

    @property
    def load(self) -> Load:
        """The body."""
        return Load(self.mass, self.com, self.inertia, self.frame)

    def carried_at(self, t: float) -> bool:
        """Whether the robot has it at time t; at an edge from the right."""
        return self.start <= t and (self.stop is None or t < self.stop)

    def as_dict(self) -> dict[str, Any]:
        """The payload as plain data."""
        return {
            "robot": int(self.robot),
            "mass": float(self.mass),
            "com": self.com.tolist(),
            "inertia": self.inertia.tolist(),
            "frame": self.frame,
            "start": float(self.start),
            "stop": None if self.stop is None else float(self.stop),
        }


class PayloadSchedule:
    """What the robots carry, piecewise constant in time.

    Args:
        robots: the robots.
        payloads: the payloads.

    Attributes:
        edges: instants at which something is picked up or put down, s.
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
        changes = {t for p in payloads for t in (p.start, p.stop) if t is not None and t > 0}
        self.free = tuple(robots)
        self.edges = tuple(sorted(float(t) for t in changes))
        self.robots = [
            tuple(_loaded(robot, i, payloads, t) for i, robot in enumerate(robots))
            for t in (0.0, *self.edges)
        ]

    def windows(self, times: np.ndarray) -> np.ndarray:
        """Which row of `robots` is there at the times; at an edge the one from the right."""
        return np.searchsorted(self.edges, times, side="right")


def _loaded(robot: Robot, i: int, payloads: Sequence[Payload], t: float) -> Robot:
    for payload in payloads:
        if payload.robot == i and payload.carried_at(t):
            robot = carrying(robot, payload.load)
    return robot
