"""One process's share of a sweep: single runs, each of which ends as a row."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

from ..analysis.metrics import Band
from ..errors import SimulationError, SweepError, SynctrlError
from ..simulation.result import Result
from .distributions import Value
from .doubts import Doubt, doubt_of
from .factors import Factor, Setup
from .measures import MEASURES, measures
from .prepared import Prepared
from .rows import COMPLETED, REFUSED, STOPPED, Row, columns


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
    """

    base: Setup
    factors: tuple[Factor, ...]
    bands: Mapping[str, Band]
    keep_every: int | None = None

    def __repr__(self) -> str:
        return f"Job: {self.base!r}, {len(self.factors)} factors"

    @property
    def columns(self) -> list[str]:
        """Names of the entries of a row."""
        return columns(factor.name for factor in self.factors)

    def setup(self, values: Sequence[Value]) -> Setup:
        """The base with all factors applied, in their order."""
        setup = self.base
        for factor, value in zip(self.factors, values, strict=True):
            setup = factor.apply(setup, value)
        return setup


class Runner:
    """Makes the runs of a job in this process.

    Raises:
        MissingDependencyError, CompilationError: the engine cannot be had, and why.
        UnreachableError, CouplingError: the base experiment cannot run.
    """

    def __init__(self, job: Job):
        self.job = job
        self._prepared = Prepared(*job.base[:4])

    def outcome(self, task: Task) -> Outcome:
        """Make a run. One that stops or is refused is a row too, with its cause.

        Raises:
            SweepError: a function of the user failed.
        """
        try:
            result = self.simulate(task)
        except SimulationError as error:
            return self._outcome(task, STOPPED, error, error.result)
        except SweepError:
            raise
        except SynctrlError as error:
            return self._outcome(task, REFUSED, error, None)
        return self._outcome(task, COMPLETED, None, result)

    def simulate(self, task: Task) -> Result:
        """The whole result of a run.

        Raises:
            SynctrlError: it stops or is refused.
            SweepError: a function of the user failed.
        """
        try:
            setup = self.job.setup(task.values)
        except SynctrlError:
            raise
        except Exception as error:
            raise SweepError(
                f"a factor's function failed with {type(error).__name__}: {error}", subject=f"run {task.run}"
            ) from error
        return self._prepared.simulate(setup.experiment, setup.control_period)

    def _outcome(self, task: Task, status: str, error: SynctrlError | None, result: Result | None) -> Outcome:
        cause = None if error is None else _written(f"{type(error).__name__}: {error}")
        time = error.time if isinstance(error, SimulationError) else None
        values: list[Any] = [None] * len(MEASURES)
        doubt = None
        if status == COMPLETED and result is not None:
            values, doubt = measures(result, self.job.bands), doubt_of(result)
        row = [task.run, *task.values, status, cause, None if time is None else float(time), *values]
        return Outcome(row, self._keep(task, result), doubt)

    def _keep(self, task: Task, result: Result | None) -> Result | None:
        if self.job.keep_every is None or result is None:
            return None
        thin = result.decimated(self.job.keep_every)
        return replace(thin, info={**thin.info, "run": task.run}, experiment=None)


def _written(text: str) -> str:
    """A text that files can hold: halves of surrogate pairs, which a name may have, become question marks."""
    return text.encode(errors="replace").decode()


def run_batch(payload: bytes, tasks: Sequence[Task]) -> list[Outcome]:
    """Make some runs of a pickled job; what a worker process is asked to do."""
    runner = _runner(payload, threading.get_ident())
    return [runner.outcome(task) for task in tasks]


@lru_cache(maxsize=8)
def _runner(payload: bytes, thread: int) -> Runner:
    """The runner of a job, made once per thread: a user's functions need not be safe to share."""
    import pickle

    return Runner(pickle.loads(payload))
