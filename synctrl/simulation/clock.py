"""When to evaluate: the grid of a run, its logged instants, and the smooth intervals between jumps.

A run of hours has millions of instants, so nothing here holds them all: they are made stretch by stretch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..checks import positive_number
from ..errors import InputError

MAX_STEPS = 100_000_000
#: instants that are closer than this share of dt are one
TIE = 1e-9


class Stretch(NamedTuple):
    """Some consecutive steps of a run.

    Attributes:
        first: index of the first step.
        times: where the steps begin, and the last one ends, (k + 1,), s.
        checked: whether a step begins at a multiple of dt, where runs are watched and samples fall, (k,).
        logged: whether it begins at an instant that is logged, (k,).
        number: which multiple of dt it begins at or after, (k,).
    """

    first: int
    times: np.ndarray
    checked: np.ndarray
    logged: np.ndarray
    number: np.ndarray

    @property
    def starts(self) -> np.ndarray:
        """Where the steps begin, (k,), s."""
        return self.times[:-1]

    @property
    def middles(self) -> np.ndarray:
        """Halfway through the steps, (k,), s."""
        return 0.5 * (self.times[:-1] + self.times[1:])

    @property
    def stages(self) -> np.ndarray:
        """Where a step needs what is desired: its start, its middle, and just before its end, (3, k)."""
        return np.array([self.starts, self.middles, np.nextafter(self.times[1:], -np.inf)])


@dataclass(frozen=True)
class Clock:
    """Instants of a run: multiples of dt, its end, and every jump in between.

    Two clocks are equal if their steps are.

    Attributes:
        dt: step, s.
        count: how many steps of dt there are; the last one may be shorter.
        end: last instant, s.
        moved: multiples of dt that give way to the break of a desired motion beside them, and that break, s.
        between: jumps that fall between two multiples: index of the step that they end, and when, s.
        jumps: instants inside the run at which the right-hand side jumps, s.
        every: every so many multiples of dt are logged, and the end.
    """

    dt: float
    count: int
    end: float
    moved: tuple[tuple[int, float], ...] = ()
    between: tuple[tuple[int, float], ...] = ()
    jumps: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False)
    every: int = field(default=1, compare=False)

    @cached_property
    def _moved(self) -> tuple[np.ndarray, np.ndarray]:
        return _columns(self.moved)

    @cached_property
    def _between(self) -> tuple[np.ndarray, np.ndarray]:
        return _columns(self.between)

    @property
    def steps(self) -> int:
        """How many steps there are, those to and from jumps included."""
        return self.count + len(self.between)

    @property
    def rows(self) -> int:
        """How many instants are logged."""
        return -(-self.count // self.every) + 1

    @property
    def times(self) -> np.ndarray:
        """All instants, (steps + 1,), s; made anew."""
        return self.stretch(0, self.steps).times

    @property
    def logged(self) -> np.ndarray:
        """Instants to log, (rows,), s; made anew."""
        return self.grid(np.append(np.arange(0, self.count, self.every), self.count))

    def sampled_at_end(self, every: int) -> bool:
        """Whether a controller that acts at every so many multiples of dt acts at the end."""
        return self.count % every == 0 and abs(self.count * self.dt - self.end) <= 2 * TIE * self.dt

    def spread(self, number: int) -> np.ndarray:
        """So many multiples of dt, evenly from 0 to the end, (number,), s; whatever is logged."""
        return self.grid(np.linspace(0, self.count, number).astype(int))

    def at(self, k: int) -> float:
        """Multiple k of dt, s."""
        return float(self.grid(np.array([k]))[0])

    def grid(self, index: np.ndarray) -> np.ndarray:
        """Multiples of dt with indices from 0 to `count`, s."""
        times = np.where(index < self.count, index * self.dt, self.end)
        _put(self._moved, index, times)
        return times

    def stretch(self, first: int, last: int) -> Stretch:
        """The steps [first, last)."""
        steps = np.arange(first, last + 1)
        number = steps - np.searchsorted(self._between[0], steps, side="right")  # the multiple at or before
        times = self.grid(number)
        checked = ~_put(self._between, steps, times)[:-1]
        return Stretch(first, times, checked, checked & (number[:-1] % self.every == 0), number[:-1])

    def stretches(self, length: int) -> Iterator[tuple[int, int]]:
        """All steps as ranges [first, last) of at most some length."""
        return ((k, min(k + length, self.steps)) for k in range(0, self.steps, length))

    def joined(self, first: int, starts: np.ndarray) -> np.ndarray:
        """Whether the right-hand side goes on smoothly from the step before.

        Args:
            first: index of the first of some consecutive steps.
            starts: where they begin, (k,), s.

        Returns:
            One answer per step, (k,); no for the very first.
        """
        joined = ~np.isin(starts, self.jumps)
        if first == 0:
            joined[:1] = False
        return joined


def make_clock(
    duration: float,
    dt: float,
    edges: Sequence[float],
    breaks: Sequence[float] = (),
    log_dt: float | None = None,
) -> Clock:
    """A clock that lands exactly on every jump.

    What is closer than 1e-9 dt to a multiple of dt counts as that multiple, so that 0.7 = 700 dt whatever the
    rounding. At a break the multiple gives way, because a desired motion asks on which side of it a time
    lies; at an edge it stays, so that the instants do not depend on disturbances. If duration is not a
    multiple of dt the last step is shorter.

    Args:
        duration: length of the run, s.
        dt: step, s.
        edges: instants at which a disturbance jumps, s.
        breaks: instants at which a desired motion jumps, s.
        log_dt: distance of logged instants, a multiple of dt, s; by default dt.

    Raises:
        InputError: a number that is not positive, dt longer than the run, a log_dt that is no multiple of dt,
            or more than a hundred million steps.
    """
    duration, dt = positive_number("duration", duration), positive_number("dt", dt)
    if dt > duration:
        raise InputError(
            f"expected at most the duration of {duration:g} s, found {dt:g} s", subject="dt", found=dt
        )
    if duration / dt > MAX_STEPS:
        raise InputError(f"{duration:g} s in steps of {dt:g} s are more than {MAX_STEPS} steps", subject="dt")
    every = 1 if log_dt is None else multiple("log_dt", log_dt, dt)
    bare = Clock(dt, int(np.ceil(duration / dt - TIE)), duration, every=every)
    instants = np.array(breaks, dtype=float)
    near = _nearest(bare, instants, least=1)
    close = np.abs(bare.grid(near) - instants) <= TIE * dt
    moved = dict(zip(near[close].tolist(), instants[close].tolist(), strict=True))
    end = moved.get(bare.count, duration)
    return _with_jumps(replace(bare, end=end, moved=tuple(sorted(moved.items()))), edges, breaks)


def _with_jumps(clock: Clock, edges: Sequence[float], breaks: Sequence[float]) -> Clock:
    """The clock with what jumps inside the run."""
    given = np.array(edges, dtype=float)
    on_grid = clock.grid(_nearest(clock, given))
    snapped = np.where(np.abs(on_grid - given) <= TIE * clock.dt, on_grid, given)
    jumps = np.unique(np.concatenate((np.array(breaks, dtype=float), snapped)))
    jumps = jumps[(jumps > 0) & (jumps < clock.end)]
    near = _nearest(clock, jumps)
    off_grid = clock.grid(near) != jumps
    instants, last = jumps[off_grid], near[off_grid]
    last -= clock.grid(last) > instants  # the multiple before each
    places = last + 1 + np.arange(len(last))
    between = tuple(zip(places.tolist(), instants.tolist(), strict=True))
    return replace(clock, between=between, jumps=jumps)


def _columns(marks: tuple[tuple[int, float], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places and instants of marks."""
    return np.array([place for place, _ in marks], dtype=int), np.array([instant for _, instant in marks])


