"""The law of constant weights as one matrix.

While weights are constant every line of the law, and the coupling between them, is linear with constant
coefficients in the errors, their integrals and the desired rates. For a small cell one product with a matrix
then costs less than its lines one by one. The matrix is not written down: it is what the lines make of every
unit vector.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..coupling.cell import Cell, Reference
from ..tasks.spaces import Measurement
from .commands import ConstantWeights, Lines

#: entries of a matrix that is still faster than the lines
LARGEST = 20_000


class FoldedCommand:
    """A `Command` in rows of one array; what only a log asks for is computed when it does.

    Args:
        law: the law that made it.
        z: errors, rates and integrals, one after another.
    """

    __slots__ = ("_law", "_z", "epsilon", "force", "xref")

    def __init__(self, law: FoldedWeights, z: np.ndarray):
        self._law, self._z, n = law, z, law.n
        rows = law.stage_rows.dot(z).reshape(-1, law.m)
        self.xref = rows[:n], rows[n : 2 * n]
        self.force, self.epsilon = rows[2 * n : 3 * n], rows[3 * n :]

    @property
    def e_star(self) -> np.ndarray:
        return self._part("e_star", self._law.n)

    @property
    def epsilon_dot(self) -> np.ndarray:
        return self._part("epsilon_dot", self._law.p)

    @property
    def memory_dot(self) -> np.ndarray:
        return self.epsilon

    @property
    def shares(self) -> np.ndarray:
        return self._part("shares", 3, self._law.n)

    @property
    def u(self) -> np.ndarray:
        return self._part("u", 2, self._law.n)

    def _part(self, name: str, *shape: int) -> np.ndarray:
        return self._law.rows(name).dot(self._z).reshape(*shape, self._law.m)


class FoldedWeights:
    """`ConstantWeights`, applied as a matrix.

    Args:
        cell: the cell, with constant weights.
        lines: the law, line by line.
    """

    def __init__(self, cell: Cell, lines: ConstantWeights):
        self.n, self.p, self.m = cell.n, cell.coupling.pairs, cell.m
        self._lines = lines

    def __call__(self, task: Measurement, reference: Reference, integral: np.ndarray) -> FoldedCommand:
        return FoldedCommand(self, np.concatenate((task.error.ravel(), task.rates.ravel(), integral.ravel())))

    @cached_property
    def stage_rows(self) -> np.ndarray:
        """The rows of xref, force and epsilon, which every step needs."""
        return np.concatenate([self.rows(name) for name in ("xref", "force", "epsilon")])

    def rows(self, name: str) -> np.ndarray:
        """The rows of a part of `Command`."""
        return self._matrices[name]

    @cached_property
    def _matrices(self) -> dict[str, np.ndarray]:
        units = np.eye((4 * self.n + self.p) * self.m)
        commands = [self._lines.of(*self._split(unit)) for unit in units]
        return {
            name: np.stack([np.ravel(getattr(command, name)) for command in commands], axis=1)
            for name in Lines._fields
        }

    def _split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Error, rates and integral in z."""
        rows, k = z.reshape(-1, self.m), 2 * self.n
        shape = 2, self.n, self.m
        return rows[:k].reshape(shape), rows[k : 2 * k].reshape(shape), rows[2 * k :]


def folded(cell: Cell, lines: ConstantWeights) -> FoldedWeights | ConstantWeights:
    """The law as a matrix where that pays, else line by line."""
    n, p, m = cell.n, cell.coupling.pairs, cell.m
    return FoldedWeights(cell, lines) if (3 * n + p) * (4 * n + p) * m * m <= LARGEST else lines
