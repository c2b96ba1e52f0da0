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
from .arrays import CompiledLoop, one_after_another
from .quantities import DESIRED, SLIDE

#: bytes of references that one block of steps may need
BLOCK_BYTES = 32_000_000
#: steps of a block at most
BLOCK_STEPS = 1024


class DesiredStretch(NamedTuple):
    """Consecutive steps with what is desired at their start, middle and end, by the names of quantities."""

    steps: Stretch
    desired: dict[str, np.ndarray]


def blocks(program: CompiledLoop, clock: Clock) -> Iterator[DesiredStretch]:
    """The steps of a run, in blocks that fit into memory; all before an instant whose references fail."""
    cell = program.loop.cell

    def make(first: int, last: int) -> DesiredStretch:
        stretch = clock.stretch(first, last)
        return DesiredStretch(stretch, tabulated(cell, stretch.stages))

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


def tabulated(cell: Cell, instants: np.ndarray) -> dict[str, np.ndarray]:
    """Desired motion and weights at the instants of three stages, (3, T), one stage after another.

    Every motion is asked once and goes straight to its place: what a step costs does not grow with n.
    """
    flat = instants.ravel()
    names = (*DESIRED, *SLIDE)[: rows_of(cell.space)]
    desired = {name: np.empty((flat.size, cell.n, cell.m)) for name in names}
    for i in range(cell.n):
        for name, part in zip(names, cell.told(i, flat), strict=True):
            desired[name][:, i] = part
    weights = cell.weights(flat[:1] if cell.coupling.is_constant else flat)
    return {**desired, "weights": one_after_another(weights)}