def _put(marks: tuple[np.ndarray, np.ndarray], index: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Write marked instants over the times that have their index; which these are."""
    places, instants = marks
    if not len(places):
        return np.zeros(len(index), dtype=bool)
    found = np.searchsorted(places, index).clip(max=len(places) - 1)
    hit = places[found] == index
    times[hit] = instants[found[hit]]
    return hit


def _nearest(clock: Clock, instants: np.ndarray, least: int = 0) -> np.ndarray:
    """The multiples of dt that are closest to some instants, (k,); of two that are, the first."""
    guess = np.rint(np.clip(instants / clock.dt, 0, clock.count)).astype(int)
    ends = np.full((2, len(guess)), [[clock.count - 1], [clock.count]])
    around = np.concatenate((guess + np.array([[-1], [0], [1]]), ends)).clip(least, clock.count)
    best = np.abs(clock.grid(around.ravel()).reshape(around.shape) - instants).argmin(axis=0)
    return around[best, np.arange(len(guess))]


def before(t: float) -> float:
    """The last number before t: where a function is evaluated for its value from the left."""
    return float(np.nextafter(t, -np.inf))


def multiple(name: str, interval: float, dt: float) -> int:
    """How many steps an interval lasts.

    Raises:
        InputError: the interval is not positive, or no multiple of dt.
    """
    interval = positive_number(name, interval)
    count = round(interval / dt)
    if count < 1 or abs(count * dt - interval) > 1e-9 * interval:
        raise InputError(
            f"expected a multiple of dt = {dt:g} s, found {interval:g} s", subject=name, found=interval
        )
    return count
