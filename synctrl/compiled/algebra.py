"""Arrays of symbols, and the linear algebra of one robot's matrices of them."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from ..tasks.algebra import Algebra, two_by_two

#: rounds of Jacobi's method after which symmetric matrices of six rows are diagonal to rounding
SWEEPS = 6


def array_of(symbols: Any) -> np.ndarray:
    """The entries of a CasADi matrix as an array; a column becomes a vector."""
    rows, columns = symbols.shape
    array = np.empty((rows, columns), dtype=object)
    for place in np.ndindex(rows, columns):
        array[place] = symbols[place]
    return array[:, 0] if columns == 1 else array


def array_from(*entries: Any) -> np.ndarray:
    """Symbols as a vector."""
    return array_of(ca.vertcat(*entries, ca.SX(0)))[:-1]


def symbols_of(array: np.ndarray) -> Any:
    """The CasADi matrix of an array."""
    return ca.vertcat(*(ca.horzcat(*row) for row in array.reshape(len(array), -1)))


def _inverse(A: np.ndarray) -> np.ndarray:
    """By minors up to three rows, by an unrolled QR factorization above."""
    rows = len(A)
    if rows == 2:
        return two_by_two(A)
    given = ca.SX.sym("A", rows, rows)
    inverse = ca.inv_minor(given) if rows <= 3 else ca.solve(given, ca.SX.eye(rows))
    found = ca.Function("inverse", [given], [inverse])(symbols_of(A))
    return array_of(found).reshape(rows, rows)


def _determinant(A: np.ndarray) -> np.ndarray:
    """By Laplace's expansion, row after row; every minor is computed once."""
    minors: dict[tuple[int, ...], Any] = {(): ca.SX(1)}
    for row, entries in enumerate(A, start=1):
        minors = {
            columns: sum(
                (-1) ** (row - 1 - k) * entries[j] * minors[columns[:k] + columns[k + 1 :]]
                for k, j in enumerate(columns)
            )
            for columns in combinations(range(len(A)), row)
        }
    return array_from(*minors.values())


def _smallest(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By Jacobi's method: A is turned in one plane after another until it is diagonal."""
    rows = len(A)
    A, V = A.copy(), array_of(ca.SX(ca.DM.eye(rows))).reshape(rows, rows)
    for _ in range(1 if rows <= 2 else SWEEPS):
        for plane in combinations(range(rows), 2):
            turn = _turn(A, *plane)
            A[:, plane] = A[:, plane] @ turn
            A[plane, :] = turn.T @ A[plane, :]
            V[:, plane] = V[:, plane] @ turn
    found, *others = np.vstack((A.diagonal(), V)).T
    for other in others:
        less = array_from(other[0] < found[0])
        found = less * other + (1 - less) * found
    return found[:1], found[1:]


def _turn(A: np.ndarray, p: int, q: int) -> np.ndarray:
    """The rotation by the smaller angle after which A[p, q] is zero, (2, 2)."""
    gap, off = A[q, q] - A[p, p], 2 * A[p, q]
    tangent = (1 - 2 * (gap < 0)) * off / (abs(gap) + ca.sqrt(gap**2 + off**2 + 1e-300))
    cosine = 1 / ca.sqrt(1 + tangent**2)
    return array_from(cosine, tangent * cosine, -tangent * cosine, cosine).reshape(2, 2)


#: of symbols, of one robot
SYMBOLS = Algebra(_inverse, _determinant, _smallest)
