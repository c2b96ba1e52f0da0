"""Gains whose rows have different lengths, one per robot, as robots of different kinds need them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number
from ..tasks.padding import padded


class RaggedGain:
    """Vectors of different lengths that can be scaled like one array.

    Args:
        name: for messages.
        rows: one vector per robot.

    Raises:
        InputError: a row that is no vector of finite numbers.
    """

    #: a number of numpy's leaves a product with rows to the rows
    __array_ufunc__ = None

    def __init__(self, name: str, rows: Sequence[ArrayLike]):
        self.name = name
        self.rows = tuple(finite_array(f"{name}: row {i}", row, (None,)) for i, row in enumerate(rows, 1))

    @property
    def lengths(self) -> tuple[int, ...]:
        """Number of entries of each row."""
        return tuple(row.size for row in self.rows)

    @property
    def size(self) -> int:
        """Number of all entries."""
        return sum(self.lengths)

    def min(self) -> float:
        """The smallest entry."""
        return min(float(row.min()) for row in self.rows if row.size)

    def any(self) -> bool:
        """Whether an entry is not zero."""
        return any(bool(row.any()) for row in self.rows)

    def tolist(self) -> list[list[float]]:
        """Plain lists, a list per row."""
        return [row.tolist() for row in self.rows]

    def padded(self) -> np.ndarray:
        """One array, (n, longest), with zeros where a row ends before."""
        return padded(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, i: int) -> np.ndarray:
        return self.rows[i]

    def __mul__(self, factor: Any) -> RaggedGain:
        factor = finite_number("factor", factor)
        return RaggedGain(self.name, [factor * row for row in self.rows])

    __rmul__ = __mul__

    def __repr__(self) -> str:
        return repr(self.tolist())


def are_ragged(value: Any) -> bool:
    """Whether a value consists of vectors of different lengths."""
    if isinstance(value, RaggedGain):
        return True
    if not isinstance(value, (list, tuple)):
        return False
    if not all(isinstance(row, (list, tuple, np.ndarray)) and np.ndim(row[:1]) == 1 for row in value):
        return False
    return len({len(row) for row in value}) > 1
