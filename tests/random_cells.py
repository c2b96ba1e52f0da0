"""Cells that nobody chose, with whatever a cell may have, and how they are run: all from a seed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from cells import moving_weights, random_gains, smooth_motion
from machines import random_robot, rod_arm

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Cubic,
    Disturbance,
    Experiment,
    Friction,
    FrictionParameters,
    JointSpace,
    Member,
    Payload,
    Robot,
)
from synctrl.control.adaptation import Box, Leakage, Natural, Switching
from synctrl.control.laws import ChungSlotine

COUPLINGS = (
    Coupling.signed_ring,
    Coupling.chain,
    Coupling.star,
    Coupling.complete,
    Coupling.sum,
    lambda n, c: Coupling.star(n, n - 1, c),
    lambda n, c: Coupling.chain(n, c).weighted(np.linspace(0.5, 2.0, n - 1)),
)
STEP = 1e-3


class RandomCell:
    """A cell from a seed.

    Attributes:
        experiment: the experiment.
        options: how it is run.
        width: in how many lanes its robots stand.
    """

    def __init__(self, seed: int):
        self._rng = np.random.default_rng(seed)
        self.width = int(self._rng.choice([2, 4, 8]))
        self._n, self._tip = int(self._rng.integers(2, 10)), self._maybe(0.6)
        self._steps = int(self._rng.integers(4, 9))
        self.options: dict[str, Any] = {"duration": STEP * self._steps}
        if self._maybe(0.4):
            self.options["control_period"] = STEP * int(self._rng.integers(1, 4))
        if self._maybe(0.3):
            self.options["log_dt"] = STEP * int(self._rng.integers(1, 4))
        self.experiment = self._experiment()

    # -- internals ----------------------------------------------------------------------------------------

    def _maybe(self, share: float = 0.5) -> bool:
        return bool(self._rng.random() < share)

    def _time(self) -> float:
        """An instant in the run, on a step or between two."""
        steps = self._rng.integers(self._steps) if self._maybe() else self._rng.uniform(0, self._steps)
        return float(STEP * steps)

    def _window(self) -> tuple[float, float]:
        start, stop = sorted((self._time(), self._time()))
        return start, stop + STEP

    def _robots(self) -> list[Robot]:
        """Arms of one kind, or now and then of several; in Cartesian tasks they have two joints."""
        rng, kinds = self._rng, 1 if self._maybe(0.8) else 2
        if self._tip:
            made = [rod_arm(rng.uniform(0.5, 2, 2), rng.uniform(0.3, 1, 2)) for _ in range(kinds)]
        else:
            joints = int(rng.integers(2, 5))
            made = [
                random_robot(int(rng.integers(2**31)), joints, chain=self._maybe(0.9)) for _ in range(kinds)
            ]
        turns = rng.uniform(-1, 1, (self._n, 3)) * ([0, 0, 1] if self._tip or self._maybe() else 1)
        return [
            made[int(rng.integers(kinds))].placed(rng.uniform(-1, 1, 3), turn, name=f"robot {i + 1}")
            for i, turn in enumerate(turns)
        ]

    def _member(self, robot: Robot, friction: bool, adapted: bool) -> Member:
        rng, q0 = self._rng, self._rng.uniform(0.4, 1.4, robot.nv)
        start = robot.tip_position(q0)[:2] if self._tip else q0
        if self._maybe(0.7):
            motion: Any = smooth_motion(rng, len(start), 0.05, start)
        else:
            motion = Cubic(start, start + rng.uniform(-1e-4, 1e-4, len(start)), self._time() + STEP)
        rub = Friction(rng.uniform(0, 0.5, robot.nv), rng.uniform(0, 0.5, robot.nv), 0.3)
        known = FrictionParameters(robot) if friction and adapted else None
        theta_hat0 = None if known else rng.uniform(0.3, 0.9) * robot.inertial_parameters
        parts = {"friction": rub} if friction else {}
        parts |= {"parameters": known} if known else {}
        return Member(robot, motion, q0, rng.uniform(-0.3, 0.3, robot.nv), theta_hat0=theta_hat0, **parts)

    def _coupling(self, m: int) -> Coupling:
        rng, n, kind = self._rng, self._n, int(self._rng.integers(5))
        c = (
            rng.uniform(0.5, 2, n),
            rng.uniform(0.5, 2, (n, m)),
            rng.uniform(-0.5, 0.5, (n, m, m)) + 2 * np.eye(m),
            moving_weights(rng, n, m),
            np.ones(n),
        )[kind]
        return COUPLINGS[int(rng.integers(len(COUPLINGS)))](n, c=c)

    def _space(self) -> Any:
        if not self._tip:
            return JointSpace()
        return CartesianSpace("xy", singularity="damped") if self._maybe(0.3) else CartesianSpace("xy")

    def _experiment(self) -> Experiment:
        rng, robots = self._rng, self._robots()
        friction, adapted = self._maybe(), self._maybe(0.3)
        members = [self._member(robot, friction, adapted) for robot in robots]
        m, space = (2 if self._tip else robots[0].nv), self._space()
        clocks = rng.uniform(0, 3 * STEP, self._n) if self._maybe(0.2) else 0.0
        cell = Cell(members, self._coupling(m), space, clocks=clocks)
        wide = random_gains(rng, self._n, m, cell.nv, cell.theta.shape[1])
        gains = wide.replace(Gamma=1e-3 * wide.Gamma, leak=rng.uniform(0, 1) if self._maybe(0.3) else 0.0)
        experiment = Experiment(cell, gains, self.options["duration"], **self._beside())
        return self._learning(experiment)

    def _beside(self) -> dict[str, Any]:
        """What else may act."""
        rng, found = self._rng, dict[str, Any]()
        if self._maybe():
            robots = rng.integers(self._n, size=2).tolist()
            found["disturbances"] = [Disturbance(i, float(rng.normal()), *self._window()) for i in robots]
        if self._maybe(0.4):
            robots = rng.integers(self._n, size=2).tolist()
            windows = [self._window() for _ in robots]
            found["payloads"] = [
                Payload(i, float(rng.uniform(0.1, 1)), rng.uniform(-0.1, 0.1, 3), start=start, stop=stop)
                for i, (start, stop) in zip(robots, windows, strict=True)
            ]
        if self._maybe(0.3):
            found["reference_acceleration"] = "paper"
        return found

    def _learning(self, experiment: Experiment) -> Experiment:
        """Perhaps with another law, or another adaptation."""
        gains, kind = experiment.gains, int(self._rng.integers(8))
        if kind == 0 and experiment.reference_acceleration is None:
            return replace(experiment, gains=gains.replace(leak=0.0).independent(), law=ChungSlotine(0.5))
        first, member = experiment.cell.theta_hat0, experiment.cell.members[0]
        bodies = not isinstance(member.parameters, FrictionParameters)  # Natural starts from those that exist
        other: Any = {
            1: lambda: Natural(0.1) if bodies else Leakage(1e-3, Switching(0.5, 0.01)),
            2: lambda: Box(1e-3, first - 1e-6, first + 1e-6),
            3: lambda: Leakage(1e-3, 0.5),
        }.get(kind)
        if other is None:
            return experiment
        return replace(experiment, gains=gains.replace(Gamma=None), adaptation=other())
