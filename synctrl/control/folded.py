"""The law of constant weights as one matrix.

While weights are constant every line of the law, and the coupling between them, is linear with constant
coefficients in the errors, their integrals and the desired rates. For a small cell one product with a matrix
then costs less than its lines one by one. The matrix is not written down: it is what the lines make of every
unit vector.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..tasks.cell import Cell, Reference
from ..tasks.spaces import Measurement
from .commands import Command, ConstantWeights

#: entries of a matrix that is still faster than the lines
LARGEST = 20_000


class FoldedCommand:
    """A `Command` whose parts are cut out of one array when they are asked for.

    Args:
        rows: all of them, (9 n + 2 p, m): xref, force, compared, shares, e_star, u, one below the other.
        n: number of robots.
        p: number of pairs.
    """

    __slots__ = ("_n", "_p", "_rows")

    def __init__(self, rows: np.ndarray, n: int, p: int):
        self._rows, self._n, self._p = rows, n, p

    def _part(self, robots: int, pairs: int, rows: int, count: int) -> np.ndarray:
        """`count` arrays of so many rows, behind what belongs to some robots and pairs."""
        start = robots * self._n + pairs * self._p
        return self._rows[start : start + count * rows].reshape(count, rows, -1)

    xref = property(lambda self: self._part(0, 0, self._n, 2))
    force = property(lambda self: self._rows[2 * self._n : 3 * self._n])
    compared = property(lambda self: self._part(3, 0, self._p, 2))
    shares = property(lambda self: self._part(3, 2, self._n, 3))
    e_star = property(lambda self: self._part(6, 2, self._n, 1)[0])
    u = property(lambda self: self._part(7, 2, self._n, 2))


class FoldedWeights:
    """`ConstantWeights`, applied as a matrix.

    Args:
        cell: the cell, with constant weights.
        lines: the law, line by line.
    """

    def __init__(self, cell: Cell, lines: ConstantWeights):
        self._n, self._p, self._m = cell.n, cell.coupling.pairs, cell.m
        self._lines = lines

    def __call__(self, task: Measurement, reference: Reference, integral: np.ndarray) -> FoldedCommand:
        z = np.concatenate((task.error.ravel(), task.rates.ravel(), integral.ravel()))
        return FoldedCommand(self._matrix.dot(z).reshape(-1, self._m), self._n, self._p)

    @cached_property
    def _matrix(self) -> np.ndarray:
        n, p, m = self._n, self._p, self._m
        units = np.eye((4 * n + p) * m)
        return np.stack([_flat(self._lines.of(*self._split(unit))) for unit in units], axis=1)

    def _split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Error, rates and integral in z."""
        rows, k = z.reshape(-1, self._m), 2 * self._n
        shape = 2, self._n, self._m
        return rows[:k].reshape(shape), rows[k : 2 * k].reshape(shape), rows[2 * k :]


def folded(cell: Cell, lines: ConstantWeights) -> FoldedWeights | ConstantWeights:
    """The law as a matrix where that pays, else line by line."""
    n, p, m = cell.n, cell.coupling.pairs, cell.m
    return FoldedWeights(cell, lines) if (9 * n + 2 * p) * (4 * n + p) * m * m <= LARGEST else lines


def _flat(command: Command) -> np.ndarray:
    parts = command.xref, command.force, command.compared, command.shares, command.e_star, command.u
    return np.concatenate([part.ravel() for part in parts])
