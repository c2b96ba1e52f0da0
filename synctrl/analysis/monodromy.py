"""Over one period: the matrix that z' = A(t) z makes of z, with an error that is controlled."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError

#: fewest and most steps between two edges; they are doubled until the result stays the same
FIRST, LAST = 16, 2**17
#: how far the fastest error turns or falls in the first steps that are tried
TURN = 2.0
#: how far the last two results may differ, of the largest entry, before their difference is taken off
PRECISION = 1e-8
#: places of the Gauss points in a step
GAUSS = 0.5 + np.array([-1.0, 0.0, 1.0]) * np.sqrt(0.15)
#: what halving a step takes off the error, less one: the method is of sixth order
GAIN = 63

#: times, ascending, (T,), -> A at these, (T, k, k)
Matrices = Callable[[np.ndarray], np.ndarray]


def instants(edges: Sequence[float], steps: int) -> np.ndarray:
    """Gauss points of so many steps between every two edges, ascending, s."""
    h = np.diff(edges) / steps
    starts = np.concatenate([a + w * np.arange(steps) for a, w in zip(edges[:-1], h, strict=True)])
    return (starts[:, None] + np.repeat(h, steps)[:, None] * GAUSS).ravel()


def monodromy(matrices: Matrices, edges: Sequence[float]) -> tuple[np.ndarray, float]:
    """Phi with z(end) = Phi z(start), (k, k), and an estimate of the error of its entries.

    Steps are exponentials of Magnus' series to sixth order (Blanes, Casas, Oteo and Ros 2009), which are
    exact where A is constant, however stiff. A is asked for at three Gauss points of a step, never on an
    edge. The number of steps is doubled until Phi stays the same; what is known of its error by then is
    taken off.

    Args:
        matrices: A at ascending times.
        edges: instants, ascending, s, between which A is smooth.

    Raises:
        InputError: A changes too fast, or too often, for the period that is looked at.
    """
    steps = _first(matrices, edges)
    coarse, error = _product(matrices, edges, steps), np.inf
    while steps < LAST and np.isfinite(coarse).all():
        steps *= 2
        fine = _product(matrices, edges, steps)
        gap = (fine - coarse) / GAIN
        error = float(np.abs(gap).max())
        if GAIN * error <= PRECISION * np.abs(fine).max():
            return fine + gap, error
        coarse = fine
    text = f"the linear system is not resolved by {steps} steps: Phi still changes by {GAIN * error:.2g}"
    raise InputError(text, subject="period", found=float(edges[-1] - edges[0]))


def _first(matrices: Matrices, edges: Sequence[float]) -> int:
    """The number of steps to begin with, a power of 2, at most a quarter of `LAST`."""
    fastest = np.abs(np.linalg.eigvals(matrices(instants(edges, FIRST)))).max()
    wanted = np.log2(max(np.diff(edges).max() * fastest / TURN, FIRST))
    return int(2 ** min(np.ceil(wanted), np.log2(LAST) - 2))


def _product(matrices: Matrices, edges: Sequence[float], steps: int) -> np.ndarray:
    from scipy.linalg import expm

    A = matrices(instants(edges, steps))
    h = np.repeat(np.diff(edges) / steps, steps)
    Phi = np.eye(A.shape[-1])
    with np.errstate(over="ignore", invalid="ignore"):  # of a step that is far too long
        for step in expm(_exponents(h[:, None, None] * A.reshape(len(h), 3, *Phi.shape).swapaxes(0, 1))):
            Phi = step @ Phi
    return Phi


def _exponents(hA: np.ndarray) -> np.ndarray:
    """Magnus' series from h A at the three Gauss points of every step, (3, steps, k, k)."""
    first, a1, last = hA
    a2, a3 = np.sqrt(15) / 3 * (last - first), 10 / 3 * (last - 2 * a1 + first)
    c1 = _bracket(a1, a2)
    c2 = -_bracket(a1, 2 * a3 + c1) / 60
    return a1 + a3 / 12 + _bracket(-20 * a1 - a3 + c1, a2 + c2) / 240


def _bracket(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    return A @ B - B @ A
