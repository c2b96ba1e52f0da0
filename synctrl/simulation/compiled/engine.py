"""Runs of the compiled engine: blocks of steps through the library, and the same Result as the reference."""

from __future__ import annotations

import ctypes
import operator
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ...errors import OrientationError, SimulationError
from ...tasks.cell import Cell
from ..clock import Clock
from ..disturbances import DisturbanceSchedule
from ..guard import fastest, not_finite, run_away, singular
from ..recorder import Recorder
from .program import Program
from .structs import LogStruct, ReferenceStruct, ReportStruct

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


class Kept(NamedTuple):
    """The blocks of a run, and what they were made for: motions and weights, and instants."""

    made_for: tuple[Any, ...]
    times: np.ndarray
    blocks: list[Block]


class Tables:
    """What is desired in a run that fits into one block, kept for the next run with the same motions.

    What is kept is looked up and replaced as a whole, so threads may share it.
    """

    def __init__(self) -> None:
        self._kept = Kept((), np.zeros(0), [])

    def blocks(self, program: Program, clock: Clock) -> Iterable[Block]:
        """The steps of a run, made anew if the run before had other motions, weights or instants."""
        cell, kept = program.loop.cell, self._kept
        wanted = (cell.coupling, *(member.trajectory for member in cell.members))
        same = len(wanted) == len(kept.made_for) and all(map(operator.is_, wanted, kept.made_for))
        if same and np.array_equal(kept.times, clock.times):
            return kept.blocks
        fresh = blocks(program, clock)
        first = next(fresh)
        if first.last < len(clock.times) - 1:
            return chain([first], fresh)
        self._kept = Kept(wanted, clock.times, [first])
        return [first]


def advance(
    program: Program,
    clock: Clock,
    schedule: DisturbanceSchedule,
    recorder: Recorder,
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
        every: with sampled control, how many logged instants one sample lasts.
        progress: called with the time reached, s, after every block.
        tables: those of earlier runs.

    Raises:
        NonFiniteError, SingularJacobianError, OrientationError: as the reference engine.
    """
    y = program.loop.initial_state()
    steps = _Steps(program, clock, schedule, every)
    for block in blocks(program, clock) if tables is None else tables.blocks(program, clock):
        steps.advance(block, y, recorder)
        if progress is not None:
            progress(float(clock.times[block.last]))
    steps.finish(y, recorder)


class _Steps:
    """The library's `advance` with everything it needs for one run."""

    def __init__(self, program: Program, clock: Clock, schedule: DisturbanceSchedule, every: int | None):
        self._program, self._clock, self._every = program, clock, every
        self._middles = 0.5 * (clock.times[:-1] + clock.times[1:])
        self._window = schedule.windows(self._middles).astype(np.intc)
        self._torques = np.ascontiguousarray(schedule.torques)
        self._logged = np.isin(clock.times, clock.logged)
        index = np.cumsum(self._logged) - 1
        self._due = self._logged & (index % (every or 1) == 0)
        ctypes.memset(program.work.sign, 0, 8 * program.loop.cell.n)

    def advance(self, block: Block, y: np.ndarray, recorder: Recorder) -> None:
        """Move y through a block, in place."""
        steps = slice(block.first, block.last)
        times = np.ascontiguousarray(self._clock.times[block.first : block.last + 1])
        self._call(block, times, self._logged[steps], self._due[steps], self._window[steps], y, recorder)

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
        due: np.ndarray,
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
        arrays = [times, logged, due, np.ascontiguousarray(window), self._torques, y]
        if self._every is None:
            del arrays[2]
        call = library.advance if self._every is None else library.advance_sampled
        call.restype = ctypes.c_long
        count = call(
            ctypes.byref(program.cell),
            ctypes.byref(table),
            *(array.ctypes.data_as(ctypes.c_void_p) for array in arrays),
            *(ctypes.byref(struct) for struct in (log, program.work, report)),
        )
        recorder.advance(times[:-1][logged][:count])
        if report.status:
            raise _failure(program, float(times[report.step]), report, y, recorder.last("v"))


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


def _failure(
    program: Program, t: float, report: ReportStruct, y: np.ndarray, v: np.ndarray
) -> SimulationError:
    loop, cell = program.loop, program.loop.cell
    if report.status == 1 and report.robot < loop.size:  # an entry of the state, or of the torques after it
        return run_away(loop, t, y, v)
    if report.status == 1:
        return not_finite(cell, t, fastest(np.arange(cell.n), loop.split(y)[1]), "torque")
    i, name = report.robot, cell.names[report.robot]
    if report.status == 4:
        return OrientationError(
            f"the orientation error of {name} is {report.value:.3g} rad at t = {t:g} s; at pi its direction "
            "is not defined: start closer to the desired orientation, or turn more slowly",
            time=t,
            robot=i,
        )
    if report.status == 3:
        return singular(cell, t, i, "its determinant changed sign since the instant before")
    return singular(cell, t, i, f"its condition number is {report.value:.3g}")
