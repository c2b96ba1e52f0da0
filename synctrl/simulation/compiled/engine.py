"""Runs of the compiled engine: blocks of steps through the library, and the same Result as the reference."""

from __future__ import annotations

import ctypes
import operator
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ...tasks.cell import Cell
from ..clock import Clock
from ..disturbances import DisturbanceSchedule
from ..guard import CHECKS, Finding, stopped
from ..recorder import Recorder
from ..step_error import StepError
from .program import Program
from .structs import LogStruct, ReferenceStruct, ReportStruct, StepErrorStruct

#: bytes of references that one block of steps may need
BLOCK_BYTES = 32_000_000


class Block(NamedTuple):
    """Consecutive steps, [first, last) of the clock, with what is desired at their start, middle and end."""

    first: int
    last: int
    desired: np.ndarray
    weights: np.ndarray


def blocks(program: Program, clock: Clock) -> Iterator[Block]:
    """The steps of a run, in blocks that fit into memory."""
    cell, count = program.loop.cell, len(clock.times) - 1
    weights = 0 if cell.coupling.is_constant else 4 * cell.m**2
    length = max(1, BLOCK_BYTES // (3 * 8 * cell.n * (3 * cell.m + weights)))
    for first in range(0, count, length):
        last = min(first + length, count)
        starts, ends = clock.times[first:last], clock.times[first + 1 : last + 1]
        middles, ends = 0.5 * (starts + ends), np.nextafter(ends, -np.inf)
        yield Block(first, last, *_tables(cell, np.array([starts, middles, ends])))


class Tables:
    """What is desired in a run that fits into one block, kept for the next run with the same motions."""

    def __init__(self) -> None:
        self._made_for: tuple[Any, ...] = ()
        self._times = np.zeros(0)
        self._blocks: list[Block] = []

    def blocks(self, program: Program, clock: Clock) -> Iterable[Block]:
        """The steps of a run, made anew if the run before had other motions, weights or instants."""
        cell = program.loop.cell
        wanted = (cell.coupling, *(member.trajectory for member in cell.members))
        same = len(wanted) == len(self._made_for) and all(map(operator.is_, wanted, self._made_for))
        if not (same and np.array_equal(self._times, clock.times)):
            fresh = blocks(program, clock)
            first = next(fresh)
            if first.last < len(clock.times) - 1:
                return chain([first], fresh)
            self._made_for, self._times, self._blocks = wanted, clock.times, [first]
        return self._blocks


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
        every: with sampled control, how many logged instants one sample lasts.
        progress: called with the time reached, s, after every block.
        tables: those of earlier runs.

    Raises:
        NonFiniteError, SingularJacobianError, OrientationError: as the reference engine.
    """
    y = recorder.state
    steps = _Steps(program, clock, schedule, step_error, every)
    for block in blocks(program, clock) if tables is None else tables.blocks(program, clock):
        steps.advance(block, y, recorder)
        if progress is not None:
            progress(float(clock.times[block.last]))
    steps.finish(y, recorder)


class _Steps:
    """The library's `advance` with everything it needs for one run."""

    def __init__(
        self,
        program: Program,
        clock: Clock,
        schedule: DisturbanceSchedule,
        step_error: StepError,
        every: int | None,
    ):
        self._program, self._clock, self._every = program, clock, every
        v0 = program.loop.cell.v0
        self._before = np.zeros((2, 2, v0.size))
        buffers = (part.ctypes.data for part in self._before)
        self._step_error, self._worst = step_error, StepErrorStruct(0, np.abs(v0).max(), 0, 0, 0, *buffers)
        program.work.step_error = ctypes.addressof(self._worst)
        self._middles = 0.5 * (clock.times[:-1] + clock.times[1:])
        self._window = schedule.windows(self._middles).astype(np.intc)
        self._torques = np.ascontiguousarray(schedule.torques)
        self._logged = np.isin(clock.times, clock.logged)
        index = np.cumsum(self._logged) - 1
        due, joined = self._logged & (index % (every or 1) == 0), clock.joined
        self._marks = joined if every is None else due
        ctypes.memset(program.work.sign, 0, 8 * program.loop.cell.n)

    def advance(self, block: Block, y: np.ndarray, recorder: Recorder) -> None:
        """Move y through a block, in place."""
        steps = slice(block.first, block.last)
        times = np.ascontiguousarray(self._clock.times[block.first : block.last + 1])
        self._call(block, times, self._logged[steps], self._marks[steps], self._window[steps], y, recorder)

    def finish(self, y: np.ndarray, recorder: Recorder) -> None:
        """Log the end of the run: one step of no length."""
        end = self._clock.times[-1:]
        tables = _tables(self._program.loop.cell, np.array([end] * 3))
        times, yes, no = np.repeat(end, 2), np.array([True]), np.array([False])
        self._call(Block(0, 1, *tables), times, yes, no, self._window[-1:], y, recorder)

    def _call(
        self,
        block: Block,
        times: np.ndarray,
        logged: np.ndarray,
        marks: np.ndarray,
        window: np.ndarray,
        y: np.ndarray,
        recorder: Recorder,
    ) -> None:
        program, library = self._program, self._program.library
        constant = program.loop.cell.coupling.is_constant
        table = ReferenceStruct(
            block.desired.ctypes.data, block.weights.ctypes.data, len(times) - 1, int(constant)
        )
        rows = recorder.rows_ahead()
        log, report = LogStruct(*(row.ctypes.data for row in rows[1:])), ReportStruct()
        arrays = [times, logged, marks, np.ascontiguousarray(window), self._torques, y]
        call = library.advance if self._every is None else library.advance_sampled
        call.restype = ctypes.c_long
        count = call(
            ctypes.byref(program.cell),
            ctypes.byref(table),
            *(array.ctypes.data_as(ctypes.c_void_p) for array in arrays),
            *(ctypes.byref(struct) for struct in (log, program.work, report)),
        )
        recorder.advance(times[:-1][logged][:count])
        worst = self._worst
        self._step_error.note(worst.largest, worst.speed, worst.at, worst.time)
        if report.status:
            found = Finding(CHECKS[report.status - 1], report.robot, report.value)
            raise stopped(program.loop, float(times[report.step]), y, recorder.last("v"), found)


def _tables(cell: Cell, instants: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Desired motion, (3, T, n, 3, m), and weights at the instants of three stages, (3, T).

    Every motion is asked once and goes straight to its place: what a step costs does not grow with n.
    """
    flat = instants.ravel()
    desired = np.empty((flat.size, cell.n, 3, cell.m))
    for i, member in enumerate(cell.members):
        for k, part in enumerate(member.trajectory(flat)):
            desired[:, i, k] = part
    parts = cell.coupling.weights(flat[:1] if cell.coupling.is_constant else flat, cell.m)
    return desired, np.stack(parts, axis=2)  # as one row of instants after the other
