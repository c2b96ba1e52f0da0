"""Sampled control: torque and adaptation are held between samples, as a digital controller does.

This is another problem than the continuous law: its error falls with the first power of the period, and too
long a period makes the closed loop unstable. The controller is a `DiscreteController`, as it would run on
robots: what it remembers is its own, and the plant is moved from one of its samples to the next.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..control.controller import Signals
from ..control.discrete import DiscreteController
from ..coupling.cell import Reference
from .clock import Clock, multiple
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule
from .integrators import Sample, Step, steps
from .state import State
from .step_error import StepError


def steps_per_sample(period: float, dt: float) -> int:
    """How many steps a sample lasts.

    Raises:
        InputError: the period is not positive, or no multiple of dt.
    """
    return multiple("control_period", period, dt)


def sampled_rk4(
    loop: ClosedLoop,
    clock: Clock,
    schedule: DisturbanceSchedule,
    every: int,
    period: float,
    step_error: StepError,
) -> Iterator[Sample]:
    """The plant by the classical Runge-Kutta method, under a controller that acts once in so many steps.

    Args:
        loop: the closed loop.
        clock: its instants.
        schedule: disturbances.
        every: how many multiples of dt a sample lasts.
        period: the same in s, as the controller integrates it.
        step_error: told what the worst step was.

    Yields:
        One sample per multiple of dt. The torque of an instant is the one that acts from it on; at the end of
        the run that of a new sample, if one is due.
    """
    control, y = _Control(loop, period), loop.state(loop.initial_state())
    step_error.add(0.0, y.v)
    for step in steps(loop, clock, schedule):
        disturbance, now = schedule.torques[step.window], loop.at(0.5 * (step.t + step.t_next))
        k1, signals = loop.state(np.zeros(loop.size)), None
        if step.checked:
            due = step.number % every == 0
            signals = control.sample(step.t, y) if due else control.look(step.stages[0], y)
        now.respond(y, control.tau, disturbance, k1)
        if signals is not None:
            loop.watch(y, signals, k1.v)
            yield Sample(step.t, y.flat, disturbance, signals, step.logged)
        y, gap = _rk4_step(now, step, y, k1, control.tau, disturbance)
        control.carry(step.t_next, y)
        step_error.add(step.t_next, y.v, step.t_next - step.t, gap)
    at_end = control.sample if clock.sampled_at_end(every) else control.look_at
    yield Sample(clock.end, y.flat, disturbance, at_end(clock.end, y))


class _Control:
    """The controller in the loop, and its estimates and memory on their way to its next sample.

    Attributes:
        tau: torque that it holds, (n, nv), N·m, before it is cut off.
    """

    def __init__(self, loop: ClosedLoop, period: float):
        self._loop, self._controller = loop, DiscreteController(loop.controller, period)
        self._t = 0.0
        self.tau = np.zeros((loop.cell.n, loop.cell.nv))

    def sample(self, t: float, y: State) -> Signals:
        """Let the controller act on the state, which gets its estimates and memory."""
        controller = self._controller
        self._t, self._z, self._memory = t, controller.z, controller.memory
        y.z[...], y.memory[...] = self._z, self._memory
        signals = controller.sample(t, y.motion)
        self._z_dot, self._memory_dot = np.array(signals.z_dot), np.array(signals.memory_dot)
        self.tau = np.array(signals.tau)
        return signals

    def carry(self, t: float, y: State) -> None:
        """Put into the state how far estimates and memory have come at time t."""
        y.z[...] = self._z + (t - self._t) * self._z_dot
        y.memory[...] = self._memory + (t - self._t) * self._memory_dot

    def look(self, reference: Reference, y: State) -> Signals:
        """What the law would compute between two samples, with the torque that is held."""
        return replace(self._loop.look(reference, y), tau=self.tau)

    def look_at(self, t: float, y: State) -> Signals:
        """`look` at time t, s."""
        return self.look(self._loop.cell.references(np.array([t]))[0], y)


def _rk4_step(
    loop: ClosedLoop, step: Step, y: State, k1: State, tau: np.ndarray, disturbance: np.ndarray
) -> tuple[State, np.ndarray]:
    """The plant's state a step later, and by how much its acceleration there was guessed wrong, (n, nv)."""
    h, stage = step.t_next - step.t, loop.state()
    k2, k3, k4, k5 = (loop.state(row) for row in np.zeros((4, loop.size)))
    loop.respond(stage.ahead(y, 0.5 * h, k1.flat), tau, disturbance, k2)
    loop.respond(stage.ahead(y, 0.5 * h, k2.flat), tau, disturbance, k3)
    loop.respond(stage.ahead(y, h, k3.flat), tau, disturbance, k4)
    after = loop.state(y.flat + (h / 6) * (k1.flat + 2 * (k2.flat + k3.flat) + k4.flat))
    loop.respond(after, tau, disturbance, k5)
    return after, k4.v - k5.v
