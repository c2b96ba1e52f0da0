"""Runs of the compiled engine: blocks of steps through the library, and the same Result as the reference."""

from __future__ import annotations

import ctypes
import operator
from collections.abc import Callable, Iterable, Iterator
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..coupling.cell import Cell
from ..simulation.advance import up_to_a_failure
from ..simulation.clock import Clock, Stretch
from ..simulation.guard import Finding, checks, limits_of, stopped, tell
from ..simulation.recorder import Recorder
from ..simulation.schedules import DisturbanceSchedule
from ..simulation.step_error import StepError
from . import structs
from .program import Program, one_after_another
from .quantities import DESIRED, LOGS
from .structs import Mark

#: bytes of references that one block of steps may need
BLOCK_BYTES = 32_000_000
#: steps of a block at most
BLOCK_STEPS = 1024
#: how long the library may be away, s: Ctrl-C is seen when it comes back
AWAY = 0.05


class Block(NamedTuple):
    """Consecutive steps with what is desired at their start, middle and end, by the names of quantities."""

    steps: Stretch
    desired: dict[str, np.ndarray]


def blocks(program: Program, clock: Clock) -> Iterator[Block]:
    """The steps of a run, in blocks that fit into memory; all before an instant whose references fail."""
    cell = program.loop.cell

    def make(first: int, last: int) -> Block:
        stretch = clock.stretch(first, last)
        return Block(stretch, _tables(cell, stretch.stages))

    for first, last in clock.stretches(_length(cell)):
        yield from up_to_a_failure(make, first, last)


