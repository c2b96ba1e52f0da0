"""What gains will do in a cell, before it runs: poles, margins, torque, learning, and what to change first.

Small errors are looked at where the cell starts and at some places of its path, see `linear_loop`; torque is
that of the path and of the errors of the start, see `expected_torque`; changes come from `gain_rules`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
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
from .expected_torque import ExpectedTorque, existing, expected_torque, on_path
from .gain_case import Case, Change, longest_by_rates
from .gain_rules import Rule, changes, slow, swinging, too_fast, too_strong
from .late_rules import too_lagged, too_late
from .linear_loop import Linearized, LinearLoop, Place, modes_of

#: places of the path at which the loop is held, beside its start
PLACES = 4
#: states of small errors from which on their poles take too long, and rates alone are told
LARGE = 600


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
    whole = at_rest(loop)
    small = whole.size <= LARGE
    times, states = on_path(loop.cell, experiment.duration)
    case = make_case(loop, excursion(loop.cell, experiment.duration), dt, control_period)
    held = [whole, *(_held(loop, times, states) if small else ())]
    longest = _longest(held) if small else longest_by_rates(loop)
    modes = modes_of(whole) if small else []

    def torque(gains: Gains) -> ExpectedTorque:
        other = replace(experiment, gains=gains).closed_loop()
        return expected_torque(other, at_rest(other).loop(), times, states)

    found = tuple(changes(case, _rules(case, longest, experiment, torque)))
    delay = _delay(experiment, control_period)
    return Advice(
        loop.cell, case.gains, dt, control_period, *longest, tuple(modes), delay, torque(case.gains),
        case.shares, *_joints(case, held), found,
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


def _held(loop: ClosedLoop, times: np.ndarray, states: Excursion) -> Iterator[Linearized]:
    """The loop held at some places of its path."""
    for k in np.linspace(0, len(times) - 1, PLACES).astype(int):
        place = Place(float(times[k]), states.q[k], states.v[k], states.a[k])
        yield Linearized(loop, place, loop.plant.viscous)


def _longest(held: Sequence[Linearized]) -> tuple[float, float]:
    """Longest step and longest period with which no place is lost, s."""
    loops = [each.loop() for each in held]
    return min(each.longest_step for each in loops), min(each.longest_period for each in loops)


def _rules(
    case: Case,
    longest: tuple[float, float],
    experiment: Experiment,
    torque: Callable[[Gains], ExpectedTorque],
) -> list[Rule]:
    """The rules, the most urgent first."""
    whole = at_rest(case.loop)

    def damping(gains: Gains) -> float:
        modes = modes_of(whole, gains) if whole.size <= LARGE else []
        return min((mode.damping for mode in modes if mode.gain == "Gamma"), default=1.0)

    used = longest[case.period is not None]
    lags = equipment(experiment.sensors, experiment.actuators, case.period)

    def linear(gains: Gains) -> LinearLoop:
        return at_rest(replace(experiment, gains=gains).closed_loop()).loop()

    return [
        lambda case: too_fast(case, used),
        lambda case: too_lagged(case, lags, linear),
        lambda case: too_late(case, experiment.network),
        lambda case: too_strong(case, torque),
        lambda case: swinging(case, damping),
        lambda case: iter(()) if experiment.sensors or experiment.actuators else slow(case),
    ]


def _joints(case: Case, held: Sequence[Linearized]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M_jj, K_r and the spring of learning of every joint, (n, nv); in task space of J^T K_r J."""
    cell = case.loop.cell
    inertia, damping, spring = np.zeros((3, *cell.q0.shape))
    for i, (arm, K) in enumerate(zip(case.arms, case.K_r, strict=True)):
        k, J = arm.robot.nv, arm.weighted[0]
        inertia[i, :k] = np.einsum("kjj->kj", arm.M).mean(axis=0)
        damping[i, :k] = K if case.in_joints else (J * K[:, None] * J).sum(axis=0)
    spring[existing(cell)] = np.max([np.diag(each.G) for each in held], axis=0)
    return inertia, damping, spring


def _delay(experiment: Experiment, control_period: float | None) -> DelayMargin:
    """How much delay between robots it takes, with the devices in its loop."""
    devices = {"sensors": experiment.sensors, "actuators": experiment.actuators}
    held = {"control_period": control_period, **devices, "k_r_space": experiment.k_r_space}
    return delay_margin(experiment.cell, experiment.gains, **held)  # type: ignore[arg-type]
