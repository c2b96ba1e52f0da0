"""The compiled engine: blocks of steps through the library, and the same Result as the reference."""

from __future__ import annotations

import ctypes
import operator
from collections.abc import Iterable, Iterator
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..control.measured import check_network
from ..coupling.cell import Cell
from ..coupling.desired import rows_of
from ..renamed import names_elsewhere
from ..simulation.advance import up_to_a_failure
from ..simulation.clock import Clock, Stretch
from ..simulation.engines import Run, before_the_start, finish
from ..simulation.guard import Alarm, Progress, checks, limits_of, report_time, stopped
from ..simulation.recorder import Recorder
from ..simulation.result import Result
from . import structs
from .agenda import Agenda
from .hooks import Hooks
from .known import check_known
from .program import Program, one_after_another
from .quantities import DESIRED, LOGS, SLIDE
from .structs import Mark

#: bytes of references that one block of steps may need
BLOCK_BYTES = 32_000_000
#: steps of a block at most
BLOCK_STEPS = 1024
#: how long the library may be away, s: Ctrl-C is seen when it comes back
AWAY = 0.05


class DesiredStretch(NamedTuple):
    """Consecutive steps with what is desired at their start, middle and end, by the names of quantities."""

    steps: Stretch
    desired: dict[str, np.ndarray]