def _length(cell: Cell) -> int:
    """Steps of a block."""
    return min(BLOCK_STEPS, max(1, BLOCK_BYTES // _step_bytes(cell)))


def _step_bytes(cell: Cell) -> int:
    """Bytes of what is desired in one step."""
    weights = 0 if cell.coupling.is_constant else 4 * cell.m**2
    return 3 * 8 * cell.n * (3 * cell.m + weights)


class Kept(NamedTuple):
    """The blocks of a run, and what they were made for: motions and weights, the clock, and its log."""

    made_for: tuple[Any, ...]
    instants: tuple[Clock, int] | None
    blocks: list[Block]


class Tables:
    """What is desired in a run, kept for the next one with the same motions if it fits into memory.

    What is kept is looked up and replaced as a whole, so threads may share it.
    """

    def __init__(self) -> None:
        self._kept = Kept((), None, [])

    def blocks(self, program: Program, clock: Clock) -> Iterable[Block]:
        """The steps of a run, made anew if the run before had other motions, weights or instants."""
        cell, kept = program.loop.cell, self._kept
        if clock.steps * _step_bytes(cell) > BLOCK_BYTES:
            return blocks(program, clock)
        wanted = (cell.coupling, *(member.trajectory for member in cell.members))
        same = len(wanted) == len(kept.made_for) and all(map(operator.is_, wanted, kept.made_for))
        if same and kept.instants == (clock, clock.every):
            return kept.blocks
        return self._keep(blocks(program, clock), wanted, clock)

    def _keep(self, fresh: Iterable[Block], wanted: tuple[Any, ...], clock: Clock) -> Iterator[Block]:
        """Fresh blocks, which are known from when the last of them has been made."""
        found = []
        for block in fresh:
            found.append(block)
            yield block
        self._kept = Kept(wanted, (clock, clock.every), found)


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


def advance(
    program: Program,
    clock: Clock,
    schedule: DisturbanceSchedule,
    recorder: Recorder,
    step_error: StepError,
    every: int | None = None,
    progress: Callable[[float], Any] | None = None,
    tables: Tables | None = None,
) -> None:
    """Run a compiled program and log into the recorder.

    Args:
        program: the closed loop.
        clock: its instants.
        schedule: disturbances.
        recorder: where logged instants go; after a failure it has those before it.
        step_error: told what the worst step was.
        every: with sampled control, how many steps of dt one sample lasts.
        progress: called with the time reached, s, several times a second.
        tables: those of earlier runs.

    Raises:
        NonFiniteError, SingularJacobianError, OrientationError: as the reference engine.
        SynctrlError: a desired motion or weight fails.
    """
    y, pace = recorder.state, Pace()
    steps = _Steps(program, clock, schedule, recorder, step_error, every)
    for block in blocks(program, clock) if tables is None else tables.blocks(program, clock):
        for first, last in pace.parts(len(block.steps.starts)):
            start = perf_counter()
            steps.advance(block, first, last, y)
            pace.learn(last - first, perf_counter() - start)
            recorder.reached = float(block.steps.times[last])
            tell(progress, recorder.reached)
    steps.finish(y)


class _Steps:
    """The library's `advance` with everything it needs for one run."""

    def __init__(
        self,
        program: Program,
        clock: Clock,
        schedule: DisturbanceSchedule,
        recorder: Recorder,
        step_error: StepError,
        every: int | None,
    ):
        self._program, self._clock, self._every = program, clock, every
        self._schedule, self._recorder, self._step_error = schedule, recorder, step_error
        v0, work = program.loop.cell.v0, program.work
        self._before = np.zeros((2, 2, v0.size))
        buffers = (part.ctypes.data for part in self._before)
        work.step_error = structs.StepError(0, np.abs(v0).max(), 0, 0, 0, *buffers)
        self._steps = structs.Steps(holds=every is not None)
        self._block: Block | None = None
        program.tell(self._steps, {"disturbance": schedule.torques, "pi": program.carried})
        ctypes.memset(work.side, 0, 8 * program.loop.cell.n)

    def advance(self, block: Block, first: int, last: int, y: np.ndarray) -> None:
        """Move y through some steps of a block, in place."""
        steps = block.steps
        part = slice(first, last)
        joined = self._clock.joined(steps.first + first, steps.starts[part])
        marks = _marks(steps.checked[part], steps.logged[part], self._sampled(steps, part), joined)
        windows = self._windows(steps.middles[part])
        self._call(block, first, steps.times[first : last + 1], marks, windows, y)

    def finish(self, y: np.ndarray) -> None:
        """Log the end of the run: one step of no length."""
        end, clock = np.array([self._clock.end]), self._clock
        at = np.array([clock.count])
        nothing = Stretch(clock.steps, np.repeat(end, 2), at > 0, at > 0, at)
        block = Block(nothing, _tables(self._program.loop.cell, np.array([end] * 3)))
        due = np.array([self._every is None or clock.sampled_at_end(self._every)])
        windows = self._windows(clock.stretch(clock.steps - 1, clock.steps).middles)
        self._call(block, 0, nothing.times, _marks(at > 0, at > 0, due, at < 0), windows, y)

    def _windows(self, middles: np.ndarray) -> list[np.ndarray]:
        """Which disturbance acts in each step, and which load is carried."""
        schedules = self._schedule, self._program.loop.plant.schedule
        return [schedule.windows(middles).astype(np.intc) for schedule in schedules]

    def _sampled(self, steps: Stretch, part: slice) -> np.ndarray:
        """Whether each step begins with a sample: on multiples of dt, or always if control is continuous."""
        if self._every is None:
            return np.ones(len(steps.starts[part]), dtype=bool)
        return steps.checked[part] & (steps.number[part] % self._every == 0)

    def _of(self, block: Block) -> structs.Steps:
        """The steps of a block."""
        if block is not self._block:
            self._program.tell(self._steps, block.desired)
            self._steps.length, self._block = len(block.steps.starts), block
        return self._steps

    def _call(
        self,
        block: Block,
        first: int,
        times: np.ndarray,
        marks: np.ndarray,
        windows: list[np.ndarray],
        y: np.ndarray,
    ) -> None:
        program, recorder, report = self._program, self._recorder, structs.Report()
        steps, times, (disturbed, loaded) = self._of(block), np.ascontiguousarray(times), windows
        steps.first, steps.count, steps.t, steps.marks = (
            first,
            len(marks),
            times.ctypes.data,
            marks.ctypes.data,
        )
        steps.disturbed, steps.loaded = disturbed.ctypes.data, loaded.ctypes.data
        log = structs.Log(**{name: recorder.address_ahead(name) for name in LOGS})
        try:
            program.call("advance", steps, y, log, report)
        finally:  # an interrupt that came meanwhile is raised before the call has returned
            recorder.advance(times[:-1][marks & Mark.LOGGED > 0][: report.rows])
            worst = program.work.step_error
            self._step_error.note(worst.largest, worst.speed, worst.at, worst.time)
        if report.status:
            check = checks(limits_of(program.loop.cell.task))[report.status - 1]
            found = Finding(check, report.robot, report.value)
            raise stopped(program.loop, float(times[report.step]), y, recorder.last("v"), found)


def _marks(checked: np.ndarray, logged: np.ndarray, sampled: np.ndarray, joined: np.ndarray) -> np.ndarray:
    """What happens at the start of each step, as one number."""
    marks = Mark.CHECKED * checked + Mark.LOGGED * logged + Mark.SAMPLED * sampled + Mark.JOINED * joined
    return marks.astype(np.int8)


def _tables(cell: Cell, instants: np.ndarray) -> dict[str, np.ndarray]:
    """Desired motion and weights at the instants of three stages, (3, T), one stage after another.

    Every motion is asked once and goes straight to its place: what a step costs does not grow with n.
    """
    flat = instants.ravel()
    desired = {name: np.empty((flat.size, cell.n, cell.m)) for name in DESIRED}
    for i in range(cell.n):
        for name, part in zip(DESIRED, cell.motion(i, flat), strict=True):
            desired[name][:, i] = part
    weights = cell.weights(flat[:1] if cell.coupling.is_constant else flat)
    return {**desired, "weights": one_after_another(weights)}
