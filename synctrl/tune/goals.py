"""Goals of a search, limits that its runs have to keep, and what is better: a run, or another one.

A run counts if it goes to its end, keeps all limits and has a number for every goal. One that does not is
worse in all goals than every run that counts; worse than one without a number is one beyond a limit, and
worse still one that stops. Among these the smaller excess and the later end are better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..checks import choice, instance, non_negative_number, positive_number
from ..errors import InputError
from ..sweep.further import FURTHER
from ..sweep.measures import MEASURES
from ..sweep.rows import COMPLETED

#: what goals may be
MEASURED = (*MEASURES, *FURTHER)
TORQUE = "peak_torque"


class Goal(NamedTuple):
    """A measure that is to be small, or large if `larger` is true."""

    name: str
    larger: bool = False

    def told(self, value: float) -> float:
        """What a search is told of a measure: from 0 for the best to 1, in the order of what is better."""
        return 1 / (1 + value) if self.larger else value / (1 + value)


class Judge(NamedTuple):
    """How good rows of a search are.

    Attributes:
        goals: what is looked for.
        limits: the largest allowed value of measures, by name.
        duration: of a run, s.
    """

    goals: tuple[Goal, ...]
    limits: Mapping[str, float]
    duration: float

    def fault(self, row: Mapping[str, Any]) -> float:
        """0 for a row that counts; up to 1 without a number for a goal, 2 beyond limits, 3 if stopped."""
        if row["status"] != COMPLETED:
            return 3 - (row["stop_time"] or 0.0) / self.duration
        beyond = [_excess(row[name], limit) for name, limit in self.limits.items()]
        if any(beyond):
            return 1 + sum(beyond) / len(beyond)
        return sum(row[goal.name] is None for goal in self.goals) / len(self.goals)

    def told(self, row: Mapping[str, Any]) -> list[float]:
        """A number for each goal, which a search makes small; above 1 in all for a row with a fault."""
        fault = self.fault(row)
        if fault:
            return [1 + fault] * len(self.goals)
        return [goal.told(row[goal.name]) for goal in self.goals]

    def values(self, rows: Sequence[Mapping[str, Any]]) -> np.ndarray:
        """Measures of rows that count, of which small ones are good, (rows, goals)."""
        signs = [-1.0 if goal.larger else 1.0 for goal in self.goals]
        found = [[row[goal.name] for goal in self.goals] for row in rows]
        return np.array(found, dtype=float).reshape(len(found), len(signs)) * signs

    def front(self, rows: Sequence[Mapping[str, Any]]) -> list[Any]:
        """Rows that count and to which no other one is preferable, the best in the first goal first."""
        counting = [row for row in rows if not self.fault(row)]
        values = self.values(counting)
        best = np.flatnonzero(non_dominated(values))
        return [counting[k] for k in best[np.lexsort(values[best].T[::-1])]]


def read_goals(minimize: str | Sequence[str], maximize: str | Sequence[str]) -> tuple[Goal, ...]:
    """Goals by their names.

    Raises:
        InputError: a name that is no measure, one twice, none at all, or a margin that is to be small.
    """
    goals = [
        *(Goal(choice("minimize", name, MEASURES)) for name in _names("minimize", minimize)),
        *(Goal(choice("maximize", name, MEASURED), True) for name in _names("maximize", maximize)),
    ]
    names = [goal.name for goal in goals]
    if not names:
        raise InputError.expected("at least one measure", minimize, "minimize")
    if len({*names}) < len(names):
        raise InputError.expected("every measure once", names, "minimize, maximize")
    return tuple(goals)


def read_limits(limits: Mapping[str, float] | None, torque_limit: float | None) -> dict[str, float]:
    """The largest allowed value of measures, by name.

    Raises:
        InputError: no measure of a run, no number from 0, or two limits of the torque.
    """
    found = {}
    for name, value in ({} if limits is None else _mapping(limits)).items():
        found[choice("limits", name, MEASURES)] = non_negative_number(f"limits, {name}", value)
    if torque_limit is not None:
        if TORQUE in found:
            raise InputError.expected(f"one of torque_limit and limits of {TORQUE}", "both", "torque_limit")
        found[TORQUE] = positive_number("torque_limit", torque_limit)
    return found


def _mapping(limits: Any) -> Mapping[str, float]:
    instance("limits", limits, Mapping, "numbers by name of a measure")
    return limits


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Rows to which no other one is preferable, (N,): as small in every column and smaller in one.

    Args:
        values: finite numbers, (N, columns).
    """
    found = np.zeros(len(values), dtype=bool)
    for k in np.lexsort(values.T[::-1]):  # whatever is preferable to a row comes before it
        front = values[found]
        found[k] = not ((front <= values[k]).all(axis=1) & (front < values[k]).any(axis=1)).any()
    return found


def knee(values: np.ndarray) -> int:
    """The row of a front that is nearest to the best of every column, as shares of what the front spans.

    Args:
        values: finite numbers of which small ones are good, (N, columns).
    """
    low = values.min(axis=0)
    span = np.ptp(values, axis=0)
    shares = (values - low) / np.where(span > 0, span, 1.0)
    return int(np.argmin((shares**2).sum(axis=1)))


def _names(what: str, names: str | Sequence[str]) -> list[str]:
    if isinstance(names, str):
        return [names]
    instance(what, names, Sequence, "a name of a measure, or several")
    return list(names)


def _excess(value: float | None, limit: float) -> float:
    """How far a measure is beyond its limit, from 0 to 1; one that has no number is farthest."""
    if value is None:
        return 1.0
    if value <= limit:
        return 0.0
    return 1 - limit / value if limit else value / (1 + value)
