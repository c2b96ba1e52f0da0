"""Torques from outside, acting in windows of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import finite_array, finite_number, index, instance, window
from ..coupling.cell import Cell
from ..errors import InputError


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


class DisturbanceSchedule:
    """Torques of all disturbances together, piecewise constant in time.

    Args:
        cell: the cell they act on.
        disturbances: the disturbances.

    Attributes:
        edges: instants at which a torque jumps, s.
        torques: torque on every joint before, between and after the edges, (edges + 1, n, nv), N·m.

    Raises:
        InputError: a robot that is not in the cell, or a torque of the wrong size.
    """

    def __init__(self, cell: Cell, disturbances: Sequence[Disturbance]):
        instance("disturbances", disturbances, Sequence, "a sequence of Disturbance objects")
        for disturbance in disturbances:
            _check(cell, disturbance)
        self.edges = tuple(sorted({edge for d in disturbances for edge in (d.start, d.stop)}))
        bounds = (0.0, *self.edges, np.inf)
        self.torques = np.zeros((len(bounds) - 1, cell.n, cell.nv))
        for torque, begin in zip(self.torques, bounds[:-1], strict=True):
            for d in disturbances:
                if d.start <= begin < d.stop:
                    torque[d.robot, : cell.robots[d.robot].nv] += d.torque

    def windows(self, times: np.ndarray) -> np.ndarray:
        """Which row of `torques` acts at the times; at an edge the one from the right."""
        return np.searchsorted(self.edges, times, side="right")

    def torque(self, t: float) -> np.ndarray:
        """Torque on every joint, (n, nv), N·m; at an edge the value from the right."""
        return self.torques[int(self.windows(np.array(t)))]


def _check(cell: Cell, disturbance: Disturbance) -> None:
    instance("disturbances", disturbance, Disturbance, "Disturbance objects")
    robot = index("disturbance, robot", disturbance.robot, cell.n)
    nv = cell.robots[robot].nv
    if disturbance.torque.shape not in ((), (nv,)):
        raise InputError(
            f"expected a number or shape ({nv},), found {disturbance.torque.shape}",
            subject="disturbance, torque",
        )
