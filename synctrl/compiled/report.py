"""What the driver says of a run: how it ended, and its worst step."""

from __future__ import annotations

import numpy as np

from . import structs
from .arrays import CompiledLoop
from .lanes import room


class Ending:
    """How runs have ended: what was found, in which step, at which robot, and the number that was too large.

    Args:
        runs: number of runs.

    Attributes:
        found: status (0 for nothing), step, robot and value, (runs,) each.
    """

    def __init__(self, runs: int):
        status, step, robot = np.zeros((3, runs), dtype=np.intc)
        self.found = status, step, robot, np.zeros(runs)

    def begin(self) -> None:
        """Forget what was found."""
        for part in self.found:
            part[...] = 0

    @property
    def all(self) -> bool:
        """Whether all runs have ended."""
        return bool(self.found[0].all())

    def fresh(self) -> structs.Report:
        """A report that counts its rows from 0 and goes on with what was found."""
        status, at, robot, value = (array.ctypes.data for array in self.found)
        ended = int(np.count_nonzero(self.found[0]))
        return structs.Report(ended=ended, status=status, at=at, robot=robot, value=value)


class Worst:
    """The worst step in every lane, as the driver keeps it.

    Args:
        program: which keeps it.
        v0: velocities at the start, (n, nv).
    """

    def __init__(self, program: CompiledLoop, v0: np.ndarray):
        width, self._program = program.lanes.width, program
        self._joints = v0.shape[1]
        size = program.lanes.rows(len(v0)) * self._joints
        self.largest, self.time, self.speed, self.at = (room(width) for _ in range(4))
        self._before, self._first_speed = (room(2, size, width), room(2, size, width)), np.abs(v0).max()
        buffers = self.largest, self.speed, self.time, self.at, *self._before
        self._told = [part.ctypes.data for part in buffers]
        self.begin()

    def begin(self) -> None:
        """Forget all steps."""
        for part in (self.largest, self.time, *self._before):
            part[...] = 0
        self.speed[:], self.at[:] = self._first_speed, -1
        self._program.work.step_error = structs.StepError(0, 0, *self._told)

    def of_all(self) -> tuple[float, float, int, float]:
        """Error, largest velocity, joint and end of the worst step of a run whose robots stand in lanes.

        Of equal ones the first counts, and at one instant the one of the first joint.
        """
        joints = self.joint(np.arange(len(self.at)))
        lane = min(range(len(joints)), key=lambda k: (-self.largest[k], self.time[k], joints[k]))
        return float(self.largest[lane]), float(self.speed.max()), int(joints[lane]), float(self.time[lane])

    def joint(self, lane: np.ndarray) -> np.ndarray:
        """Index in a row of all robots' joints of the joint that was at worst in a lane; -1 without one."""
        at, lanes = self.at[lane].astype(int), self._program.lanes
        if not lanes.scattered:
            return at
        robot = at // self._joints * lanes.width + lane
        return np.where(at < 0, -1, robot * self._joints + at % self._joints)
