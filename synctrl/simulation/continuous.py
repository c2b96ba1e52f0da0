"""Continuous control: the controller acts at every instant, one differential equation with the plant."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.controller import Signals
from ..coupling.cell import Reference
from .advance import Agenda
from .clock import Clock
from .closed_loop import ClosedLoop
from .state import State
from .step_error import StepError
from .steps import Step


class Continuous:
    """`Control` that acts at every instant.

    Args:
        loop: the closed loop.
        clock: its instants.
        step_error: told what the worst step was.
    """

    def __init__(self, loop: ClosedLoop, clock: Clock, step_error: StepError):
        self._loop, self._step_error = loop, step_error
        self._messages = Agenda(loop.messages.between(0.0, clock.end))
        self._h, self._expected = 0.0, np.nan

    def begin(self, step: Step, y: State, rate: State) -> Signals:
        reference, due = step.stages[0], self._messages.until(step.middle)
        if due:
            y.memory[...] = self._loop.messages.received(due, reference, y.motion, y.memory)
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
