"""Taylor series of a synchronization function about the desired motion, up to second order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

#: central differences of eighth order: weights of f(x + k h) for the first and second derivative
_FIRST = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
_SECOND = {1: 8 / 5, 2: -1 / 5, 3: 8 / 315, 4: -1 / 560}
_SECOND_CENTRE = -205 / 72
#: second-order terms below this share of the largest are rounding errors
_NEGLIGIBLE = 1e-6


@dataclass(frozen=True, eq=False)
class Expansion:
    """f = value + sum_i c_i e_i + sum_ij e_i^T c2_ij e_j + ..., eqs. (4) and (5).

    Attributes:
        t: instant, s.
        value: f at the desired positions, (k,).
        c: first-order weights -df/dx_i, (n, k, m).
        second: second-order coefficients c2, half of the Hessian, (k, n, n, m, m).
    """

    t: float
    value: np.ndarray
    c: np.ndarray
    second: np.ndarray

    @property
    def invertible(self) -> bool:
        """Whether every c_i is square and has an inverse, as the theorems require."""
        return self.c.shape[1] == self.c.shape[2] and bool((np.linalg.cond(self.c) < 1e12).all())

    @property
    def linear(self) -> bool:
        """Whether there are no second-order terms."""
        return not self.second_order_terms()

    def second_order_terms(self) -> list[str]:
        """The second-order terms in words, such as `+1 e_1^T e_1`, one per output and pair of robots."""
        floor = _NEGLIGIBLE * max(np.abs(self.second).max(), np.abs(self.c).max(), np.abs(self.value).max())
        return [
            _term(row, i, j, block, len(self.value), floor)
            for row, blocks in enumerate(self.second)
            for i, line in enumerate(blocks)
            for j, block in enumerate(line)
            if np.abs(block).max() > floor
        ]

    def __str__(self) -> str:
        lines = [f"at t = {self.t:g} s:", f"  f = {_numbers(self.value)} on the desired motion"]
        for i, c in enumerate(self.c, start=1):
            shape = "" if c.shape[0] == c.shape[1] else f", {c.shape[0]} by {c.shape[1]}: no inverse"
            lines.append(f"  c_{i} = {_numbers(c)}{shape}")
        lines += [f"  second order: {term}" for term in self.second_order_terms()]
        return "\n".join(lines)


def expand(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, t: float) -> Expansion:
    """Expand f at positions x, (n, m), by central differences of eighth order.

    Args:
        f: positions, (n, m), -> values, (k,).
        x: where.
        t: the instant, for the record.
    """
    n, m = x.shape
    h = 2.0**-7 * max(1.0, np.abs(x).max())
    value = f(x)
    axes = list(np.eye(n * m).reshape(-1, n, m))
    first = np.array([_first(f, x, h * axis) for axis in axes]) / h
    hessian = np.zeros((len(value), n * m, n * m))
    for a in range(n * m):
        hessian[:, a, a] = _second(f, x, h * axes[a], value)
        for b in range(a):
            plus = _second(f, x, h * (axes[a] + axes[b]), value)
            minus = _second(f, x, h * (axes[a] - axes[b]), value)
            hessian[:, a, b] = hessian[:, b, a] = (plus - minus) / 4
    c = -first.T.reshape(-1, n, m).swapaxes(0, 1)
    blocks = hessian.reshape(-1, n, m, n, m).swapaxes(2, 3)
    return Expansion(t, value, c, blocks / (2 * h * h))


def largest_bend(
    f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, steps: np.ndarray
) -> tuple[int, int, float]:
    """Robots i >= j in whose coordinates f is least linear, and by how much.

    It is the largest second difference f(x + s_i + s_j) - f(x + s_i) - f(x + s_j) + f(x) for steps s, (n, m).
    """
    robots, value = range(len(x)), f(x)
    moves = [steps * (np.arange(len(x)) == i)[:, None] for i in robots]
    alone = [f(x + move) for move in moves]
    bends = {
        (i, j): float(np.abs(f(x + moves[i] + moves[j]) - alone[i] - alone[j] + value).max())
        for i in robots
        for j in range(i + 1)
    }
    i, j = max(bends, key=lambda pair: bends[pair])
    return i, j, bends[i, j]


def _first(f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: np.ndarray) -> np.ndarray:
    terms = [w * (f(x + k * step) - f(x - k * step)) for k, w in _FIRST.items()]
    return np.sum(terms, axis=0)


def _second(
    f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: np.ndarray, value: np.ndarray
) -> np.ndarray:
    terms = [w * (f(x + k * step) + f(x - k * step)) for k, w in _SECOND.items()]
    return np.sum([_SECOND_CENTRE * value, *terms], axis=0)


def _term(row: int, i: int, j: int, block: np.ndarray, rows: int, floor: float) -> str:
    where = "" if rows == 1 else f" in row {row + 1}"
    multiple = block[0, 0]
    if np.abs(block - multiple * np.eye(len(block))).max() <= floor:
        return f"{multiple:+.6g} e_{i + 1}^T e_{j + 1}{where}"
    return f"e_{i + 1}^T {_numbers(block)} e_{j + 1}{where}"


def _numbers(array: np.ndarray) -> str:
    rounded = np.round(array, 9) + 0.0  # no -0
    return np.array2string(rounded, precision=6, separator=", ").replace("\n", "")
