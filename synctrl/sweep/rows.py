"""Runs and rows: which runs a sweep or a search has, and whether a row of its table can be of one of them.

Runs and the values of their factors are known from the definition of a sweep alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import SweepFileError
from .distributions import Grid, Value, Values, drawn, is_text
from .measures import MEASURES

Row = list[Any]

COMPLETED, STOPPED, REFUSED = "completed", "stopped", "refused"
#: how the run ended
ENDING = "status", "cause", "stop_time"
#: how far a value may be off: less than two draws ever are, more than the last digits of other machines
CLOSE = 1e-9


def columns(factors: Iterable[str], measures: Sequence[str] = MEASURES) -> list[str]:
    """Names of the entries of a row, for factors and measures of these names."""
    return ["run", *factors, *ENDING, *measures]


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


class Format(NamedTuple):
    """What rows of one sweep have to be.

    Attributes:
        columns: names of a row's entries.
        runs: which runs there are.
        duration: of every run, s.
        measures: names of the last entries.
        own: names of those of them that a user has defined, and that may be negative.
    """

    columns: Sequence[str]
    runs: Draws | Generations
    duration: float
    measures: Sequence[str] = MEASURES
    own: Sequence[str] = ()

    def read(self, path: Path, content: bytes) -> dict[int, Row]:
        """Rows of a file's complete lines by number of the run, in the order of the lines.

        Raises:
            SweepFileError: a complete line that is no row of this sweep; the message names file and line.
        """
        rows: dict[int, Row] = {}
        for number, line in enumerate(content.split(b"\n")[:-1], start=1):
            row = _decoded(line)
            fault = self.fault(row, rows)
            if fault:
                shown = line[:60].decode(errors="replace")
                raise wrong_line(path, number, f"{fault}, in {shown!r}")
            rows[row[0]] = row
        return rows

    def fault(self, row: Any, rows: Mapping[int, Row]) -> str:
        """Why something is no row that can follow others; "" if it is one."""
        if not isinstance(row, list) or len(row) != len(self.columns):
            return f"expected a run's {len(self.columns)} values"
        measured = len(row) - len(self.measures)
        ended = measured - len(ENDING)
        run, values, (status, cause, stop_time) = row[0], row[1:ended], row[ended:measured]
        if type(run) is not int or run < 0:
            return f"expected the number of a run, found {_short(run)}"
        if run in rows:
            same = "the same" if rows[run] == row else "other values"
            return f"expected each run once, found run {run} again; line {line_of(run, rows)} has {same}"
        return (
            self.runs.fault(run, values, rows)
            or _fault_of_ending(status, cause, stop_time, self.duration)
            or _fault_of_measures(status, self.measures, row[measured:], self.own)
        )


def wrong_line(path: Path, line: int, fault: str) -> SweepFileError:
    """The error about a line of a file."""
    message = f"'{path}', line {line}: {fault}; take the line out and its run is made again"
    return SweepFileError(message, file=path, line=line)


def line_of(run: int, rows: Mapping[int, Row]) -> int:
    """In which line of its file a row stands, counted from 1: rows are in the order of the lines."""
    return list(rows).index(run) + 1


def fault_of_values(names: Iterable[str], expected: Sequence[Value | None], found: Sequence[Any]) -> str:
    """The first value that is not the expected one; None stands for any number or word."""
    for name, wanted, value in zip(names, expected, found, strict=True):
        if not _is_number(value) and not is_text(value):
            return f"{name}: expected a finite number or a word, found {_short(value)}"
        if wanted is not None and not _close(wanted, value):
            return f"{name}: expected {_short(wanted)}, found {_short(value)}"
    return ""


def _fault_of_ending(status: Any, cause: Any, stop_time: Any, duration: float) -> str:
    if status not in (COMPLETED, STOPPED, REFUSED):
        return f"status: expected {COMPLETED}, {STOPPED} or {REFUSED}, found {_short(status)}"
    if (cause is not None) if status == COMPLETED else not is_text(cause):
        expected = "none" if status == COMPLETED else "why the run ended"
        return f"cause: expected {expected}, found {_short(cause)}"
    if stop_time is None:
        return ""
    if status != STOPPED or not _is_number(stop_time) or not 0 <= stop_time <= duration * (1 + CLOSE):
        expected = f"a time from 0 to {duration:g}" if status == STOPPED else "none"
        return f"stop_time: expected {expected}, found {_short(stop_time)}"
    return ""


def _fault_of_measures(status: str, names: Sequence[str], measured: Sequence[Any], own: Sequence[str]) -> str:
    for name, value in zip(names, measured, strict=True):
        if value is None:
            continue
        if status != COMPLETED:
            return f"{name}: expected none of a run that {status}, found {_short(value)}"
        least = "" if name in own else " of at least 0"
        if not _is_number(value) or (least and value < 0):
            return f"{name}: expected a finite number{least}, found {_short(value)}"
    return ""


def _decoded(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def _close(a: Value, b: Any) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    return math.isclose(a, b, rel_tol=CLOSE)


def _is_number(value: Any) -> bool:
    if type(value) is int:
        return abs(value) < 2**1000  # larger ones are no floats, and cannot even be compared with one
    return type(value) is float and math.isfinite(value)


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else text[:77] + "..."
