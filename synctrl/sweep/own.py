"""Measures of a user's own: a number of every instant of a run, and what becomes of these numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from ..analysis.metrics import finite_or_none
from ..checks import choice, label
from ..errors import InputError, SweepError, SynctrlError
from ..simulation.instant import Instant
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .measures import Measure

#: how the numbers of all instants become one, in words
OVER: Mapping[str, str] = MappingProxyType(
    {
        "largest": "the largest over the run",
        "mean": "its average over the run, trapezoidal rule",
        "integral": "its integral over the run, trapezoidal rule",
        "final": "at the last instant",
    }
)


@dataclass(frozen=True)
class OwnMeasure:
    """A measure of a user's own: a column of the table.

    Args:
        name: of the column, a word.
        value: a function of an `Instant` that returns one number. It must be pure. What is written with
            arithmetic and numpy's functions and asks nothing of the numbers is compiled, too.
        over: "largest", "mean", "integral" or "final": what is kept of the numbers of a run's instants.
        unit: of what is kept.
        meaning: of the number, in words.

    Raises:
        InputError: a name that is no word, no function, another word for `over`, or no texts.
    """

    name: str
    value: Callable[[Instant], Any]
    over: str
    unit: str = "1"
    meaning: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InputError.expected("a word", self.name, "own measure")
        what = f"measure '{self.name}'"
        if not callable(self.value):
            raise InputError.expected("a function", self.value, what)
        choice(what, self.over, tuple(OVER))
        label(f"{what}, unit", self.unit)
        label(f"{what}, meaning", self.meaning)

    @property
    def measure(self) -> Measure:
        """Its definition and its unit."""
        return Measure(f"{self.meaning or self.function}; {OVER[self.over]}", self.unit)

    @property
    def function(self) -> str:
        """Qualified name of its function."""
        function = self.value.func if isinstance(self.value, partial) else self.value
        return str(getattr(function, "__qualname__", type(function).__qualname__))

    def describe(self) -> dict[str, str]:
        """What it is, as plain data; its function appears by its name."""
        return {
            "name": self.name,
            "function": self.function,
            "over": self.over,
            "unit": self.unit,
            "meaning": self.meaning,
        }

    def of(self, result: Result) -> float | None:
        """The measure of a run; None where it is no finite number.

        Raises:
            SweepError: its function fails, or returns something else than one number.
        """
        with np.errstate(all="ignore"):
            numbers = np.array([self._number(result, k) for k in range(len(result.t))])
        return kept(self.over, result.t, numbers)

    # -- internals ----------------------------------------------------------------------------------------

    def _number(self, result: Result, k: int) -> float:
        """Of one instant of a run."""
        what, where = f"measure '{self.name}'", f"at t = {result.t[k]:g} s"
        try:
            found = self.value(Instant(*(getattr(result, name)[k] for name in Instant._fields)))
        except Exception as error:
            raise SweepError(f"its function failed with {_told(error)} {where}", subject=what) from error
        number = np.asarray(found)
        if number.size != 1 or number.dtype.kind not in "biuf":
            raise SweepError(f"expected one number {where}, found {found!r:.80}", subject=what, found=found)
        return float(number.item())


class OwnMeasures:
    """The measures of a user's own that the runs of a sweep have.

    Runs of the compiled engine are asked by the library that takes the measures of runs side by side, if all
    functions can be traced: the bits are the same. Others are asked instant by instant.

    Args:
        measures: the measures.
        engine: that makes the runs.
    """

    def __init__(self, measures: Sequence[OwnMeasure], engine: str):
        self._measures, self._engine = measures, engine
        self._known: dict[tuple[tuple[int, ...], ...], Any] = {}

    def of(self, result: Result, experiment: Experiment) -> list[float | None]:
        """The measures of a run.

        Args:
            result: the run.
            experiment: that was run.

        Raises:
            SweepError: a function fails, or returns something else than one number.
        """
        compiled = self._measures and self._engine == "compiled"
        numbers = self._numbers(result, experiment) if compiled else None
        if numbers is None:
            return [measure.of(result) for measure in self._measures]
        rows = numbers.of(Instant(*(getattr(result, name) for name in Instant._fields)))
        return [kept(own.over, result.t, row) for own, row in zip(self._measures, rows, strict=True)]

    # -- internals ----------------------------------------------------------------------------------------

    def _numbers(self, result: Result, experiment: Experiment) -> Any:
        """The library for a cell of the size of a run's; None if there is none, made once."""
        shapes = tuple(getattr(result, name).shape[1:] for name in Instant._fields)
        if shapes not in self._known:
            from ..compiled.own import OwnNumbers

            try:
                found = OwnNumbers([own.value for own in self._measures], experiment.closed_loop())
            except SynctrlError:
                found = None
            self._known[shapes] = found
        return self._known[shapes]


def own_of_all(measures: Sequence[OwnMeasure], measured: Any, span: float) -> list[list[float | None]]:
    """Own measures that were taken of runs while they went, a row for each run.

    Args:
        measures: the measures.
        measured: `Measured` of the compiled engine.
        span: how long the runs were, s.
    """
    if not measures:
        return [[] for _ in measured.status]
    largest, integral, final = np.moveaxis(measured.own, -1, 0)
    found = _made(largest, integral, final, span)
    return [
        [finite_or_none(found[own.over][run, k]) for k, own in enumerate(measures)]
        for run in range(len(measured.own))
    ]


def kept(over: str, t: np.ndarray, numbers: np.ndarray) -> float | None:
    """What is kept of the numbers of a run's instants, (T,); None if it is not finite.

    One step is added after another, as by code that measures a run while it goes.

    Args:
        over: a word of `OVER`.
        t: the instants, (T,), s.
        numbers: one of each.
    """
    with np.errstate(all="ignore"):
        before = np.append(0.0, numbers[:-1])
        integral = np.cumsum(np.diff(t, prepend=t[0]) * (numbers + before) / 2.0)[-1]
    made = _made(np.fmax.reduce(numbers), integral, numbers[-1], t[-1] - t[0])
    return finite_or_none(made[over])


def checked_measures(measures: Sequence[OwnMeasure], taken: Sequence[str]) -> tuple[OwnMeasure, ...]:
    """Own measures whose names are free.

    Args:
        measures: what a user gave.
        taken: names of other columns.

    Raises:
        InputError: something else than own measures, or a name that is taken.
    """
    names = [*taken]
    for own in measures:
        if not isinstance(own, OwnMeasure):
            raise InputError.expected("OwnMeasure objects", own, "measures")
        if own.name in names:
            raise InputError(
                f"the name '{own.name}' is taken; give each column a name of its own",
                subject="measures",
                found=own.name,
            )
        names.append(own.name)
    return tuple(measures)


# -- internals --------------------------------------------------------------------------------------------


def _made(largest: Any, integral: Any, final: Any, span: float) -> dict[str, Any]:
    """What is kept, by the words of `OVER`; nothing is the largest of numbers among which one is NaN."""
    with np.errstate(all="ignore"):
        largest = np.where(np.isnan(integral), np.nan, largest)
        return {"largest": largest, "mean": integral / span, "integral": integral, "final": final}


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
