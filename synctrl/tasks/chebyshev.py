"""Smooth functions of time from samples, with two derivatives and a certificate of their accuracy.

On each piece of the run the function is a Chebyshev polynomial of degree 16, whose derivatives are exact.
Twice the degree says how far it, its first and its second derivative are off; a piece that is not good enough
is halved. What is still not good enough when the pieces become very short is not smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev as cheb

from ..errors import Portable

DEGREE = 16
#: largest error of c, c' and c'', see `tolerances`
ACCURACY = 1e-8
#: how often a run may be halved
DEPTH = 14
MAX_PIECES = 250
#: instants, spread over the run, at which the polynomials are compared with the function itself
CHECKS = 200

Function = Callable[[float], np.ndarray]


def _nodes(degree: int) -> np.ndarray:
    return np.cos(np.pi * np.arange(degree + 1) / degree)


def _derivative_matrix(degree: int) -> np.ndarray:
    """Coefficients of a polynomial -> those of its derivative, of the same length."""
    D = np.zeros((degree + 1, degree + 1))
    D[:-1] = cheb.chebder(np.eye(degree + 1))
    return D


def _fit_and_values(degree: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Samples -> coefficients; and coefficients -> values, first and second derivatives at the fine nodes."""
    fit = np.linalg.inv(cheb.chebvander(_nodes(degree), degree))
    at_nodes = cheb.chebvander(_nodes(2 * DEGREE), degree)
    D = _derivative_matrix(degree)
    return fit, [at_nodes, at_nodes @ D, at_nodes @ D @ D]


_D = _derivative_matrix(DEGREE)
_FIT, _VALUES = _fit_and_values(DEGREE)
_FINE_FIT, _FINE_VALUES = _fit_and_values(2 * DEGREE)


class Piece(NamedTuple):
    """A function of shape (n, m, m) on one interval of time.

    Attributes:
        start, stop: s.
        coefficients: of the function and its two derivatives, (3, DEGREE + 1, n, m, m).
        error, largest: of the function and its two derivatives, (3, n).
    """

    start: float
    stop: float
    coefficients: np.ndarray
    error: np.ndarray
    largest: np.ndarray


class NotSmoothError(Portable, Exception):
    """A function whose derivatives cannot be certified.

    Attributes:
        time: where, s.
        order: which derivative is worst, 0, 1 or 2.
        row: which row of the function.
        error: its error, in multiples of what is allowed.
    """

    def __init__(self, time: float, order: int, row: int, error: float):
        self.time, self.order, self.row, self.error = time, order, row, error
        super().__init__(f"derivative {order} of row {row} near t = {time:g} s: error {error:g}")


class SmoothFunction:
    """Polynomials that follow each other from 0 to `duration`."""

    def __init__(self, pieces: list[Piece]):
        self._starts = np.array([piece.start for piece in pieces])
        self._pieces = pieces
        self.duration = pieces[-1].stop
        self.shape = pieces[0].coefficients.shape[2:]

    def constant(self) -> np.ndarray | None:
        """The value of a function of which no row changes by more than rounding, (n, m, m), or None."""
        value, *rest = np.array([piece.coefficients[0] for piece in self._pieces]).swapaxes(0, 1)
        change = np.max([np.abs(part).max(axis=(0, 2, 3)) for part in (value - value[0], *rest)], axis=0)
        return value[0] if (change <= 1e-14 * np.abs(value[0]).max(axis=(1, 2))).all() else None

    def at(self, times: np.ndarray) -> np.ndarray:
        """The function and its first and second derivative at times inside the run, (3, T, n, m, m)."""
        where = np.clip(np.searchsorted(self._starts, times, side="right") - 1, 0, None)
        out = np.empty((3, len(times), *self._pieces[0].coefficients.shape[2:]))
        for k in np.unique(where):
            piece, chosen = self._pieces[k], where == k
            s = (2 * times[chosen] - piece.start - piece.stop) / (piece.stop - piece.start)
            out[:, chosen] = np.tensordot(cheb.chebvander(s, DEGREE), piece.coefficients, (1, 1)).swapaxes(
                0, 1
            )
        return out


