"""Structure of the weights c_i(t) of a cell: what of c, c', c'' and c^-1 generated code is given at all.

Weights are most often one, or constant diagonals. Then c' and c'' are zero, and so is what stands beside the
diagonals; code that knows it has no operations with them. What is known is what is certain: constant weights
are looked at, moving ones are diagonal only where their source says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..coupling.cell import Cell
from ..coupling.weights import StillWeights, Weights
from ..errors import CompilationError


@dataclass(frozen=True)
class Weighing:
    """What numbers weights are made of.

    Attributes:
        parts: names of those of c, c', c'' and c^-1 that are given; none if all c are one.
        full: whether they are matrices, else diagonals.
    """

    parts: tuple[str, ...]
    full: bool

    @property
    def moves(self) -> bool:
        """Whether c changes with time."""
        return "c_dot" in self.parts

    def count(self, m: int) -> int:
        """How many numbers there are for one robot, for a task of dimension m."""
        return len(self.parts) * (m * m if self.full else m)

    def numbers(self, weights: Weights) -> np.ndarray:
        """The numbers of weights, (..., n, m, m), as rows, (..., n, count).

        Raises:
            CompilationError: weights of another structure.
        """
        if not self._fits(weights):
            raise CompilationError(
                f"weights of another structure than {self.parts or 'one'}, "
                f"{'matrices' if self.full else 'diagonals'}",
                subject="weights",
            )
        found = [getattr(weights, name) for name in self.parts]
        found = [part if self.full else _diagonal(part)[..., None] for part in found]
        rows = np.shape(weights.c)[:-2]
        return np.stack(found, axis=-3).reshape(*rows, -1) if found else np.zeros((*rows, 0))

    def weights(self, numbers: np.ndarray, m: int) -> Weights:
        """The weights, (m, m) each, of the numbers of one robot, (count,), which may be symbols."""
        shape = (m, m) if self.full else (m,)
        rows = numbers.reshape(len(self.parts), *shape)
        given = {name: row if self.full else _matrix(row) for name, row in zip(self.parts, rows, strict=True)}
        zero, one = np.zeros((m, m)), np.eye(m)
        every = {"c": one, "c_dot": zero, "c_ddot": zero, "c_inv": one, **given}
        return Weights(**every) if self.moves else StillWeights(**every)

    def like(self, c: np.ndarray, c_dot: np.ndarray, c_ddot: np.ndarray) -> Weights:
        """Weights of this structure, made of any that have an inverse, (..., m, m) each."""
        one = np.broadcast_to(np.eye(c.shape[-1]), c.shape)
        c, c_dot, c_ddot = (part if self.full else part * one for part in (c, c_dot, c_ddot))
        if not self.parts:
            c = one
        if not self.moves:
            c_dot, c_ddot = np.zeros_like(c), np.zeros_like(c)
        return Weights(c, c_dot, c_ddot, np.linalg.inv(c))

    def _fits(self, weights: Weights) -> bool:
        """Whether nothing is lost of weights of which only the parts are looked at."""
        still = self.moves or not (np.any(weights.c_dot) or np.any(weights.c_ddot))
        given = [getattr(weights, name) for name in (*self.parts, *(() if self.parts else ("c",)))]
        return still and all(self.full or _is_diagonal(part) for part in given) and self._is_one(weights)

    def _is_one(self, weights: Weights) -> bool:
        return bool(self.parts) or bool((_diagonal(weights.c) == 1).all())


#: c = 1, constant diagonals and matrices, moving diagonals and matrices
ONE = Weighing((), full=False)
DIAGONAL, CONSTANT = (Weighing(("c", "c_inv"), full) for full in (False, True))
MOVING_DIAGONAL, MOVING = (Weighing(("c", "c_dot", "c_ddot", "c_inv"), full) for full in (False, True))


def weighing_of(cell: Cell) -> Weighing:
    """The structure that the weights of all robots of a cell have; moving ones are not asked for."""
    if not cell.coupling.is_constant:
        return MOVING_DIAGONAL if cell.coupling.is_diagonal else MOVING
    c = cell.weights(np.zeros(1)).c
    if not _is_diagonal(c):
        return CONSTANT
    return ONE if (_diagonal(c) == 1).all() else DIAGONAL


def _diagonal(c: np.ndarray) -> np.ndarray:
    return np.diagonal(c, axis1=-2, axis2=-1)


def _is_diagonal(c: np.ndarray) -> bool:
    return bool((c[..., ~np.eye(np.shape(c)[-1], dtype=bool)] == 0).all())


def _matrix(diagonal: np.ndarray) -> np.ndarray:
    """A diagonal as a matrix, (m, m), whose other entries are numbers."""
    matrix = np.zeros((len(diagonal),) * 2, dtype=diagonal.dtype)
    np.fill_diagonal(matrix, diagonal)
    return matrix
