"""A run that had to stop, and what its last rows tell: what happened first, and how fast."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..errors import SimulationError
from ..robots.model import unit_for
from .closed_loop import ClosedLoop
from .rates import HELD, HELD_SPRING, RUNGE_KUTTA, SWING, LoopRate, loop_rates
from .schedules import DisturbanceSchedule

#: a joint that moves farther than this in one step is not followed any more, rad
FAR = 0.2
#: calm rows that are looked at for rates
LOOKS = 8


class Excess(NamedTuple):
    """A step, or a period, against what a robot needs.

    Attributes:
        rate: the largest of the rates that count together.
        longest: the longest step or period with which they are stable, s.
        used: the one that was used, s.
        held: whether it is the control period.
    """

    rate: LoopRate
    longest: float
    used: float
    held: bool

    @property
    def share(self) -> float:
        """How many times too long; at most 1 is stable."""
        return self.used / self.longest


class Push(NamedTuple):
    """A torque from outside on one joint, N·m, and the acceleration it leads to, rad/s^2."""

    robot: int
    joint: int
    torque: float
    acceleration: float


@dataclass(frozen=True)
class Stop:
    """A run that had to stop, with what is known of it.

    A row is calm as long as no joint has moved farther than `FAR` in a step until then. What is in later rows
    has no meaning.

    Args:
        loop: the closed loop.
        schedule: pushes from outside.
        error: what stopped it.
        rows: logged arrays by name: "t", "q", "v", "tau" and "disturbance".
        state: flat state at the stop.
        h: step, s, or None where the integrator chooses its own.
        period: of sampled control, s, or None.
    """

    loop: ClosedLoop
    schedule: DisturbanceSchedule
    error: SimulationError
    rows: Mapping[str, np.ndarray]
    state: np.ndarray
    h: float | None
    period: float | None

    # -- what happened first ------------------------------------------------------------------------------

    @cached_property
    def last_calm(self) -> int:
        """The last calm row; -1 if nothing was logged."""
        v = self.rows["v"]
        if self.h is None or not len(v):
            return len(v) - 1
        far = np.abs(v).max(axis=(1, 2)) * self.h > FAR
        return max(int(far.argmax()) - 1, 0) if far.any() else len(v) - 1

    @cached_property
    def speed_after(self) -> np.ndarray:
        """Velocities to which the last calm row leads within a step, (n, nv), rad/s."""
        if self.last_calm < 0:
            return self.loop.cell.v0
        q, v, tau, push = (self.rows[name][self.last_calm] for name in ("q", "v", "tau", "disturbance"))
        plant = self.loop.at(float(self.rows["t"][self.last_calm])).plant
        return v + (self.h or 0.0) * plant.acceleration(q, v, plant.applied(tau) + push)

    @property
    def calm(self) -> bool:
        """Whether all joints were followed step by step until the end."""
        if self.h is None or self.last_calm < 0:
            return True
        if self.last_calm < len(self.rows["v"]) - 1:
            return False
        moved = np.abs(self.loop.split(self.state)[0] - self.rows["q"][-1]).max()
        steps = max(1, round((self.error.time - self.rows["t"][-1]) / self.h))
        return bool(moved <= FAR * steps)

    @property
    def conditions(self) -> np.ndarray:
        """Condition numbers of the Jacobians at the last calm row, (n,); ones where there are none."""
        cell, (t, motion) = self.loop.cell, self._moment(self.last_calm)
        task = cell.task.measure(motion, cell.references(np.array([t]))[0].desired)
        if task.J is None or task.J_inv is None:
            return np.ones(cell.n)
        return task.condition[:, 0]

    def quickest(self, robots: Sequence[int]) -> tuple[int, int]:
        """Of some robots the one that began, and its joint: it moves fastest a step after the last calm row.

        Where several are as fast, to a thousandth, it is the first one, whatever their rounding.
        """
        speed = np.nan_to_num(np.abs(self.speed_after[list(robots)]), nan=np.inf)
        k, joint = np.unravel_index(np.argmax(speed >= 0.999 * speed.max()), speed.shape)
        return robots[int(k)], int(joint)

    def unit(self, turning: str, robot: int, joint: int) -> str:
        """Unit of something of a joint that has the unit `turning` for joints that turn."""
        return unit_for(turning, self.loop.cell.robots[robot].joint_units[joint])

    # -- how fast it wants to move ------------------------------------------------------------------------

    def excesses(self, driven: bool) -> list[Excess]:
        """What robots need against the step and the period, the one that is farthest beyond first.

        Args:
            driven: as in `loop_rates`.
        """
        if self.h is None:
            return []
        rows = np.unique(np.linspace(0, self.last_calm, LOOKS).astype(int)) if self.last_calm >= 0 else [-1]
        found = [each for k in rows for each in self._excesses_at(int(k), self.h, driven)]
        return sorted(found, key=lambda each: -each.share)

    def _excesses_at(self, k: int, h: float, driven: bool) -> Iterable[Excess]:
        """Of every robot: what damps counts together, every spring for itself."""
        groups: dict[Hashable, list[LoopRate]] = {}
        for rate in loop_rates(self.loop, *self._moment(k), self.period is not None, driven):
            key = rate.robot, rate.spring and rate.gain, self._held(rate)
            groups.setdefault(key, []).append(rate)
        for together in groups.values():
            limit, total = self._limit(together[0]), sum(rate.rate for rate in together)
            if total > 0:
                used = self.period if self._held(together[0]) else h
                largest = max(together, key=lambda rate: rate.rate)
                yield Excess(largest, limit / total, used or h, self._held(largest))

    def _held(self, rate: LoopRate) -> bool:
        """Whether a rate acts through torque that is held for a period."""
        return self.period is not None and rate.gain != "friction"

    def _limit(self, rate: LoopRate) -> float:
        """Largest stable product of rate and step, or of rate and period."""
        if self._held(rate):
            return HELD_SPRING if rate.spring else HELD
        return SWING if rate.spring else RUNGE_KUTTA

    def _moment(self, k: int) -> tuple[float, np.ndarray]:
        """Time and motion, (2, n, nv), of a row, or of the start for -1."""
        if k < 0:
            return 0.0, np.stack((self.loop.cell.q0, self.loop.cell.v0))
        return float(self.rows["t"][k]), np.stack((self.rows["q"][k], self.rows["v"][k]))

    # -- what came from outside ---------------------------------------------------------------------------

    def push(self) -> Push | None:
        """The push that began before the stop and accelerates a joint most."""
        began = np.searchsorted((0.0, *self.schedule.edges), self.error.time or 0.0)
        torques = self.schedule.torques[:began]
        pushes = [self._push(int(i), torque[i]) for torque in torques for i in np.flatnonzero(torque.any(1))]
        return max(pushes, key=lambda push: push.acceleration, default=None)

    def _push(self, i: int, torque: np.ndarray) -> Push:
        robot = self.loop.cell.robots[i]
        torque, q = torque[: robot.nv], self._moment(self.last_calm)[1][0, i, : robot.nv]
        gained = np.nan_to_num(np.abs(np.linalg.solve(robot.mass_matrix(q), torque)), nan=np.inf)
        joint = int(np.where(torque != 0, gained, -1.0).argmax())
        return Push(i, joint, float(torque[joint]), float(gained.max()))