def certify(function: Function, duration: float) -> SmoothFunction:
    """Polynomials for a function of time with rows for n robots, (n, m, m), accurate as `tolerances` says.

    Raises:
        NotSmoothError: no short pieces are accurate enough.
    """
    pieces = [_piece(function, 0.0, duration)]
    checks = duration * np.modf((np.arange(CHECKS) + 0.5) * (np.sqrt(5) - 1) / 2)[0]
    expected = np.array([function(t) for t in checks])
    for _ in range(DEPTH):
        allowed = tolerances(pieces, duration)
        pieces = _with_jumps(pieces)
        missed = _missed(pieces, checks, expected, allowed[0])
        bad = [i in missed or bool((p.error > allowed).any()) for i, p in enumerate(pieces)]
        if not any(bad):
            return SmoothFunction(pieces)
        if len(pieces) > MAX_PIECES:
            break
        pieces = [
            half for p, b in zip(pieces, bad, strict=True) for half in (_halves(function, p) if b else [p])
        ]
    raise _not_smooth(_with_jumps(pieces), tolerances(pieces, duration))


def tolerances(pieces: list[Piece], duration: float) -> np.ndarray:
    """Largest error of c_i, c_i' and c_i'' that is accepted, (3, n).

    It is 1e-8 of the largest |c_i| of the run times the fastest rate of the weights: 1, max_j |c_j'| / |c_j|
    or max_j |c_j''| / |c_j|, or that of a change over the whole run if they are slower.
    """
    largest = np.max([piece.largest for piece in pieces], axis=0)
    size = np.maximum(largest[0], np.finfo(float).tiny)
    rates = np.maximum((largest / size).max(axis=1), duration ** -np.arange(3.0))
    return ACCURACY * rates[:, None] * size


def _piece(function: Function, start: float, stop: float) -> Piece:
    half = 0.5 * (stop - start)
    samples = np.array([function(0.5 * (start + stop) + half * s) for s in _nodes(2 * DEGREE)])
    first, *_ = flat = samples.reshape(len(samples), -1)
    flat = flat - first  # what does not change has no rounding errors either
    coefficients, fine = _FIT @ flat[::2], _FINE_FIT @ flat
    coefficients[0] += first
    fine[0] += first
    scale = half ** -np.arange(3.0)[:, None, None]
    values = scale * np.array([V @ coefficients for V in _VALUES])
    error = values - scale * np.array([V @ fine for V in _FINE_VALUES])
    derivatives = scale * np.array([coefficients, _D @ coefficients, _D @ _D @ coefficients])
    shape = samples.shape[1:]
    return Piece(
        start,
        stop,
        derivatives.reshape(3, DEGREE + 1, *shape),
        np.abs(error).reshape(3, -1, *shape).max(axis=(1, 3, 4)),
        np.abs(values).reshape(3, -1, *shape).max(axis=(1, 3, 4)),
    )


def _halves(function: Function, piece: Piece) -> list[Piece]:
    middle = 0.5 * (piece.start + piece.stop)
    return [_piece(function, piece.start, middle), _piece(function, middle, piece.stop)]


def _with_jumps(pieces: list[Piece]) -> list[Piece]:
    """Pieces whose errors count what the function or a derivative seems to jump by on the way to the next."""
    alternating = (-1.0) ** np.arange(DEGREE + 1)
    starts = [np.tensordot(piece.coefficients, alternating, (1, 0)) for piece in pieces[1:]]
    jumps = [
        np.abs(piece.coefficients.sum(axis=1) - start).max(axis=(2, 3))
        for piece, start in zip(pieces, starts, strict=False)
    ]
    jumps.append(np.zeros_like(pieces[-1].error))
    return [p._replace(error=np.maximum(p.error, jump)) for p, jump in zip(pieces, jumps, strict=True)]


def _missed(pieces: list[Piece], times: np.ndarray, expected: np.ndarray, allowed: np.ndarray) -> set[int]:
    """Pieces that pass beside the function between their nodes."""
    error = np.abs(SmoothFunction(pieces).at(times)[0] - expected).max(axis=(2, 3))
    starts = np.array([piece.start for piece in pieces])
    wrong = times[(error > allowed).any(axis=1)]
    return set((np.searchsorted(starts, wrong, side="right") - 1).tolist())


def _not_smooth(pieces: list[Piece], allowed: np.ndarray) -> NotSmoothError:
    """What is worst in the lowest derivative that fails: the higher ones fail around it as well."""
    shares = np.array([piece.error / allowed for piece in pieces])  # (pieces, 3, n)
    order = int(np.argmax((shares > 1).any(axis=(0, 2))))
    k, row = np.unravel_index(np.argmax(shares[:, order]), shares[:, order].shape)
    time = 0.5 * (pieces[k].start + pieces[k].stop)
    return NotSmoothError(float(time), order, int(row), float(shares[k, order, row]))
