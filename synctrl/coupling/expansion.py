"""Taylor series of a synchronization function about the desired motion, up to second order.

The differences are taken here and not by `scipy.differentiate.hessian`, which nests two searches for a step:
for a quadratic function of nine coordinates it calls f 58,000 times instead of 1,371 and leaves an error of
2e-7 instead of 4e-11, so that second-order terms that are zero could not be told from small ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import SynchronizationError

#: central differences of eighth order: weights of f(x + k h) for the first and second derivative
_FIRST = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
_SECOND = {1: 8 / 5, 2: -1 / 5, 3: 8 / 315, 4: -1 / 560}
_SECOND_CENTRE = -205 / 72
#: second-order terms below this share of the largest are rounding errors
_NEGLIGIBLE = 1e-6
#: and second derivatives that change by more than this share with the step are none
_SMOOTH = 1e-4

Function = Callable[[np.ndarray], np.ndarray]


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


def expand(f: Function, x: np.ndarray, t: float) -> Expansion:
    """Expand f at positions x, (n, m), by central differences of eighth order.

    Args:
        f: positions, (n, m), -> values, (k,).
        x: where.
        t: the instant, for the record.

    Raises:
        SynchronizationError: f has no second derivatives there; two steps give different ones.
    """
    n, m = x.shape
    h = 2.0**-7 * max(1.0, np.abs(x).max())
    value, second = f(x), _second_derivatives(f, x, h)
    change = np.abs(second - _second_derivatives(f, x, h / 2)).max()
    if change > _SMOOTH * max(np.abs(second).max(), np.abs(value).max(), 1.0):
        raise SynchronizationError(
            f"f has no second derivatives at t = {t:g} s, x = {x.tolist()}: with half the step of {h:g} they "
            f"change by {change:.3g}"
        ).about("function", time=t)
    first = np.array([_first(f, x, h * axis) for axis in np.eye(n * m).reshape(-1, n, m)]) / h
    c = -first.T.reshape(-1, n, m).swapaxes(0, 1)
    return Expansion(t, value, c, second.reshape(-1, n, m, n, m).swapaxes(2, 3) / 2)


def least_linear(f: Function, c: np.ndarray, x: np.ndarray) -> tuple[int, int, float]:
    """Robots i >= j that make f(x) differ from f(0) - sum_i c_i x_i, and by how much they do.

    Args:
        f: positions, (n, m), -> values, (k,).
        c: weights of f if it were linear, (n, k, m).
        x: positions at which f is not linear.
    """
    base, robots = f(0 * x), np.arange(len(x))

    def bend(moved: np.ndarray) -> float:
        y = x * moved[:, None]
        return float(np.abs(f(y) - base + np.matvec(c, y).sum(axis=0)).max())

    alone = [bend(robots == i) for i in robots]
    i = int(np.argmax(alone))
    if alone[i] > 0.01 * bend(robots >= 0):
        return i, i, alone[i]
    pairs = {(i, j): bend((robots == i) | (robots == j)) for i in range(len(x)) for j in range(i)}
    i, j = max(pairs, key=lambda pair: pairs[pair])
    return i, j, pairs[i, j]


def _second_derivatives(f: Function, x: np.ndarray, h: float) -> np.ndarray:
    """Hessian of every output, (k, n m, n m)."""
    value, axes = f(x), np.eye(x.size).reshape(-1, *x.shape)
    hessian = np.zeros((len(value), x.size, x.size))
    for a in range(x.size):
        hessian[:, a, a] = _second(f, x, h * axes[a], value)
        for b in range(a):
            plus = _second(f, x, h * (axes[a] + axes[b]), value)
            minus = _second(f, x, h * (axes[a] - axes[b]), value)
            hessian[:, a, b] = hessian[:, b, a] = (plus - minus) / 4
    return hessian / (h * h)


def _first(f: Function, x: np.ndarray, step: np.ndarray) -> np.ndarray:
    terms = [w * (f(x + k * step) - f(x - k * step)) for k, w in _FIRST.items()]
    return np.sum(terms, axis=0)


def _second(f: Function, x: np.ndarray, step: np.ndarray, value: np.ndarray) -> np.ndarray:
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
