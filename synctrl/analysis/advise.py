"""What gains will do in a cell, before it runs: poles, margins, torque, learning, and what to change first.

Small errors are looked at where the cell starts and at some places of its path, see `linear_loop`; torque is
that of the path and of the errors of the start, see `expected_torque`; changes come from `gain_rules`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ..checks import instance, positive_number
from ..control.excursion import Excursion, at_start, excursion
from ..control.gains import Gains
from ..control.suggest import Arm, usual_load
from ..coupling.cell import Cell
from ..simulation.closed_loop import ClosedLoop
from ..simulation.simulate import Experiment
from .advice import Advice
from .delay_margin import DelayMargin, delay_margin
from .equipped import equipment
from .expected_torque import ExpectedTorque, existing, expected_torque, on_path, rough_torque
from .gain_case import Case, Change, longest_by_rates
from .gain_rules import Rule, changes, slow, swinging, too_fast, too_strong
from .late_rules import too_lagged, too_late
from .linear_loop import Linearized, Mode, Place, modes_of

#: places of the path at which the loop is held, beside its start
PLACES = 4
#: states of small errors from which on their poles take too long, and rates alone are told
LARGE = 250


def advise(
    cell: Cell,
    gains: Gains,
    *,
    dt: float = 1e-3,
    control_period: float | None = None,
    duration: float = 5.0,
    **parts: Any,
) -> Advice:
    """What gains will do in a cell, and what to change first.

    Args:
        cell, gains: robots, task and coupling, and the gains of the paper's law.
        dt: step of RK4, s.
        control_period: of sampled control, s; None for continuous control.
        duration: what of the desired motions is looked at, s.
        parts: what else `Experiment` has: `adaptation`, `network`, `payloads`, `k_r_space` ...

    Raises:
        InputError: a value that does not fit, another law than the paper's, or a space that does not say
            which joint positions are on a path.
        UnreachableError: a path that a robot cannot reach.
    """
    return advise_run(Experiment(cell, gains, duration, **parts), dt, control_period)


def advise_run(experiment: Experiment, dt: float = 1e-3, control_period: float | None = None) -> Advice:
    """`advise` for an experiment, with all of its parts; arguments and errors are the same."""
    instance("experiment", experiment, Experiment, "an Experiment")
    positive_number("dt", dt)
    if control_period is not None:
        positive_number("control_period", control_period)
    loop = experiment.closed_loop()
    kind = Look if at_rest(loop).size <= LARGE else RoughLook
    look = kind(experiment, loop, dt, control_period)
    case = look.case
    return Advice(
        loop.cell, case.gains, dt, control_period, *look.longest, tuple(look.modes), look.delay,
        look.torque(case.gains), case.shares, *look.joints, tuple(changes(case, look.rules)),
    )  # fmt: skip


def first_change(loop: ClosedLoop, dt: float, control_period: float | None) -> Change | None:
    """What to change first in a loop that ran away, from where it starts alone; None if nothing is found."""
    whole = at_rest(loop)
    if whole.size > LARGE:
        return None
    case = make_case(loop, at_start(loop.cell), dt, control_period)
    longest = _longest([whole])[control_period is not None]
    return next(too_fast(case, longest), None)


def at_rest(loop: ClosedLoop) -> Linearized:
    """A loop held where it starts, at rest; Coulomb friction, which errors soon leave, does not count."""
    still = np.zeros_like(loop.cell.q0)
    return Linearized(loop, Place(0.0, loop.cell.q0, still, still), loop.plant.viscous)


def make_case(loop: ClosedLoop, states: Excursion, dt: float, control_period: float | None) -> Case:
    """The gains of a loop as they are, in some states."""
    loads = [usual_load(robot) for robot in loop.cell.robots]
    arms = tuple(Arm(loop.cell, i, states, load) for i, load in enumerate(loads))
    return Case(loop, loop.controller.gains, arms, dt, control_period)


def _longest(held: Sequence[Linearized]) -> tuple[float, float]:
    """Longest step and longest period with which no place is lost, s."""
    loops = [each.loop() for each in held]
    return min(each.longest_step for each in loops), min(each.longest_period for each in loops)


class RoughLook:
    """What is found of cells with very many joints: rates, robot by robot, and torque of path and start.

    Args:
        experiment, loop: the cell under control.
        dt, period: step, and period of sampled control or None, s.
    """

    def __init__(self, experiment: Experiment, loop: ClosedLoop, dt: float, period: float | None):
        self.experiment, self.loop, self.period = experiment, loop, period
        self.times, self.states = on_path(loop.cell, experiment.duration)
        self.case = make_case(loop, excursion(loop.cell, experiment.duration), dt, period)
        self.whole = at_rest(loop)

    @cached_property
    def held(self) -> list[Linearized]:
        """Places at which the loop is held."""
        return [self.whole]

    @cached_property
    def longest(self) -> tuple[float, float]:
        """Longest step and longest period, s."""
        return longest_by_rates(self.loop)

    @cached_property
    def modes(self) -> list[Mode]:
        """Modes where the cell starts."""
        return []

    @cached_property
    def delay(self) -> DelayMargin | None:
        """How much delay between robots it takes, if the theorem says so."""
        return None

    @property
    def joints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M_jj, K_r and the spring of learning of every joint, (n, nv); in task space of J^T K_r J."""
        cell, case = self.loop.cell, self.case
        inertia, damping, spring = np.zeros((3, *cell.q0.shape))
        for i, (arm, K) in enumerate(zip(case.arms, case.K_r, strict=True)):
            k, J = arm.robot.nv, arm.weighted[0]
            inertia[i, :k] = np.einsum("kjj->kj", arm.M).mean(axis=0)
            damping[i, :k] = K if case.in_joints else (J * K[:, None] * J).sum(axis=0)
        spring[existing(cell)] = np.max([np.diag(each.G) for each in self.held], axis=0)
        return inertia, damping, spring

    def again(self, gains: Gains) -> ClosedLoop:
        """The closed loop with other gains."""
        return replace(self.experiment, gains=gains).closed_loop()

    def torque(self, gains: Gains) -> ExpectedTorque:
        """What some gains take."""
        return rough_torque(self.again(gains), self.times, self.states)

    @property
    def rules(self) -> list[Rule]:
        """The rules, the most urgent first."""
        used = self.longest[self.period is not None]
        return [lambda case: too_fast(case, used), lambda case: too_strong(case, self.torque), slow]


