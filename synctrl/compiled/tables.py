"""What is desired and weighed in the steps of a run, tabulated in blocks that fit into memory."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ..coupling.cell import Cell
from ..coupling.desired import rows_of
from ..simulation.advance import up_to_a_failure
from ..simulation.clock import Clock, Stretch
from ..simulation.log import AHEAD
from .arrays import CompiledLoop
from .quantities import DESIRED, SLIDE
from .weighing import weighing_of

#: bytes of references that one block of steps may need
BLOCK_BYTES = 32_000_000
#: steps of a block at most: the log has room for no more rows
BLOCK_STEPS = AHEAD


class DesiredStretch(NamedTuple):
    """Consecutive steps with what is desired in them.

    Attributes:
        steps: the k steps.
        desired: by the names of quantities, at the k starts and the last end, at the k middles, and at
            whatever ends have rows of their own; as they come, or `CompiledLoop.ready`.
        ends: in which row is what is desired at the end of each step, (k,): that of the next start, unless
            a desired motion jumps there.
    """

    steps: Stretch
    desired: dict[str, np.ndarray]
    ends: np.ndarray


def blocks(program: CompiledLoop, clock: Clock) -> Iterator[DesiredStretch]:
    """The steps of a run, in blocks that fit into memory; all before an instant whose references fail."""
    cell = program.loop.cell
    breaks = np.array(cell.breaks)

    def make(first: int, last: int) -> DesiredStretch:
        stretch = clock.stretch(first, last)
        try:
            block = desired_in(cell, stretch, np.isin(stretch.times[1:], breaks))
        except Exception:  # of the instant after the last step nothing need be known
            block = desired_in(cell, stretch, np.ones(last - first, dtype=bool))
        return block._replace(desired=program.ready(block.desired))

    length = min(BLOCK_STEPS, max(1, BLOCK_BYTES // _step_bytes(cell)))
    for first, last in clock.stretches(length):
        yield from up_to_a_failure(make, first, last)


def _step_bytes(cell: Cell) -> int:
    """Bytes of what is desired in one step."""
    weights = 0 if cell.coupling.is_constant else weighing_of(cell).count(cell.m)
    return 3 * 8 * cell.n * (rows_of(cell.space) * cell.m + weights)


class Tables:
    """What is desired in a run, kept for the next one with the same motions if it fits into memory.

    What is kept is looked up and replaced as a whole, so threads may share it.
    """

    def __init__(self) -> None:
        self._kept: tuple[list[Any], tuple, list[DesiredStretch]] = [], (), []

    def keeps(self, program: CompiledLoop, clock: Clock) -> bool:
        """Whether the blocks of a run are few enough to be kept."""
        return clock.steps * _step_bytes(program.loop.cell) <= BLOCK_BYTES

    def blocks(self, program: CompiledLoop, clock: Clock) -> Iterable[DesiredStretch]:
        """The steps of a run, made anew if the run before had other motions, weights, instants or rows."""
        cell = program.loop.cell
        if not self.keeps(program, clock):
            return blocks(program, clock)
        parts = [cell.coupling, type(cell.space), *(member.trajectory for member in cell.members)]
        known, instants, kept = self._kept
        same = len(parts) == len(known) and all(map(operator.is_, parts, known))
        asked = clock, clock.every, tuple(cell.clocks.tolist()), program.lanes
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


def desired_in(cell: Cell, steps: Stretch, jumps: np.ndarray) -> DesiredStretch:
    """What is desired in steps.

    Args:
        cell: who desires.
        steps: k of them.
        jumps: at which ends a desired motion may jump, (k,), so that what was before is asked for; if at the
            last one, nothing is asked at the instant itself.
    """
    starts, middles, before = steps.stages
    own = np.flatnonzero(jumps)
    last = starts[-1] if jumps[-1] else steps.times[-1]
    ends = np.arange(1, len(starts) + 1, dtype=np.intc)
    ends[own] = 2 * len(starts) + 1 + np.arange(len(own))
    instants = np.concatenate((starts, [last], middles, before[own]))
    return DesiredStretch(steps, tabulated(cell, instants), ends)


def tabulated(cell: Cell, instants: np.ndarray) -> dict[str, np.ndarray]:
    """Desired motion and weights at instants, (T,), by the names of quantities.

    Every motion is asked once, at best many of them together: what a step costs does not grow with n.
    """
    desired = dict(zip((*DESIRED, *SLIDE), cell.told_together(range(cell.n), instants), strict=False))
    weights = cell.weights(instants[:1] if cell.coupling.is_constant else instants)
    return {**desired, "weights": weighing_of(cell).numbers(weights)}
