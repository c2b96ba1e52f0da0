"""Smooth functions of time from samples, with two derivatives and a certificate of their accuracy.

On each piece of the run the function is a Chebyshev polynomial of degree 16, whose derivatives are exact.
Twice the degree says how far it, its first and its second derivative are off; a piece that is not good enough
is halved. What is still not good enough when the pieces become very short is not smooth.

Derivatives and values are those of `numpy.polynomial.chebyshev`. Its class `Chebyshev` holds a single
number per polynomial: the weights of six coordinates with two derivatives would be 18 of them, and take six
times as long to evaluate. Its `chebinterpolate` samples inside the interval only, where polynomials of half
the degree cannot use the same samples, and leaves errors at the ends for which a motion needs a sixth more
pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from itertools import pairwise
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
#: where a function is sampled, in [-1, 1]; every second place serves the polynomial of half the degree
PLACES = cheb.chebpts2(2 * DEGREE + 1)
ENDS = np.array([-1.0, 1.0])

Function = Callable[[float], np.ndarray]


class Piece(NamedTuple):
    """A function of shape (n, m, m) on one interval of time.

    Attributes:
        start, stop: s.
        series: coefficients of the function and its two derivatives, (DEGREE + 1, 3, n, m, m).
        error, largest: of the function and its two derivatives, (3, n).
    """

    start: float
    stop: float
    series: np.ndarray
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
        super().__init__(
            f"near t = {time:g} s its relative error is {ACCURACY * error:.2g}, allowed is {ACCURACY:g}; "
            "expected a smooth function of time that is not noisy"
        )


class SmoothFunction:
    """Polynomials that follow each other from 0 to `duration`, each from its start on."""

    def __init__(self, pieces: list[Piece]):
        self._starts = np.array([piece.start for piece in pieces])
        self._pieces = pieces
        self.duration = pieces[-1].stop
        self.shape = pieces[0].series.shape[2:]

    def constant(self) -> np.ndarray | None:
        """The value of a function of which no row changes by more than rounding, (n, m, m), or None."""
        value, *rest = np.array([piece.series[:, 0] for piece in self._pieces]).swapaxes(0, 1)
        change = np.max([np.abs(part).max(axis=(0, 2, 3)) for part in (value - value[0], *rest)], axis=0)
        return value[0] if (change <= 1e-14 * np.abs(value[0]).max(axis=(1, 2))).all() else None

    @property
    def is_diagonal(self) -> bool:
        """Whether every row is a diagonal, (m, m), at all times."""
        beside = ~np.eye(self.shape[-1], dtype=bool)
        return not any(piece.series[..., beside].any() for piece in self._pieces)

    def at(self, times: np.ndarray) -> np.ndarray:
        """The function and its first and second derivative at times inside the run, (3, T, n, m, m)."""
        where = self.pieces_at(times)
        out = np.empty((3, len(times), *self.shape))
        for k in np.unique(where):
            piece, chosen = self._pieces[k], where == k
            s = (2 * times[chosen] - piece.start - piece.stop) / (piece.stop - piece.start)
            out[:, chosen] = _values(s, piece.series)
        return out

    def first_outside(self, times: np.ndarray) -> float | None:
        """The first of some times, (T,), for which it was not made, s."""
        slack = ACCURACY * self.duration
        outside = times[(times < -slack) | (times > self.duration + slack)]
        return float(outside[0]) if outside.size else None

    def pieces_at(self, times: np.ndarray) -> np.ndarray:
        """Which piece holds each of the times, (T,); at the end of one it is the next."""
        return np.clip(np.searchsorted(self._starts, times, side="right") - 1, 0, None)


def fit_smooth(function: Function, duration: float, breaks: Iterable[float] = ()) -> SmoothFunction:
    """Polynomials for a function of time with rows for n robots, (n, m, m), accurate as `tolerances` says.

    Args:
        function: of one time, s.
        duration: it is looked at from 0 to this time, s.
        breaks: instants at which a derivative may jump, s.

    Raises:
        NotSmoothError: no short pieces are accurate enough.
    """
    edges = [0.0, *sorted({b for b in breaks if 0 < b < duration}), duration]
    pieces = [_piece(function, start, stop) for start, stop in pairwise(edges)]
    shortest = min(piece.stop - piece.start for piece in pieces)
    checks = duration * np.modf((np.arange(CHECKS) + 0.5) * (np.sqrt(5) - 1) / 2)[0]
    expected = np.array([function(t) for t in checks])
    for _ in range(DEPTH):
        allowed = tolerances(pieces, shortest)
        pieces = _with_jumps(pieces, edges)
        missed = _missed(SmoothFunction(pieces), checks, expected, allowed[0])
        bad = [i in missed or bool((p.error > allowed).any()) for i, p in enumerate(pieces)]
        if not any(bad):
            return SmoothFunction(pieces)
        if len(pieces) > MAX_PIECES + len(edges):
            break
        pieces = [
            half for p, b in zip(pieces, bad, strict=True) for half in (_halves(function, p) if b else [p])
        ]
    raise _not_smooth(_with_jumps(pieces, edges), tolerances(pieces, shortest))


def tolerances(pieces: list[Piece], shortest: float) -> np.ndarray:
    """Largest error of c_i, c_i' and c_i'' that is accepted, (3, n).

    It is 1e-8 of the largest |c_i| of the run times the fastest rate of the weights: 1, max_j |c_j'| / |c_j|
    or max_j |c_j''| / |c_j|, or that of a change over the shortest time between two breaks, in s, if they are
    slower. A run without breaks counts as one such time.
    """
    largest = np.max([piece.largest for piece in pieces], axis=0)
    size = np.maximum(largest[0], np.finfo(float).tiny)
    rates = np.maximum((largest / size).max(axis=1), shortest ** -np.arange(3.0))
    return ACCURACY * rates[:, None] * size


def _piece(function: Function, start: float, stop: float) -> Piece:
    middle, half = 0.5 * (start + stop), 0.5 * (stop - start)
    samples = np.array([function(min(middle + half * s, stop)) for s in PLACES])
    first, *_ = flat = samples.reshape(len(PLACES), -1)
    flat = flat - first  # what does not change has no rounding errors either
    both = []
    for part, degree in ((slice(None, None, 2), DEGREE), (slice(None), 2 * DEGREE)):
        series = _interpolation(degree) @ flat[part]
        series[0] += first
        both.append(_with_derivatives(series.reshape(-1, *samples.shape[1:]), half))
    values, fine = (_values(PLACES, series) for series in both)
    sizes = (np.abs(found).max(axis=(1, 3, 4)) for found in (values - fine, values))
    return Piece(start, stop, both[0], *sizes)


@cache
def _interpolation(degree: int) -> np.ndarray:
    """From values at the extreme places of a Chebyshev polynomial to the series through them, (k, k).

    The sum of the discrete cosine transform: a least-squares solver errs by so much more that second
    derivatives on short pieces show it, on one processor more than on another.
    """
    k = np.arange(degree + 1)
    share = np.where((k == 0) | (k == degree), 0.5, 1.0)
    cosines = np.cos(np.pi * np.outer(k, degree - k) / degree)
    return 2 / degree * share[:, None] * cosines * share


def _with_derivatives(series: np.ndarray, half: float) -> np.ndarray:
    """A series on a piece of length 2 `half`, (k, n, m, m), with its two derivatives, (k, 3, n, m, m)."""
    both = np.zeros((len(series), 3, *series.shape[1:]))
    for order in range(3):
        both[: len(series) - order, order] = cheb.chebder(series, order, 1 / half)
    return both


def _values(places: np.ndarray, series: np.ndarray) -> np.ndarray:
    """Series with their derivatives, (k, 3, n, m, m), at places in [-1, 1], (T,): (3, T, n, m, m)."""
    return np.tensordot(cheb.chebvander(places, len(series) - 1), series, 1).swapaxes(0, 1)


def _halves(function: Function, piece: Piece) -> list[Piece]:
    middle = 0.5 * (piece.start + piece.stop)
    return [_piece(function, piece.start, middle), _piece(function, middle, piece.stop)]


def _with_jumps(pieces: list[Piece], edges: list[float]) -> list[Piece]:
    """Pieces whose errors count what the function or a derivative seems to jump by where it should not."""
    ends = np.array([_values(ENDS, piece.series) for piece in pieces])  # (pieces, 3, 2, n, m, m)
    jumps = np.zeros((len(pieces), *pieces[0].error.shape))
    jumps[:-1] = np.abs(ends[:-1, :, 1] - ends[1:, :, 0]).max(axis=(3, 4))
    jumps[[piece.stop in edges for piece in pieces], 1:] = 0.0  # only derivatives may jump at a break
    return [p._replace(error=np.maximum(p.error, jump)) for p, jump in zip(pieces, jumps, strict=True)]


def _missed(
    function: SmoothFunction, times: np.ndarray, expected: np.ndarray, allowed: np.ndarray
) -> set[int]:
    """Pieces that pass beside the expected values between their nodes."""
    error = np.abs(function.at(times)[0] - expected).max(axis=(2, 3))
    return set(function.pieces_at(times[(error > allowed).any(axis=1)]).tolist())


def _not_smooth(pieces: list[Piece], allowed: np.ndarray) -> NotSmoothError:
    """What is worst in the lowest derivative that fails: the higher ones fail around it as well."""
    shares = np.array([piece.error / allowed for piece in pieces])  # (pieces, 3, n)
    order = int(np.argmax((shares > 1).any(axis=(0, 2))))
    k, row = np.unravel_index(np.argmax(shares[:, order]), shares[:, order].shape)
    time = 0.5 * (pieces[k].start + pieces[k].stop)
    return NotSmoothError(float(time), order, int(row), float(shares[k, order, row]))
