"""What the closed loop is made of along one period, as polynomials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev as cheb

from ..errors import InputError
from .on_motion import OnMotion

#: number of samples between two edges, doubled until the series has come to its end
FEWEST, MOST = 32, 1024
#: size of the last eighth of a series, of the largest entry of a quantity, at which it has
END = 1e-10
#: entries of Y, in SI units, of a motion that rests: these are rounding, which comes to no end
ROUNDING = 1e-9


class Interpolated:
    """A motion between edges, beside which it is smooth.

    Args:
        ask: ascending times, (T,), -> what the motion is made of.
        edges: instants, ascending, s.

    Raises:
        InputError: a motion that changes too often between two edges.
    """

    def __init__(self, ask: Callable[[np.ndarray], OnMotion], edges: Sequence[float]):
        self._pieces = [(a, b, _series(ask, a, b)) for a, b in pairwise(edges)]

    def __call__(self, times: np.ndarray) -> OnMotion:
        """The same at any times, ascending, (T,), none of which is an edge."""
        parts = []
        for start, stop, series in self._pieces:
            inside = times[(start < times) & (times < stop)]
            places = (2 * inside - start - stop) / (stop - start)
            parts.append([np.tensordot(cheb.chebvander(places, len(c) - 1), c, 1) for c in series])
        return OnMotion(times, *(np.concatenate(part) for part in zip(*parts, strict=True)))


def _series(ask: Callable[[np.ndarray], OnMotion], start: float, stop: float) -> list[np.ndarray]:
    """Chebyshev coefficients of M, D, J_c and Y, (k, ...) each."""
    count = FEWEST
    while count <= MOST:
        places = cheb.chebpts1(count)
        on = ask(start + (stop - start) / 2 * (places + 1))
        weights = cheb.chebvander(places, count - 1).T * (2 / count)
        weights[0] /= 2
        series = [np.tensordot(weights, part, 1) for part in (on.M, on.D, on.J_c, on.Y)]
        ends = [np.abs(c[-count // 8 :]).max() - END * np.abs(c).max() for c in series]
        if max(ends[:3]) <= 0 and ends[3] <= ROUNDING:
            return series
        count *= 2
    text = f"a motion that is not resolved by {MOST} instants; does a trajectory lack its `breaks`?"
    raise InputError(f"found {text}", subject="period", found=stop - start)
