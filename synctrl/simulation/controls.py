"""Who acts when: continuous control at every instant, sampled control at instants of its own.

Continuous control is one differential equation with the plant. With sampled control torque and adaptation are
held between samples, as a digital controller does. This is another problem than the continuous law: its error
falls with the first power of the period, and too long a period makes the closed loop unstable. The controller
is a `DiscreteController`, as it would run on robots: what it remembers is its own, and the plant is moved
from one of its samples to the next.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from ..control.controller import Signals
from ..control.discrete import DiscreteController
from ..coupling.cell import Reference
from .advance import Step, due
from .clock import Clock
from .closed_loop import ClosedLoop, State
from .devices import LiveDevices
from .step_error import StepError


class Continuous:
    """`Control` that acts at every instant.

    Args:
        loop: the closed loop.
        clock: its instants.
        step_error: told what the worst step was.
    """

    def __init__(self, loop: ClosedLoop, clock: Clock, step_error: StepError):
        self._loop, self._step_error = loop, step_error
        self._messages = deque(loop.messages.between(0.0, clock.end))
        self._h, self._expected = 0.0, np.nan

    def begin(self, step: Step, y: State, rate: State) -> Signals:
        reference, messages = step.stages[0], due(self._messages, step.middle)
        if messages:
            y.memory[...] = self._loop.messages.received(messages, reference, y.motion, y.memory)
        signals = step.loop.derive(reference, y, step.push, rate)
        h = self._h if step.joined else 0.0
        self._step_error.add(step.t, y.v, h, self._expected - rate.v, rate.v)
        return signals

    def rate(self, step: Step, reference: Reference, y: State, rate: State) -> None:
        step.loop.derive(reference, y, step.push, rate)

    def arrive(self, step: Step, y: State, expected: Any = np.nan) -> None:
        self._h, self._expected = step.h, expected
        step.loop.settle(y)

    def finish(self, t: float, y: State) -> Signals:
        self._step_error.add(t, y.v)
        return self._loop.final(t, y)


class Sampled:
    """`Control` that acts once in so many multiples of dt, while torque is held in between.

    Args:
        loop: the closed loop.
        clock: its instants.
        every: how many multiples of dt a sample lasts.
        period: the same in s, as the controller integrates it.
        step_error: told what the worst step was.
        devices: sensors and actuators between robots and controller.
    """

    def __init__(
        self,
        loop: ClosedLoop,
        clock: Clock,
        every: int,
        period: float,
        step_error: StepError,
        devices: LiveDevices,
    ):
        self._devices = devices
        self._loop, self._every, self._step_error = loop, every, step_error
        self._controller = DiscreteController(loop.controller, period)
        self._acts_at_end = clock.sampled_at_end(every)
        self._after = loop.state(np.zeros(loop.size))
        step_error.add(0.0, loop.cell.v0)

    def begin(self, step: Step, y: State, rate: State) -> Signals:
        samples = step.checked and step.number % self._every == 0
        signals = self._sample(step.t, y, step.stages[0]) if samples else self._look(step.stages[0], y)
        self._devices.reach(step.t, step.middle, y.q)
        self.rate(step, step.stages[0], y, rate)
        step.loop.watch(y, signals, rate.v)
        return signals

    def rate(self, step: Step, reference: Reference, y: State, rate: State) -> None:
        step.loop.respond(y, self._devices.torque(reference.t, y.q, self._tau), step.push, rate)

    def arrive(self, step: Step, y: State, expected: Any = np.nan) -> None:
        self.rate(step, step.stages[2], y, self._after)
        self._step_error.add(step.t_next, y.v, step.h, expected - self._after.v)
        since = step.t_next - self._t
        y.z[...] = self._z + since * self._z_dot
        y.memory[...] = self._memory + since * self._memory_dot

    def finish(self, t: float, y: State) -> Signals:
        reference = self._loop.cell.references(np.array([t]))[0]
        signals = self._sample(t, y, reference) if self._acts_at_end else self._look(reference, y)
        self._devices.reach(t, t, y.q)
        return signals

    def _sample(self, t: float, y: State, reference: Reference) -> Signals:
        """Let the controller act on what is measured of the state, which gets its estimates and memory."""
        controller, devices = self._controller, self._devices
        motion = devices.measure(y.motion)
        self._t, self._z, self._memory = t, controller.z, controller.heard(t, motion)
        y.z[...], y.memory[...] = self._z, self._memory
        signals = controller.sample(t, motion, **self._loop.felt(y))
        self._z_dot, self._memory_dot = np.array(signals.z_dot), np.array(signals.memory_dot)
        self._tau = np.array(signals.tau)
        devices.command(t, self._loop.plant.applied(self._tau))
        return self._look(reference, y) if devices.senses else signals

    def _look(self, reference: Reference, y: State) -> Signals:
        """What the law would compute of the true state, with the torque that is held."""
        return replace(self._loop.look(reference, y), tau=self._tau)
