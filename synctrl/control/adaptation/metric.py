"""Gamma of every robot: how far estimates move for a gradient, and how errors of them are measured.

Gamma is symmetric and positive semidefinite. In the unit of an entry it is [theta_a theta_b]/(N·m), so a
single number for kg, kg·m and kg·m^2 alike changes its meaning with the unit of length. With Gamma^+ its
inverse (of a singular Gamma the generalized one that scales with the units), tilde^T Gamma^+ tilde measures
the part of an error that can be learned, and (1 - Gamma Gamma^+) tilde is the part that stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array
from ...errors import InputError
from ...tasks.algebra import limited
from ..gains import RaggedGain, read_gain, spread_rows

#: share of the largest eigenvalue below which one counts as zero, and above which asymmetry is refused, with
#: ones on the diagonal
ROUNDING = 1e-12


class Metric(Protocol):
    """Gamma of n robots; rows are (n, P)."""

    Gamma: np.ndarray

    def raised(self, gradient: np.ndarray) -> np.ndarray:
        """Gamma times a gradient: a rate of theta_hat."""

    def lowered(self, change: np.ndarray) -> np.ndarray:
        """Gamma^+ times a change of theta_hat."""

    def frozen(self, error: np.ndarray) -> np.ndarray:
        """The part of an error that no rate can change, (1 - Gamma Gamma^+) tilde."""


class DiagonalMetric:
    """Gamma as its diagonal, (n, P); an entry of zero is not adapted."""

    def __init__(self, Gamma: np.ndarray):
        self.Gamma = Gamma
        self._inverse = np.divide(1.0, Gamma, out=np.zeros_like(Gamma), where=Gamma > 0)

    def raised(self, gradient: np.ndarray) -> np.ndarray:
        return self.Gamma * gradient

    def lowered(self, change: np.ndarray) -> np.ndarray:
        return self._inverse * change

    def frozen(self, error: np.ndarray) -> np.ndarray:
        return np.where(self.Gamma > 0, 0.0, error)


class FullMetric:
    """Gamma as matrices, (n, P, P), which may be singular.

    Inverted is D^-1 Gamma D^-1 with ones on its diagonal: which directions count as singular, and how they
    are measured, does not depend on the units of the entries of theta.
    """

    def __init__(self, Gamma: np.ndarray):
        D = _scale(Gamma)
        values, vectors = np.linalg.eigh(Gamma / (D[..., None] * D[..., None, :]))
        kept = values > ROUNDING * values[..., -1:]
        inverse = np.divide(1.0, values, out=np.zeros_like(values), where=kept)
        self.Gamma = Gamma
        self._inverse = (vectors * inverse[..., None, :]) @ vectors.mT / (D[..., None] * D[..., None, :])
        self._frozen = (vectors * ~kept[..., None, :]) @ vectors.mT * D[..., None] / D[..., None, :]

    def raised(self, gradient: np.ndarray) -> np.ndarray:
        return np.matvec(self.Gamma, gradient)

    def lowered(self, change: np.ndarray) -> np.ndarray:
        return np.matvec(self._inverse, change)

    def frozen(self, error: np.ndarray) -> np.ndarray:
        return np.matvec(self._frozen, error)


Gain = np.ndarray | RaggedGain | tuple[np.ndarray, ...]
"""A Gamma that has been read: numbers, rows of different lengths, or a matrix for each robot."""


def read_metric(Gamma: Any) -> Gain:
    """A Gamma as its user gives it.

    Args:
        Gamma: a number, (P,), (n, P) or a list of n rows of different lengths; or a matrix for each robot,
            (n, P, P) or a list of n square matrices. One matrix, (1, P, P), serves all robots.

    Raises:
        InputError: not numbers, not finite, below 0, or a matrix that is not symmetric and positive
            semidefinite.
    """
    if _depth(Gamma) == 3:
        return tuple(_read_matrix(f"Gamma of robot {i}", matrix) for i, matrix in enumerate(Gamma, 1))
    gain = read_gain("Gamma", Gamma)
    if gain.size and gain.min() < 0:
        raise InputError.expected("entries of at least 0", gain.min(), "Gamma")
    return gain


def make_metric(gain: Gain, sizes: Sequence[int]) -> DiagonalMetric | FullMetric:
    """The metric of robots with so many parameters each.

    Raises:
        InputError: Gamma of another size.
    """
    if not isinstance(gain, tuple):
        if isinstance(gain, np.ndarray) and _is_meant_as_matrix(gain, len(sizes), max(sizes)):
            wanted = "expected a matrix for each robot, (n, P, P), or one for all of them, (1, P, P)"
            raise InputError(f"{wanted}, found {gain.shape}", subject="Gamma", found=gain.shape)
        return DiagonalMetric(spread_rows("Gamma", gain, sizes))
    matrices = gain * len(sizes) if len(gain) == 1 else gain
    found, expected = tuple(len(matrix) for matrix in matrices), tuple(sizes)
    if found != expected:
        raise InputError.expected(f"a matrix for each robot, with rows {expected}", found, "Gamma")
    full = np.zeros((len(sizes), max(sizes), max(sizes)))
    for matrix, place in zip(matrices, full, strict=True):
        place[: len(matrix), : len(matrix)] = matrix
    return FullMetric(full)


def _is_meant_as_matrix(gain: np.ndarray, n: int, P: int) -> bool:
    """Whether rows are one matrix for all: as many as parameters, not robots, or nothing off a diagonal."""
    if gain.shape != (P, P):
        return False
    return n != P or (n > 1 and bool(gain.any()) and np.array_equal(gain, np.diag(np.diag(gain))))


def listed(gain: Gain) -> list:
    """A Gamma as plain lists."""
    return [matrix.tolist() for matrix in gain] if isinstance(gain, tuple) else gain.tolist()


def distance(metric: Metric, change: np.ndarray) -> np.ndarray:
    """Lengths of changes of theta_hat, sqrt(change^T Gamma^+ change), (n,), sqrt(N·m)."""
    return np.sqrt(limited((change * metric.lowered(change)).sum(axis=1), 0.0, np.inf))


def _depth(value: Any) -> int:
    """How deep rows are nested: 3 for a matrix per robot."""
    if isinstance(value, np.ndarray):
        return value.ndim
    return 1 + _depth(value[0]) if isinstance(value, (list, tuple)) and len(value) else 0


def _read_matrix(name: str, matrix: ArrayLike) -> np.ndarray:
    """A symmetric positive semidefinite matrix."""
    Gamma = finite_array(name, matrix, (None, None))
    if Gamma.shape[0] != Gamma.shape[1] or not len(Gamma):
        raise InputError(
            f"expected a square matrix, found shape {Gamma.shape}", subject=name, found=Gamma.shape
        )
    if np.diagonal(Gamma).min() < 0:
        lowest = float(np.diagonal(Gamma).min())
        raise InputError.expected("a diagonal of at least 0", lowest, name)
    D = _scale(Gamma)
    scaled = Gamma / np.outer(D, D)
    if np.abs(scaled - scaled.T).max() > ROUNDING:
        raise InputError("expected a symmetric matrix, found one that is not", subject=name)
    lowest = float(np.linalg.eigvalsh(scaled)[0])
    if lowest < -ROUNDING * len(Gamma):
        raise InputError.expected("no eigenvalue below 0 once the diagonal is scaled to ones", lowest, name)
    return (Gamma + Gamma.T) / 2


def _scale(Gamma: np.ndarray) -> np.ndarray:
    """Roots of the diagonal, (..., P), and 1 for entries that are not adapted."""
    diagonal = np.diagonal(Gamma, axis1=-2, axis2=-1)
    return np.where(diagonal > 0, np.sqrt(np.maximum(diagonal, 0.0)), 1.0)
