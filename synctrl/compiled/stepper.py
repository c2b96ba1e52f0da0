"""Steps through the library: what it is told of a block of steps, and how long it is away."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ..simulation.clock import Stretch
from ..simulation.closed_loop import ClosedLoop
from ..simulation.engines import Run
from ..simulation.guard import checks, limits_of
from . import structs
from .arrays import CompiledLoop
from .structs import Mark
from .tables import DesiredStretch, desired_in

#: how long the library may be away, s: Ctrl-C is seen when it comes back
AWAY = 0.05


class Pace:
    """How many steps the library makes at a time, so that it is back before `AWAY`; measured on the way."""

    def __init__(self) -> None:
        self._steps = 1

    def parts(self, count: int) -> Iterator[tuple[int, int]]:
        """Steps 0 to `count` as ranges [first, last), each as long as was learnt until then."""
        first = 0
        while first < count:
            last = min(first + self._steps, count)
            yield first, last
            first = last

    def learn(self, steps: int, took: float) -> None:
        """Aim at half the time, from how long some steps took, s; grow no faster than eightfold."""
        fitting = int(0.5 * AWAY * steps / max(took, 1e-6))
        self._steps = max(1, min(8 * self._steps, fitting))


class Stepper:
    """The structure `Steps` of a run, told of one block after another.

    Args:
        program: the run's.
        run: the run.

    Attributes:
        steps: what the library is given.
    """

    def __init__(self, program: CompiledLoop, run: Run):
        self.program, self.run = program, run
        period = run.info.get("control_period") or 0.0
        self.steps = structs.Steps(holds=run.every is not None, period=period)
        self._block: DesiredStretch | None = None
        self.say_what_acts()

    def say_what_acts(self) -> None:
        """Say what acts from outside, and what is carried."""
        program, torques = self.program, self.run.schedule.torques
        program.tell(self.steps, {"disturbance": torques, "pi": program.carried})

    def look_at(self, block: DesiredStretch) -> None:
        """Say what is desired and happens in the steps of a block, if that was not said before."""
        if block is self._block:
            return
        steps, clock = block.steps, self.run.clock
        sampled = _sampled(self.run, steps)
        joined = clock.joined(steps.first, steps.starts)
        self._say(block, steps.times, marked(steps.checked, steps.logged, sampled, joined), steps.middles)

    def look_at_end(self) -> None:
        """Say of the end of the run: one step of no length, in which acts what acted in the last step."""
        run, clock, (block, before) = self.run, self.run.clock, self._end
        yes, no = np.array([True]), np.array([False])
        due = np.array([run.every is None or clock.sampled_at_end(run.every)])
        self._say(block, block.steps.times, marked(yes, yes, due, no), before)

    def call(self, first: int, last: int) -> None:
        """Make some steps of the block that was told of last."""
        self._point(first, last)
        self._made(self._times[first : last + 1], self._marks[first:last])

    # -- internals ----------------------------------------------------------------------------------------

    @cached_property
    def _end(self) -> tuple[DesiredStretch, np.ndarray]:
        """The end as a step of no length, and the middle of the last step before it."""
        clock, yes = self.run.clock, np.array([True])
        nothing = Stretch(clock.steps, np.repeat(clock.end, 2), yes, yes, np.array([clock.count]))
        before = clock.stretch(clock.steps - 1, clock.steps).middles
        return desired_in(self.run.loop.cell, nothing, ~yes), before

    def _made(self, times: np.ndarray, marks: np.ndarray) -> None:
        """Call the library for steps between these times, with what happens at their starts."""
        raise NotImplementedError

    def _say(self, block: DesiredStretch, times: np.ndarray, marks: np.ndarray, middles: np.ndarray) -> None:
        """What is desired in a block, what happens and when, and what acts in the middles of its steps."""
        self.program.tell(self.steps, block.desired)
        self.steps.length, self._block = len(marks), block
        self.steps.ends = block.ends.ctypes.data
        self._times, self._marks = np.ascontiguousarray(times), marks
        schedules = self.run.schedule, self.program.loop.plant.schedule
        self._acting = [schedule.windows(middles).astype(np.intc) for schedule in schedules]

    def _point(self, first: int, last: int) -> None:
        """Say which steps of the block are to be made."""
        steps, (disturbed, loaded) = self.steps, self._acting
        steps.first, steps.count = first, last - first
        steps.t, steps.marks = self._times[first:].ctypes.data, self._marks[first:].ctypes.data
        steps.disturbed, steps.loaded = disturbed[first:].ctypes.data, loaded[first:].ctypes.data


def _sampled(run: Run, steps: Stretch) -> np.ndarray:
    """Whether each step begins with a sample: on multiples of dt, or always if control is continuous."""
    if run.every is None:
        return np.ones(len(steps.starts), dtype=bool)
    return steps.checked & (steps.number % run.every == 0)


def marked(checked: np.ndarray, logged: np.ndarray, sampled: np.ndarray, joined: np.ndarray) -> np.ndarray:
    """What happens at the start of each step, as one number."""
    marks = Mark.CHECKED * checked + Mark.LOGGED * logged + Mark.SAMPLED * sampled + Mark.JOINED * joined
    return marks.astype(np.int8)


def found_check(loop: ClosedLoop, status: int) -> str:
    """What the driver's guard has found, by the number that it gives it."""
    return checks(limits_of(loop.cell.task))[status - 1]
