"""A change of gains, and the gains of a cell with what their numbers are held against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..control.controller import Controller
from ..control.gains import Gains, read_gain, spread_rows
from ..control.suggest import Arm, Rates, cut, fastest, largest_mode, learning_share, slowest_mode
from ..simulation.closed_loop import ClosedLoop
from ..simulation.rates import HELD, HELD_SPRING, RUNGE_KUTTA, SWING, LoopRate, loop_rates

#: how urgent a change is, the worst first, and what that means
URGENCIES = {
    "diverges": "small errors grow, and the run may diverge",
    "late": "errors grow, for messages come too late",
    "torque": "it takes more torque than there is",
    "swings": "what is learned swings",
    "slow": "a robot follows more slowly than Lambda asks",
}


@dataclass(frozen=True, eq=False)
class Change:
    """What to change, and to which number.

    Attributes:
        urgency: one of `URGENCIES`.
        what: a gain, "dt", "control_period", "period" or "delay" of the network, "time" that the desired
            motion takes, "start", or "torque limit".
        robot, joint: where it counts most, counted from 0; None if it is not about one.
        found, to: what is there and what should be, of that joint, or the largest of all.
        unit: of both.
        why: in words.
        gains: the gains with this change, and all before it; as they were if it is none of gains.
    """

    urgency: str
    what: str
    robot: int | None
    joint: int | None
    found: float
    to: float
    unit: str
    why: str
    gains: Gains

    def as_dict(self, names: Sequence[str]) -> dict[str, Any]:
        """Plain data but the gains, with the change in words and the names of the robots."""
        told = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "gains"}
        return {**told, "words": self.told(names)}

    def told(self, names: Sequence[str]) -> str:
        """The change in words, with the names of the robots."""
        place = "" if self.robot is None else f" of {names[self.robot]}"
        place += "" if self.joint is None else f", joint {self.joint + 1}"
        return f"{self.what}{place}: from {self.found:.3g} to {self.to:.3g} {self.unit}".rstrip()


@dataclass(frozen=True, eq=False)
class Case:
    """Gains in a cell, and what their numbers are held against.

    Attributes:
        loop: the closed loop as it was given.
        gains: as changed until now.
        arms: the robots along their paths.
        dt, period: step and period of sampled control, s; None for continuous control.
    """

    loop: ClosedLoop
    gains: Gains
    arms: tuple[Arm, ...]
    dt: float
    period: float | None

    @cached_property
    def controller(self) -> Controller:
        """Of the gains as changed until now, without adaptation."""
        given = self.loop.controller
        return Controller(given.cell, self.gains.replace(Gamma=0.0), k_r_space=given.k_r_space)

    @property
    def used(self) -> float:
        """The step, or the period of sampled control, s."""
        return self.dt if self.period is None else self.period

    @property
    def pace(self) -> str:
        """The same in words."""
        return f"a step of {self.dt:g} s" if self.period is None else f"a period of {self.period:g} s"

    @property
    def top(self) -> float:
        """Largest rate that is asked for, 1/s."""
        return fastest(self.period, self.dt)

    @property
    def rates(self) -> Rates:
        """Those of the gains, and the room that is left for K_r beside what Lambda and beta may take."""
        Lambda, beta = float(self.controller.Lambda.max()), float(self.controller.beta.max())
        together = beta * self.loop.cell.largest_share
        taken = min(Lambda, self.top / 4) + min(together, self.top / 4)
        return Rates(Lambda, beta, together, self.top - taken)

    @property
    def in_joints(self) -> bool:
        """Whether the damping acts in joint space."""
        return self.controller.k_r_space == "joint"

    @cached_property
    def K_r(self) -> list[np.ndarray]:  # noqa: N802
        """Of every robot, (nv,), or (m,) in task space."""
        sizes = [arm.robot.nv if self.in_joints else self.loop.cell.m for arm in self.arms]
        return [row[:k] for row, k in zip(self.controller.K_r, sizes, strict=True)]

    @cached_property
    def Gamma(self) -> list[np.ndarray] | None:  # noqa: N802
        """Of every robot, (P,); None where another adaptation learns, or nothing does."""
        if self.gains.Gamma is None or not self.gains.Gamma.any():
            return None
        sizes = [len(p.theta) for p in self.loop.cell.parameters]
        rows = spread_rows("Gamma", read_gain("Gamma", self.gains.Gamma), sizes)
        return [row[:k] for row, k in zip(rows, sizes, strict=True)]

    def changed(self, **gains: object) -> Case:
        """The case with other gains."""
        return replace(self, gains=self.gains.replace(**gains))  # type: ignore[arg-type]

    # -- sizes ---------------------------------------------------------------------------------------------

    @cached_property
    def mode(self) -> float:
        """The largest mode of M^-1 K_r of all robots, 1/s."""
        if self.in_joints:
            return max(self.largest(arm, K) for arm, K in zip(self.arms, self.K_r, strict=True))
        return max(rate.rate for rate in self._rates if rate.gain == "K_r")

    @staticmethod
    def largest(arm: Arm, K: np.ndarray) -> float:
        """The largest mode of M^-1 K_r of one robot along its path, 1/s."""
        return largest_mode(np.linalg.inv(arm.M), K)

    def slowest(self, arm: Arm, K: np.ndarray) -> float:
        """The slowest, with the load that it may carry, 1/s."""
        return slowest_mode(arm.M_loaded, K)

    def cut(self, arm: Arm, K: np.ndarray) -> np.ndarray:
        """K_r of one robot, no mode of which is above the room that there is."""
        return cut(arm, K, self.rates.room) if self.in_joints else K * min(1.0, self.rates.room / self.mode)

    @property
    def springs(self) -> dict[str, float]:
        """How far Gamma and K_eps are beyond what step or period follow."""
        found = {"Gamma": 0.0, "K_eps": 0.0}
        limit = SWING if self.period is None else HELD_SPRING
        for rate in self._rates:
            if rate.gain in found:
                found[rate.gain] = max(found[rate.gain], rate.rate * self.used / limit)
        return found

    @cached_property
    def shares(self) -> np.ndarray:
        """How many times Y Gamma Y^T is what the damping can follow, of every robot, (n,)."""
        Lambda, Gamma = self.rates.Lambda, self.Gamma
        if Gamma is None or not self.in_joints:
            return np.zeros(len(self.arms))
        rows = zip(self.arms, self.K_r, Gamma, strict=True)
        return np.array([learning_share(arm, K, Lambda, Lambda, rate) for arm, K, rate in rows])

    @cached_property
    def _rates(self) -> list[LoopRate]:
        cell = self.loop.cell
        return loop_rates(self.loop, 0.0, np.stack((cell.q0, cell.v0)), self.period is not None)


def longest_by_rates(loop: ClosedLoop) -> tuple[float, float]:
    """Longest step of RK4 and longest period, s, by sums of rates: shorter than what poles say."""
    motion, found = np.stack((loop.cell.q0, loop.cell.v0)), []
    for held, damps, swings in ((False, RUNGE_KUTTA, SWING), (True, HELD, HELD_SPRING)):
        sums, fastest = np.zeros(loop.cell.n), float(np.finfo(float).tiny)
        for rate in loop_rates(loop, 0.0, motion, held):
            if rate.spring:
                fastest = max(fastest, rate.rate / swings)
            elif not held or rate.gain != "friction":
                sums[rate.robot] += rate.rate / damps
        found.append(float(1 / max(fastest, sums.max())))
    return found[0], found[1]
