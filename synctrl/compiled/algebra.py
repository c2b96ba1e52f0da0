"""Arrays of CasADi symbols, and the linear algebra of one robot's matrices of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ..tasks.algebra import Algebra

#: rounds of Jacobi's method after which symmetric matrices of six rows are diagonal to rounding
SWEEPS = 6


def array_of(symbols: Any, *shape: int) -> np.ndarray:
    """The entries of a CasADi matrix, row by row, as an array of another shape or of its own."""
    array = np.empty(symbols.shape, dtype=object)
    for place in np.ndindex(symbols.shape):
        array[place] = symbols[place]
    return array.reshape(shape or symbols.shape)


def column_of(array: Any) -> Any:
    """The entries of an array, row by row, as a dense CasADi column."""
    import casadi as ca

    entries = np.ravel(array)
    return ca.densify(ca.vertcat(*entries)) if entries.size else ca.SX.zeros(0, 1)


def symbols(name: str, *shape: int) -> np.ndarray:
    """An array of new symbols."""
    import casadi as ca

    return array_of(ca.SX.sym(name, int(np.prod(shape))), *shape)


def function_of(
    name: str,
    signature: tuple[Sequence[str], Sequence[str]],
    given: Mapping[str, Any],
    computed: Mapping[str, Any],
) -> Any:
    """A CasADi function in which nothing is computed twice.

    Args:
        name: of the function.
        signature: names of its arguments and of its results.
        given: symbols by name.
        computed: arrays of these by name; one that is None, or missing, has no entries.
    """
    import casadi as ca

    inputs, outputs = signature
    found = [computed.get(key) for key in outputs]
    results = ca.cse([column_of([] if array is None else array) for array in found])
    return ca.Function(name, [given[key] for key in inputs], results, [*inputs], [*outputs])


def balancing(M: Any, b: Any) -> Any:
    """x of M x + b = 0, with a symmetric positive definite matrix of CasADi's, M = L D L^T without pivoting.

    Rows are taken from the last on: joints of a mechanism that are in different branches stay apart. CasADi
    makes x / y of x (1 / y), but not of x (-1 / y): so what is divided by a pivot is multiplied with that,
    and N is -L.
    """
    import casadi as ca

    n = M.shape[0]
    N, LD = ca.SX.zeros(n, n), ca.SX.zeros(n, n)
    x, less = [b[i] for i in range(n)], [ca.SX(0)] * n
    for j in reversed(range(n)):
        for i in range(j + 1):
            LD[i, j] = M[i, j] + sum(LD[i, k] * N[j, k] for k in range(j + 1, n))
        less[j] = -1 / LD[j, j]
        for i in range(j):
            N[i, j] = LD[i, j] * less[j]
    for i in reversed(range(n)):
        x[i] += sum(N[i, k] * x[k] for k in range(i + 1, n))
    x = [x[i] * less[i] for i in range(n)]
    for i in range(n):
        x[i] += sum(N[k, i] * x[k] for k in range(i))
    return ca.vertcat(*x)


def _inverse(A: np.ndarray) -> np.ndarray:
    """By cofactors up to three rows, by an unrolled QR factorization above; every divisor divides once."""
    return _by_cofactors(A) if len(A) <= 3 else _by_columns(A)


def _by_cofactors(A: np.ndarray) -> np.ndarray:
    rows = range(len(A))
    adjoint = np.empty_like(A)
    for i, j in np.ndindex(A.shape):
        minor = np.delete(np.delete(A, i, 0), j, 1)
        adjoint[j, i] = _signed_minor(minor, (i + j) % 2)
    return adjoint * _reciprocal(sum(A[0, j] * adjoint[j, 0] for j in rows))


def _signed_minor(A: np.ndarray, odd: int) -> Any:
    """det A, or -det A, of at most two rows."""
    if len(A) == 2:
        straight, across = A[0, 0] * A[1, 1], A[0, 1] * A[1, 0]
        return across - straight if odd else straight - across
    whole = A[0, 0] if len(A) else 1
    return -whole if odd else whole


def _by_columns(A: np.ndarray) -> np.ndarray:
    """By A = Q R with orthogonal columns in Q, which need not have length one, and ones on R's diagonal."""
    n = len(A)
    Q, R, rows = list(A.T), {}, []
    for j in range(n):
        reciprocal = _reciprocal((Q[j] * Q[j]).sum())
        for k in range(j + 1, n):
            R[j, k] = (Q[j] * Q[k]).sum(keepdims=True) * reciprocal
            Q[k] = Q[k] - Q[j] * R[j, k]
        rows.append(Q[j] * reciprocal)
    for i in reversed(range(n)):
        rows[i] = rows[i] - sum(R[i, k] * rows[k] for k in range(i + 1, n))
    return np.array(rows)


def _reciprocal(x: Any) -> np.ndarray:
    """1 / x, (1,), times which CasADi lets others be: of y (1 / x) it would make y / x, a division each."""
    found = np.empty(1, dtype=object)
    found[0] = 2 / (2 * x)
    return found


def _determinant(A: np.ndarray) -> np.ndarray:
    """By Laplace's expansion, row after row; every minor is computed once."""
    minors: dict[tuple[int, ...], Any] = {(): np.ones(1)}
    for row, entries in enumerate(A):
        minors = {
            columns: sum(
                (-1) ** (row - k) * entries[j : j + 1] * minors[columns[:k] + columns[k + 1 :]]
                for k, j in enumerate(columns)
            )
            for columns in combinations(range(len(A)), row + 1)
        }
    return minors[tuple(range(len(A)))]


def _smallest(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By Jacobi's method: A is turned in one plane after another until it is diagonal."""
    rows = len(A)
    A, V, below = A.copy(), np.eye(rows).astype(object), np.tril_indices(rows, -1)
    for _ in range(1 if rows <= 2 else SWEEPS):
        for plane in combinations(range(rows), 2):
            turn = _turn(A, *plane)
            A[:, plane] = A[:, plane] @ turn
            A[plane, :] = turn.T @ A[plane, :]
            A[below] = A.T[below]
            V[:, plane] = V[:, plane] @ turn
    found, *others = np.vstack((A.diagonal(), V)).T
    for other in others:
        less = np.less(other[:1], found[:1], dtype=object)
        found = less * other + (1 - less) * found
    return found[:1], found[1:]


def _turn(A: np.ndarray, p: int, q: int) -> np.ndarray:
    """The rotation by the smaller angle after which A[p, q] is zero, (2, 2)."""
    gap, off = A[q : q + 1, q] - A[p : p + 1, p], 2 * A[p : p + 1, q]
    sign = 1 - 2 * np.less(gap, 0, dtype=object)
    tangent = sign * off / (abs(gap) + np.sqrt(gap**2 + off**2 + 1e-300))
    cosine = 1 / np.sqrt(1 + tangent**2)
    sine = tangent * cosine
    return np.concatenate((cosine, sine, -sine, cosine)).reshape(2, 2)


#: of symbols, of one robot
SYMBOLS = Algebra(_inverse, _determinant, _smallest)