class Look(RoughLook):
    """What is found of other cells: poles where they start and on their paths, and what follows."""

    @cached_property
    def held(self) -> list[Linearized]:
        places = [
            Place(float(self.times[k]), *(part[k] for part in self.states[:3]))
            for k in np.linspace(0, len(self.times) - 1, PLACES).astype(int)
        ]
        return [self.whole, *(Linearized(self.loop, place, self.loop.plant.viscous) for place in places)]

    @cached_property
    def longest(self) -> tuple[float, float]:
        return _longest(self.held)

    @cached_property
    def modes(self) -> list[Mode]:
        return modes_of(self.whole)

    @cached_property
    def delay(self) -> DelayMargin:
        """How much delay between robots it takes, with the devices in its loop."""
        made = self.experiment
        return delay_margin(
            made.cell, made.gains, k_r_space=made.k_r_space, sensors=made.sensors, actuators=made.actuators,
            control_period=self.period,
        )  # fmt: skip

    def torque(self, gains: Gains) -> ExpectedTorque:
        other = self.again(gains)
        return expected_torque(other, at_rest(other).loop(), self.times, self.states)

    def damping(self, gains: Gains) -> float:
        """The least damping ratio of what is learned."""
        modes = modes_of(self.whole, gains)
        return min((mode.damping for mode in modes if mode.gain == "Gamma"), default=1.0)

    @property
    def rules(self) -> list[Rule]:
        made, (fast, strong, slow_one) = self.experiment, super().rules
        lags = equipment(made.sensors, made.actuators, self.period)
        return [
            fast,
            lambda case: too_lagged(case, lags, lambda gains: at_rest(self.again(gains)).loop()),
            lambda case: too_late(case, made.network),
            strong,
            lambda case: swinging(case, self.damping),
            *(() if made.sensors or made.actuators else (slow_one,)),
        ]
