"""What is asked of a worker, what it answers, and what all runs of a sweep share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..analysis.metrics import Band
from ..simulation.result import Result
from .distributions import Value
from .factors import Factor, Setup
from .measures import MEASURES, Doubt
from .rows import Row, columns


class Task(NamedTuple):
    """A run to be made: its number, and the values of its factors."""

    run: int
    values: tuple[Value, ...]


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
    """

    base: Setup
    factors: tuple[Factor, ...]
    bands: Mapping[str, Band]
    keep_every: int | None = None
    further: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Job: {self.base!r}, {len(self.factors)} factors"

    @property
    def columns(self) -> list[str]:
        """Names of the entries of a row."""
        return columns((factor.name for factor in self.factors), (*MEASURES, *self.further))

    def setup(self, values: Sequence[Value]) -> Setup:
        """The base with all factors applied, in their order."""
        setup = self.base
        for factor, value in zip(self.factors, values, strict=True):
            setup = factor.apply(setup, value)
        return setup
