"""Which runs a sweep or a search has, and what their factors' values are: known from its definition alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from .distributions import Grid, Value, Values, drawn
from .rows import Row, fault_of_values


@dataclass(frozen=True)
class Draws:
    """The runs of a sweep.

    All combinations of the grids are run, each `samples` times with new draws. Every run has random numbers
    of its own, from the seed and its number alone.

    Args:
        factors: values by the name of their factor, in the order of the table; None for values of a kind
            that is not known here.
        samples: draws per combination of grid values.
        seed: whole number from 0.
    """

    factors: Mapping[str, Values | None]
    samples: int
    seed: int

    @property
    def count(self) -> int:
        """Number of runs."""
        return self.samples * prod(self._sizes)

    def at(self, run: int) -> tuple[Value | None, ...]:
        """Values in a run: of grids by its number, others by its random numbers; None where unknown."""
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(run,)))
        found: list[Value | None] = []
        known = True  # what is drawn after values of an unknown kind is not known either
        for (name, values), k in zip(self.factors.items(), self._point(run // self.samples), strict=True):
            known = known and values is not None
            if isinstance(values, Grid):
                found.append(values.values[k])
            else:
                found.append(drawn(name, values, rng) if known else None)
        return tuple(found)

    def fault(self, run: int, values: Sequence[Any], rows: Mapping[int, Row]) -> str:
        """Why no run has this number and these values."""
        if run >= self.count:
            return f"expected a run from 0 to {self.count - 1}, found {run}"
        fault = fault_of_values(self.factors, self.at(run), values)
        return fault and f"run {run}, {fault}"

    @property
    def _sizes(self) -> list[int]:
        return [len(v.values) if isinstance(v, Grid) else 1 for v in self.factors.values()]

    def _point(self, number: int) -> list[int]:
        """A combination of the grids, by its number: the last grid changes first."""
        point = []
        for size in reversed(self._sizes):
            number, k = divmod(number, size)
            point.append(k)
        return point[::-1]


@dataclass(frozen=True)
class Generations:
    """The runs of a search: as many as it takes, a generation at a time.

    Args:
        factors: ranges by the name of their factor; None for one of a kind that is not known here.
        population: runs per generation.
    """

    factors: Mapping[str, Values | None]
    population: int

    def fault(self, run: int, values: Sequence[Any], rows: Mapping[int, Row]) -> str:
        """Why no run has this number and these values: its generation has not come, or they are outside."""
        first = (run // self.population - 1) * self.population
        if first >= 0 and not any(first + k in rows for k in range(self.population)):
            before = f"{first} to {first + self.population - 1}"
            return f"expected runs of the generation before, {before}, found {run}"
        fault = fault_of_values(self.factors, [None] * len(self.factors), values)
        for (name, interval), value in zip(self.factors.items(), values, strict=True):
            low, high = getattr(interval, "low", None), getattr(interval, "high", None)
            if fault or low is None or high is None:
                continue
            if isinstance(value, str) or not low <= value <= high:
                fault = f"{name}: expected a number from {low:g} to {high:g}, found {value!r}"
        return fault and f"run {run}, {fault}"
