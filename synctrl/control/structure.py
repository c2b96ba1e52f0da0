"""Matrices whose structure is known, for `law.times`: diagonal ones, and ones that are zero at all times."""

from __future__ import annotations

from typing import Any, Self

import numpy as np


class Diagonal:
    """Diagonal matrices.

    Args:
        entries: what stands on the diagonals, in the shape of what they are to be multiplied with.
    """

    def __init__(self, entries: np.ndarray):
        self.entries = entries

    def transposed_times(self, x: np.ndarray) -> np.ndarray:
        """Products of the transposed matrices, which are the same, with the rows of x."""
        return self.entries * x

    def times(self, x: np.ndarray) -> np.ndarray:
        """Products with the rows of x."""
        return self.entries * x


class Absent:
    """Matrices that are zero at all times, such as c' of constant weights: sums lose their products."""

    __array_ufunc__ = None  # leaves sums with arrays to the methods below

    def times(self, x: np.ndarray) -> Self:
        """Products with the rows of x, which are as absent."""
        return self

    def __add__(self, other: Any) -> Any:
        return other

    __radd__ = __add__


ABSENT = Absent()


def structured(matrices: np.ndarray, rows: tuple[int, ...]) -> Diagonal | np.ndarray:
    """Square matrices, (n, m, m), as `Diagonal` if they are, for products with rows of the given shape."""
    entries = np.diagonal(matrices, axis1=-2, axis2=-1)
    if np.count_nonzero(matrices) > np.count_nonzero(entries):
        return matrices.copy()
    return Diagonal(np.broadcast_to(entries, rows).copy())