def blocks(program: Program, clock: Clock) -> Iterator[DesiredStretch]:
    """The steps of a run, in blocks that fit into memory; all before an instant whose references fail."""
    cell = program.loop.cell

    def make(first: int, last: int) -> DesiredStretch:
        stretch = clock.stretch(first, last)
        return DesiredStretch(stretch, _tables(cell, stretch.stages))

    length = min(BLOCK_STEPS, max(1, BLOCK_BYTES // _step_bytes(cell)))
    for first, last in clock.stretches(length):
        yield from up_to_a_failure(make, first, last)


def _step_bytes(cell: Cell) -> int:
    """Bytes of what is desired in one step."""
    weights = 0 if cell.coupling.is_constant else 4 * cell.m**2
    return 3 * 8 * cell.n * (rows_of(cell.space) * cell.m + weights)


class Tables:
    """What is desired in a run, kept for the next one with the same motions if it fits into memory.

    What is kept is looked up and replaced as a whole, so threads may share it.
    """

    def __init__(self) -> None:
        self._kept: tuple[list[Any], tuple, list[DesiredStretch]] = [], (), []

    def blocks(self, program: Program, clock: Clock) -> Iterable[DesiredStretch]:
        """The steps of a run, made anew if the run before had other motions, weights, instants or rows."""
        cell = program.loop.cell
        if clock.steps * _step_bytes(cell) > BLOCK_BYTES:
            return blocks(program, clock)
        parts = [cell.coupling, type(cell.space), *(member.trajectory for member in cell.members)]
        known, instants, kept = self._kept
        same = len(parts) == len(known) and all(map(operator.is_, parts, known))
        asked = clock, clock.every, tuple(cell.clocks.tolist())
        if same and instants == asked:
            return kept
        return self._keep(parts, asked, blocks(program, clock))

    def _keep(
        self, parts: list[Any], asked: tuple, fresh: Iterable[DesiredStretch]
    ) -> Iterator[DesiredStretch]:
        """Fresh blocks, which are known from when the last of them has been made."""
        found = []
        for block in fresh:
            found.append(block)
            yield block
        self._kept = parts, asked, found


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


class Compiled:
    """The closed loop as generated C, as one engine among others.

    Args:
        libraries: what earlier runs have loaded, by what it was made for.
        tables: what was desired in earlier runs.
    """

    def __init__(self, libraries: dict[str, ctypes.CDLL] | None = None, tables: Tables | None = None):
        self._libraries, self._blocks = libraries, blocks if tables is None else tables.blocks

    def refuses(self, run: Run) -> None:
        """See `Engine`.

        Raises:
            InputError: the closed loop cannot be generated; it has what and why. Or sampled control with a
                network in continuous time.
        """
        check_known(run.loop)
        if run.every is not None:
            check_network(run.loop.controller.network, run.loop.messages, run.info["control_period"])

    def load(self, run: Run) -> Program:
        """The program of a run, found or built.

        Raises:
            see `Program`
        """
        return Program(run.loop, self._libraries)

    def run(self, run: Run, progress: Progress | None = None) -> Result:
        """Make a run; see `Engine`."""
        run.info["engine"] = "compiled"
        recorder = run.recorder()
        with before_the_start(run):
            program = self.load(run)

        def log() -> None:
            steps, pace = _Steps(program, run, recorder), Pace()
            for block in self._blocks(program, run.clock):
                for first, last in pace.parts(len(block.steps.starts)):
                    start = perf_counter()
                    steps.advance(block, first, last)
                    pace.learn(last - first, perf_counter() - start)
                    recorder.reached = float(block.steps.times[last])
                    report_time(progress, recorder.reached)
            steps.finish()

        return finish(run, recorder, log)


class _Steps:
    """The library's `advance` with everything it needs for one run; the state is the recorder's."""

    def __init__(self, program: Program, run: Run, recorder: Recorder):
        self._program, self._run, self._recorder = program, run, recorder
        v0, work = run.loop.cell.v0, program.work
        self._before = np.zeros((2, 2, v0.size))
        buffers = (part.ctypes.data for part in self._before)
        work.step_error = structs.StepError(0, np.abs(v0).max(), 0, 0, 0, *buffers)
        self._steps = structs.Steps(holds=run.every is not None, period=run.info.get("control_period") or 0.0)
        self._block: DesiredStretch | None = None
        program.tell(self._steps, {"disturbance": run.schedule.torques, "pi": program.carried})
        ctypes.memset(work.side, 0, 8 * run.loop.cell.n)
        self._state, self._agenda = run.loop.state(recorder.state), Agenda(program, run)
        program.quantities.hidden = self._state.hidden.ctypes.data
        self._hooks = Hooks(run, program.quantities, self._steps, self._state, self._agenda)

    def advance(self, block: DesiredStretch, first: int, last: int) -> None:
        """Make some steps of a block; what is on the agenda comes between two calls of the library."""
        starts, middles = block.steps.starts, block.steps.middles
        while first < last:
            self._agenda.meet(starts[first], middles[first], self._state)
            end = first + max(1, int(np.searchsorted(middles[first:last], self._agenda.ahead)))
            self._part(block, first, end)
            first = end

    def _part(self, block: DesiredStretch, first: int, last: int) -> None:
        """Make some steps of a block in one go."""
        self._look_at(block)
        part = slice(first, last)
        windows = [each[part] for each in self._windows]
        self._call(first, block.steps.times[first : last + 1], self._marks[part], windows)

    def finish(self) -> None:
        """Log the end of the run: one step of no length, in which acts what acted in the last step."""
        clock, every = self._run.clock, self._run.every
        end, yes, no = np.array([clock.end]), np.array([True]), np.array([False])
        nothing = Stretch(clock.steps, np.repeat(end, 2), yes, yes, np.array([clock.count]))
        block = DesiredStretch(nothing, _tables(self._run.loop.cell, np.array([end] * 3)))
        due = np.array([every is None or clock.sampled_at_end(every)])
        if due[0]:
            self._agenda.tell(clock.end, clock.end, self._state)
        before = clock.stretch(clock.steps - 1, clock.steps).middles
        self._look_at(block)
        self._call(0, nothing.times, _marks(yes, yes, due, no), self._acting(before))

    def _sampled(self, steps: Stretch) -> np.ndarray:
        """Whether each step begins with a sample: on multiples of dt, or always if control is continuous."""
        if self._run.every is None:
            return np.ones(len(steps.starts), dtype=bool)
        return steps.checked & (steps.number % self._run.every == 0)

    def _acting(self, middles: np.ndarray) -> list[np.ndarray]:
        """Which disturbance and which load acts in steps: what acts in the middle acts in all of one."""
        schedules = self._run.schedule, self._program.loop.plant.schedule
        return [schedule.windows(middles).astype(np.intc) for schedule in schedules]

    def _look_at(self, block: DesiredStretch) -> None:
        """Say what is desired and happens in the steps of a block, if that was not said before."""
        if block is self._block:
            return
        steps = block.steps
        self._program.tell(self._steps, block.desired)
        self._steps.length, self._block = len(steps.starts), block
        joined = self._run.clock.joined(steps.first, steps.starts)
        self._marks = _marks(steps.checked, steps.logged, self._sampled(steps), joined)
        self._windows = self._acting(steps.middles)

    def _call(self, first: int, times: np.ndarray, marks: np.ndarray, windows: list[np.ndarray]) -> None:
        """Make steps between these times, with what happens at their starts and acts in them."""
        program, recorder, report = self._program, self._recorder, structs.Report()
        steps, times = self._steps, np.ascontiguousarray(times)
        steps.first, steps.count = first, len(marks)
        arrays = (times, marks, *windows)
        steps.t, steps.marks, steps.disturbed, steps.loaded = (array.ctypes.data for array in arrays)
        log = structs.Log(**{name: recorder.address_ahead(name) for name in LOGS})
        try:
            program.call("advance", steps, recorder.state, log, report)
        finally:  # an interrupt that came meanwhile is raised before the call has returned
            recorder.advance(times[:-1][marks & Mark.LOGGED > 0][: report.rows])
            worst = program.work.step_error
            self._run.step_error.note(worst.largest, worst.speed, worst.at, worst.time)
        self._hooks.fail()
        if report.status:
            check = checks(limits_of(program.loop.cell.task))[report.status - 1]
            found = Alarm(check, report.robot, report.value)
            t, v = float(times[report.step]), recorder.last("v")
            raise stopped(program.loop, t, recorder.state, v, found)


def _marks(checked: np.ndarray, logged: np.ndarray, sampled: np.ndarray, joined: np.ndarray) -> np.ndarray:
    """What happens at the start of each step, as one number."""
    marks = Mark.CHECKED * checked + Mark.LOGGED * logged + Mark.SAMPLED * sampled + Mark.JOINED * joined
    return marks.astype(np.int8)


def _tables(cell: Cell, instants: np.ndarray) -> dict[str, np.ndarray]:
    """Desired motion and weights at the instants of three stages, (3, T), one stage after another.

    Every motion is asked once, at best many of them together: what a step costs does not grow with n.
    """
    flat = instants.ravel()
    desired = dict(zip((*DESIRED, *SLIDE), cell.told_together(range(cell.n), flat), strict=False))
    weights = cell.weights(flat[:1] if cell.coupling.is_constant else flat)
    return {**desired, "weights": one_after_another(weights)}


__getattr__ = names_elsewhere(__name__, ".engine", Block="DesiredStretch")
