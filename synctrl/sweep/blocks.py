"""Runs of a sweep side by side: values become columns, and all measures are taken while the library runs.

Runs that differ in numbers alone share a base run. What columns cannot speak for is left, to be made one by
one: values that are refused, factors of a user's own, runs that stop and have to say why.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import SweepError, SynctrlError
from ..simulation.engines import Run
from .columns import Columns, apart
from .distributions import Value
from .factors import Factor, Setup
from .further import further_values
from .measures import doubt_of_row, measures_of_all
from .own import own_of_all
from .rows import COMPLETED
from .tasks import Job, Outcome, Task

#: so many runs fill the lanes of any processor
LANES = 8
#: base runs that are kept ready
KEPT = 16
#: whole numbers up to here are floats
WHOLE = 2**53

#: an experiment and its control period -> a run that was looked at, and a library for many like it
Maker = Callable[[Setup], tuple[Run, Any]]


class Bench(NamedTuple):
    """A base run, and what makes runs like it side by side."""

    run: Run
    batch: Any


class Blocks:
    """Makes those runs of a job side by side of which columns can speak.

    Args:
        job: what all runs share.
        make: a base run and its batch, of a setup.

    Attributes:
        possible: whether there can be such runs at all.
    """

    def __init__(self, job: Job, make: Maker):
        self._job, self._make = job, make
        columns = [factor.columns for factor in job.factors]
        self.possible = job.base.engine == "compiled" and job.keep_every is None and None not in columns
        self._apart = [k for k, change in enumerate(columns) if change is apart]
        self._benches: dict[tuple[Value, ...], Bench | None] = {}

    def outcomes(self, tasks: Sequence[Task]) -> dict[int, Outcome]:
        """What became of runs that were made side by side to their end, by number of the run.

        Raises:
            SweepError: the columns of a user's factor failed.
        """
        groups: dict[tuple[Value, ...], list[Task]] = {}
        for task in tasks if self.possible else ():
            groups.setdefault(tuple(task.values[k] for k in self._apart), []).append(task)
        found: dict[int, Outcome] = {}
        for shared, group in groups.items():
            if self._apart and len(group) == 1:  # a base run of its own costs more than the run
                continue
            try:
                found |= self._group(shared, group)
            except SweepError:
                raise
            except SynctrlError:  # made one by one, each of them says why
                continue
        return found

    # -- internals ----------------------------------------------------------------------------------------

    def _group(self, shared: tuple[Value, ...], tasks: Sequence[Task]) -> dict[int, Outcome]:
        """Make runs of one base run.

        Raises:
            SynctrlError: a change that columns, or all of these runs, refuse.
        """
        bench = self._bench(shared)
        if bench is None:
            return {}
        columns = Columns(bench.run, len(tasks))
        with np.errstate(over="ignore"):
            for k, factor in enumerate(self._job.factors):
                if k not in self._apart and factor.columns is not None:
                    values = as_numbers(task.values[k] for task in tasks)
                    if values is None:
                        return {}
                    _change(columns, factor, values)
        arrays = columns.arrays()
        made = [task for task, left in zip(tasks, columns.left, strict=True) if not left]
        if not made:
            return {}
        return self._told(made, bench.run, bench.batch.measure(arrays, len(made)))

    def _told(self, tasks: Sequence[Task], run: Run, measured: Any) -> dict[int, Outcome]:
        """Runs that went to their end, with what is asked for beside the measures of all runs."""
        outcomes, names = told(tasks, run, measured), self._job.further
        own = own_of_all(self._job.own, measured, run.clock.end)
        for task, last in zip(tasks, own, strict=True):
            if task.run in outcomes:
                found = further_values(names, self._job.setup(task.values)) if names else []
                outcome = outcomes[task.run]
                outcomes[task.run] = outcome._replace(row=[*outcome.row, *found, *last])
        return outcomes

    def _bench(self, shared: tuple[Value, ...]) -> Bench | None:
        """The base run of a group, None if it cannot have one; made once."""
        if shared not in self._benches:
            while len(self._benches) >= KEPT:
                self._benches.pop(next(iter(self._benches)))
            try:
                setup = self._job.base
                for k, value in zip(self._apart, shared, strict=True):
                    setup = self._job.factors[k].apply(setup, value)
                self._benches[shared] = Bench(*self._make(setup))
            except SynctrlError:
                self._benches[shared] = None
        return self._benches[shared]


def _change(columns: Columns, factor: Factor, values: np.ndarray) -> None:
    """Write the columns of a factor.

    Raises:
        SweepError: its function, which may be a user's, failed.
    """
    try:
        factor.columns(columns, values)  # type: ignore[misc]
    except SynctrlError:
        raise
    except Exception as error:
        raise SweepError(
            f"its columns failed with {type(error).__name__}: {error}", subject=f"factor '{factor.name}'"
        ) from error


def as_numbers(values: Iterable[Value]) -> np.ndarray | None:
    """A column of values as floats; None if some are words, or no floats can hold them."""
    listed = list(values)
    plain = all(type(value) is float or (type(value) is int and abs(value) < WHOLE) for value in listed)
    return np.array(listed, dtype=float) if plain else None


def told(tasks: Sequence[Task], run: Run, measured: Any) -> dict[int, Outcome]:
    """Rows of those runs that went to their end, as `Measured` has them."""
    ended = np.flatnonzero(measured.status == 0)
    rows = measures_of_all(measured, run.clock.end)
    return {
        tasks[k].run: Outcome(
            [tasks[k].run, *tasks[k].values, COMPLETED, None, None, *rows[k]], None, doubt_of_row(rows[k])
        )
        for k in ended.tolist()
    }
