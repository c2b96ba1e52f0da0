"""Steps through the library: what it is told of a block of steps, and how long it is away."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

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


class Told(NamedTuple):
    """What the library is told of a block.

    Attributes:
        block: the block.
        times: where its steps begin, and the last one ends, s.
        marks: what happens at the start of each.
        acting: which disturbance and which load acts in each.
        arrays: where what is desired stands, by name.
        kept: what stands there.
    """

    block: DesiredStretch
    times: np.ndarray
    marks: np.ndarray
    acting: list[np.ndarray]
    arrays: dict[str, structs.Arrays]
    kept: list[np.ndarray]


class Stepper(ABC):
    """The structure `Steps` of a run, told of one block after another.

    Args:
        program: the run's.
        run: the run.

    Attributes:
        steps: what the library is given.
    """

    _told: Told

    def __init__(self, program: CompiledLoop, run: Run):
        self.program, self.run = program, run
        period = run.info.get("control_period") or 0.0
        self.steps = structs.Steps(holds=run.every is not None, period=period)
        self._said: DesiredStretch | None = None
        self.say_what_acts()

    def say_what_acts(self) -> None:
        """Say what acts from outside, and what is carried."""
        program, torques = self.program, self.run.schedule.torques
        program.tell(self.steps, {"disturbance": torques, "pi": program.carried})

    def look_at(self, block: DesiredStretch) -> None:
        """Say what is desired and happens in the steps of a block, if that was not said before."""
        if block is not self._said:
            self._say(self._read(block))

    def look_at_end(self) -> None:
        """Say of the end of the run: one step of no length, in which acts what acted in the last step."""
        self._say(self._end)

    def call(self, first: int, last: int) -> None:
        """Make some steps of the block that was told of last."""
        self._point(first, last)
        self._made(self._told.times[first : last + 1], self._told.marks[first:last])

    # -- internals ----------------------------------------------------------------------------------------

    @cached_property
    def _end(self) -> Told:
        """The end as a step of no length, in which acts what acted in the last step."""
        run, clock, yes, no = self.run, self.run.clock, np.array([True]), np.array([False])
        nothing = Stretch(clock.steps, np.repeat(clock.end, 2), yes, yes, np.array([clock.count]))
        due = np.array([run.every is None or clock.sampled_at_end(run.every)])
        before = clock.stretch(clock.steps - 1, clock.steps).middles
        block = desired_in(run.loop.cell, nothing, ~yes)
        return self._made_ready(block, marked(yes, yes, due, no), before)

    def _read(self, block: DesiredStretch) -> Told:
        """What there is to say of a block."""
        steps, clock = block.steps, self.run.clock
        sampled, joined = _sampled(self.run, steps), clock.joined(steps.first, steps.starts)
        return self._made_ready(block, marked(steps.checked, steps.logged, sampled, joined), steps.middles)

    def _made_ready(self, block: DesiredStretch, marks: np.ndarray, middles: np.ndarray) -> Told:
        """What there is to say of a block with such marks, in whose steps acts what does in these middles."""
        schedules = self.run.schedule, self.program.loop.plant.schedule
        acting = [schedule.windows(middles).astype(np.intc) for schedule in schedules]
        self.program.tell(self.steps, block.desired)
        arrays = {name: structs.Arrays.from_buffer_copy(getattr(self.steps, name)) for name in block.desired}
        kept = [self.steps.kept[name] for name in block.desired]
        return Told(block, np.ascontiguousarray(block.steps.times), marks, acting, arrays, kept)

    @abstractmethod
    def _made(self, times: np.ndarray, marks: np.ndarray) -> None:
        """Call the library for steps between these times, with what happens at their starts."""

    def _say(self, told: Told) -> None:
        """Tell the library of a block."""
        for name, arrays in told.arrays.items():
            setattr(self.steps, name, arrays)
        self.steps.length, self._told, self._said = len(told.marks), told, told.block
        self.steps.ends = told.block.ends.ctypes.data

    def _point(self, first: int, last: int) -> None:
        """Say which steps of the block are to be made."""
        steps, told = self.steps, self._told
        disturbed, loaded = told.acting
        steps.first, steps.count = first, last - first
        steps.t, steps.marks = told.times[first:].ctypes.data, told.marks[first:].ctypes.data
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
