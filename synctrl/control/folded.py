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

    @property
    def xref(self) -> np.ndarray:
        return self._robots(0, 2)

    @property
    def force(self) -> np.ndarray:
        return self._rows[2 * self._n : 3 * self._n]

    @property
    def compared(self) -> np.ndarray:
        p, start = self._p, 3 * self._n
        return self._rows[start : start + 2 * p].reshape(2, p, -1)

    @property
    def shares(self) -> np.ndarray:
        return self._robots(3, 3, 2 * self._p)

    @property
    def e_star(self) -> np.ndarray:
        return self._robots(6, 1, 2 * self._p)[0]

    @property
    def u(self) -> np.ndarray:
        return self._robots(7, 2, 2 * self._p)

    def _robots(self, first: int, count: int, skip: int = 0) -> np.ndarray:
        """`count` arrays with a row per robot, behind `first` of them and so many other rows."""
        start = skip + first * self._n
        return self._rows[start : start + count * self._n].reshape(count, self._n, -1)


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
