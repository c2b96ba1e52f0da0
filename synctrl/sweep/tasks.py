"""What is asked of a worker, what it answers, and what all runs of a sweep share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, overload

from ..analysis.metrics import Band
from ..simulation.result import Result
from .distributions import Value
from .factors import Factor, Setup
from .measures import MEASURES, Doubt
from .own import OwnMeasure
from .rows import Draws, Row, columns


class Task(NamedTuple):
    """A run to be made: its number, and the values of its factors."""

    run: int
    values: tuple[Value, ...]


class Drawn(Sequence[Task]):
    """Runs of a sweep, whose values are drawn when somebody asks for them.

    Args:
        draws: what says the values of a run.
        runs: numbers of the runs.
    """

    def __init__(self, draws: Draws, runs: range):
        self._draws, self._runs = draws, runs

    def __len__(self) -> int:
        return len(self._runs)

    @overload
    def __getitem__(self, k: int) -> Task: ...
    @overload
    def __getitem__(self, k: slice) -> Drawn: ...
    def __getitem__(self, k: int | slice) -> Task | Drawn:
        if isinstance(k, slice):
            return Drawn(self._draws, self._runs[k])
        return Task(self._runs[k], self._draws.at(self._runs[k]))  # type: ignore[arg-type]


class Outcome(NamedTuple):
    """A run that was made.

    Attributes:
        row: its row.
        kept: its decimated result, if it is to be kept.
        doubt: why its measures are to be doubted; None if it did not go to its end.
    """

    row: Row
    kept: Result | None = None
    doubt: Doubt | None = None


class Job(NamedTuple):
    """What all runs of a sweep share.

    Attributes:
        base: what is varied.
        factors: how.
        bands: settling bands by kind of error.
        keep_every: which of the logged instants are kept, or None for no trajectories.
        further: names of the measures of `FURTHER` that rows have too, after all others.
        own: measures of the user's own, which come last.
    """

    base: Setup
    factors: tuple[Factor, ...]
    bands: Mapping[str, Band]
    keep_every: int | None = None
    further: tuple[str, ...] = ()
    own: tuple[OwnMeasure, ...] = ()

    def __repr__(self) -> str:
        return f"Job: {self.base!r}, {len(self.factors)} factors"

    @property
    def columns(self) -> list[str]:
        """Names of the entries of a row."""
        return columns((factor.name for factor in self.factors), self.measures)

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of the measures of a row."""
        return (*MEASURES, *self.further, *(own.name for own in self.own))

    def setup(self, values: Sequence[Value]) -> Setup:
        """The base with all factors applied, in their order."""
        setup = self.base
        for factor, value in zip(self.factors, values, strict=True):
            setup = factor.apply(setup, value)
        return setup
