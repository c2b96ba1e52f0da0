"""Matrices of several robots as the blocks of one matrix."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided

Rows = slice | np.ndarray
"""Rows of an array that belong to some of the robots."""


class Blocks:
    """Block-diagonal matrices with equal blocks, one per robot.

    For a few small robots one product with the whole matrix costs less than a product per block.

    Args:
        whole: the matrix, (n rows, n columns).
        n: number of blocks.
    """

    __slots__ = ("n", "whole")

    def __init__(self, whole: np.ndarray, n: int):
        self.whole, self.n = whole, n

    def times(self, x: np.ndarray) -> np.ndarray:
        """Products of the blocks with the rows of x, (n, columns)."""
        return self.whole.dot(x.ravel()).reshape(self.n, -1)

    def transposed_times(self, x: np.ndarray) -> np.ndarray:
        """Products of the transposed blocks with the rows of x, (n, rows)."""
        return x.ravel().dot(self.whole).reshape(self.n, -1)

    def size(self, x: np.ndarray) -> np.ndarray:
        """`times` with absolute values in the blocks: what its rounding errors are relative to."""
        return np.abs(self.whole).dot(x.ravel()).reshape(self.n, -1)

    def matrices(self) -> np.ndarray:
        """The blocks, (n, rows, columns)."""
        whole, n = self.whole, self.n
        rows, columns = whole.shape[0] // n, whole.shape[1] // n
        strides = rows * whole.strides[0] + columns * whole.strides[1], *whole.strides
        return as_strided(whole, (n, rows, columns), strides).copy()

    @classmethod
    def of(cls, matrices: np.ndarray) -> Blocks:
        """Blocks with these matrices, (n, rows, columns), on the diagonal."""
        n, rows, columns = matrices.shape
        whole = np.zeros((n, rows, n, columns))
        whole[np.arange(n), :, np.arange(n)] = matrices
        return cls(whole.reshape(n * rows, n * columns), n)


class BlockProduct:
    """Products A B of blocks, never multiplied out.

    Args:
        A, B: the blocks.
    """

    __slots__ = ("A", "B")

    def __init__(self, A: Blocks, B: Blocks):
        self.A, self.B = A, B

    def times(self, x: np.ndarray) -> np.ndarray:
        """Products with the rows of x."""
        return self.A.times(self.B.times(x))

    def transposed_times(self, x: np.ndarray) -> np.ndarray:
        """Products of the transposed blocks with the rows of x."""
        return self.B.transposed_times(self.A.transposed_times(x))

    def size(self, x: np.ndarray) -> np.ndarray:
        """`times` with absolute values in both factors."""
        return self.A.size(self.B.size(x))

    def matrices(self) -> np.ndarray:
        """The products, one matrix per robot."""
        return self.A.matrices() @ self.B.matrices()


class Beside:
    """Blocks with diagonal matrices to their right, [A, diag(d_1), diag(d_2), ...].

    Args:
        A: blocks of n robots.
        diagonals: d_k of every robot, (n, k, rows).
    """

    __slots__ = ("A", "diagonals")

    def __init__(self, A: Blocks | BlockProduct, diagonals: np.ndarray):
        self.A, self.diagonals = A, diagonals

    def times(self, x: np.ndarray) -> np.ndarray:
        """Products with the rows of x."""
        left, right = self._split(x)
        return self.A.times(left) + (self.diagonals * right).sum(axis=1)

    def transposed_times(self, x: np.ndarray) -> np.ndarray:
        """Products of the transposed blocks with the rows of x."""
        right = self.diagonals * x[:, None]
        return np.concatenate((self.A.transposed_times(x), right.reshape(len(x), -1)), axis=1)

    def size(self, x: np.ndarray) -> np.ndarray:
        """`times` with absolute values in the blocks."""
        left, right = self._split(x)
        return self.A.size(left) + (np.abs(self.diagonals) * right).sum(axis=1)

    def matrices(self) -> np.ndarray:
        """The blocks, one matrix per robot."""
        n, k, rows = self.diagonals.shape
        right = np.zeros((n, rows, k, rows))
        each = np.arange(rows)
        right[:, each, :, each] = self.diagonals.transpose(2, 0, 1)
        return np.concatenate((self.A.matrices(), right.reshape(n, rows, -1)), axis=2)

    def _split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The columns of x that belong to A, and those of the diagonals, (n, k, rows)."""
        n, k, rows = self.diagonals.shape
        return x[:, : -k * rows], x[:, -k * rows :].reshape(n, k, rows)


class Part(NamedTuple):
    """Blocks of some robots: their rows, and the size of each.

    Attributes:
        robots: which robots.
        rows, columns: size of a block.
        blocks: the blocks.
    """

    robots: Rows
    rows: int
    columns: int
    blocks: Blocks | BlockProduct | Beside


class Padded:
    """Blocks of all robots, put together from parts; zero where a robot has fewer rows or columns.

    Args:
        shape: number of robots, rows and columns of the largest blocks.
        parts: the parts.
    """

    __slots__ = ("parts", "shape")

    def __init__(self, shape: tuple[int, int, int], parts: Sequence[Part]):
        self.shape, self.parts = shape, parts

    def times(self, x: np.ndarray) -> np.ndarray:
        """Products of the blocks with the rows of x, (n, columns)."""
        product = np.zeros(self.shape[:2])
        for robots, rows, columns, blocks in self.parts:
            product[robots, :rows] = blocks.times(x[robots, :columns])
        return product

    def size(self, x: np.ndarray) -> np.ndarray:
        """`times` with absolute values in the blocks."""
        product = np.zeros(self.shape[:2])
        for robots, rows, columns, blocks in self.parts:
            product[robots, :rows] = blocks.size(x[robots, :columns])
        return product

    def transposed_times(self, x: np.ndarray) -> np.ndarray:
        """Products of the transposed blocks with the rows of x, (n, rows)."""
        product = np.zeros(self.shape[::2])
        for robots, rows, columns, blocks in self.parts:
            product[robots, :columns] = blocks.transposed_times(x[robots, :rows])
        return product

    def matrices(self) -> np.ndarray:
        """The blocks, (n, rows, columns)."""
        matrices = np.zeros(self.shape)
        for robots, rows, columns, blocks in self.parts:
            matrices[robots, :rows, :columns] = blocks.matrices()
        return matrices
