"""What equations leave to linear algebra: LAPACK for numbers, something else for symbols; and padded rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

#: signs of the cofactors of a matrix with two rows
_CHECKERED = np.array([[1.0, -1.0], [-1.0, 1.0]])


class Algebra(NamedTuple):
    """Functions of square matrices, (..., m, m), of which there may be one or a stack.

    Attributes:
        inverse: A^-1, (..., m, m); nothing finite where there is none.
        determinant: det A, (..., 1).
        smallest: of a symmetric A the smallest eigenvalue, (..., 1), and its eigenvector, (..., m).
    """

    inverse: Callable[[np.ndarray], np.ndarray]
    determinant: Callable[[np.ndarray], np.ndarray]
    smallest: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def limited(x: np.ndarray, lower: ArrayLike, upper: ArrayLike) -> np.ndarray:
    """Every entry between two bounds, of which one may be infinite; of numbers or symbols."""
    if x.dtype != object:
        return np.clip(x, lower, upper)
    import casadi as ca

    between = np.frompyfunc(lambda entry, low, high: ca.fmin(ca.fmax(entry, low), high), 3, 1)
    return between(x, lower, upper)


def _inverse(A: np.ndarray) -> np.ndarray:
    """A^-1, and NaN where there is none, so that the run's guard can name the robot."""
    if A.shape[-1] == 2:
        with np.errstate(divide="ignore", invalid="ignore"):
            determinant = A[..., :1, :1] * A[..., 1:, 1:] - A[..., :1, 1:] * A[..., 1:, :1]
            return _CHECKERED * A[..., ::-1, ::-1].mT / determinant
    try:
        return np.linalg.inv(A)
    except np.linalg.LinAlgError:
        regular = np.linalg.det(A) != 0
        result = np.full_like(A, np.nan)
        result[regular] = np.linalg.inv(A[regular])
        return result


def _smallest(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """NaN only for the matrices that are not finite, so that the run's guard can name the robot."""
    finite = np.isfinite(A).all(axis=(-2, -1), keepdims=True)
    values, vectors = np.linalg.eigh(np.where(finite, A, 0.0))
    found = finite[..., 0]
    return np.where(found, values[..., :1], np.nan), np.where(found, vectors[..., 0], np.nan)


def _determinant(A: np.ndarray) -> np.ndarray:
    return np.linalg.det(A)[..., None]


#: of numbers
LAPACK = Algebra(_inverse, _determinant, _smallest)


def padded(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Rows of different lengths as one array, (n, longest), filled up with zeros."""
    array = np.zeros((len(rows), max(len(row) for row in rows)))
    for target, row in zip(array, rows, strict=True):
        target[: len(row)] = row
    return array
