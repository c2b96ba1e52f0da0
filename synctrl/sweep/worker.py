"""One process's share of a sweep: single runs, each of which ends as a row; what they share is made once."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

from ..analysis.metrics import Band
from ..checks import choice
from ..errors import SimulationError, SweepError, SynctrlError
from ..simulation.engines import Run, find_engine
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .distributions import Value
from .factors import Factor, Setup
from .further import further_values
from .measures import MEASURES, Doubt, doubt_of, measures
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


class Prepared:
    """An experiment that was looked at once, and whose variations run without it being done again.

    Their results are those of `Experiment.simulate`, bit for bit. For the compiled engine the library is
    loaded once, and what is desired is tabulated once; only what changed is written for a run.

    Args:
        experiment: the experiment.
        duration: s; by default the experiment's.
        dt: step, s.
        engine: "pinocchio" or "compiled".
        log_dt: interval of the logs, a multiple of dt, s; by default dt.

    Raises:
        InputError: see `Experiment.simulate`.
        UnreachableError, CouplingError: the experiment cannot run.
        MissingDependencyError, CompilationError: the compiled engine cannot be had, and why.
    """

    def __init__(
        self,
        experiment: Experiment,
        duration: float | None = None,
        dt: float = 1e-3,
        engine: str = "compiled",
        log_dt: float | None = None,
    ):
        self.engine = choice("engine", engine, ("pinocchio", "compiled"))
        self.duration, self.dt = experiment.duration if duration is None else duration, dt
        self.log_dt = log_dt
        run = self._plan(experiment, None)
        run.check_step()
        run.check()
        self._known = list(_paths(experiment))
        self._engine = find_engine(engine)
        if engine == "compiled":
            from ..compiled.engine import Compiled, Tables

            self._engine = Compiled({}, Tables())
            self._engine.load(run)

    def simulate(self, experiment: Experiment, control_period: float | None = None) -> Result:
        """Run a variation of the experiment.

        Whether its paths can be reached, and its plant fits, is looked at again only if it has other paths,
        arms or kinds of plant.

        Raises:
            see `Experiment.simulate`
        """
        run = self._plan(experiment, control_period)
        run.check_step()
        paths = list(_paths(experiment))
        if not _same(paths, self._known):
            run.check()
        return self._engine.run(run, None)

    def _plan(self, experiment: Experiment, control_period: float | None) -> Run:
        return experiment.plan(self.duration, self.dt, control_period, log_dt=self.log_dt)


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
            setup = self._setup(task)
            result = self._prepared.simulate(setup.experiment, setup.control_period)
        except SimulationError as error:
            return self._outcome(task, STOPPED, error, error.result)
        except SweepError:
            raise
        except SynctrlError as error:
            return self._outcome(task, REFUSED, error, None)
        return self._outcome(task, COMPLETED, None, result)

    def _setup(self, task: Task) -> Setup:
        try:
            return self.job.setup(task.values)
        except SynctrlError:
            raise
        except Exception as error:
            raise SweepError(
                f"a factor's function failed with {type(error).__name__}: {error}", subject=f"run {task.run}"
            ) from error

    def _outcome(self, task: Task, status: str, error: SynctrlError | None, result: Result | None) -> Outcome:
        cause = None
        if error is not None:  # halves of surrogate pairs, which a name may have, become question marks
            cause = f"{type(error).__name__}: {error}".encode(errors="replace").decode()
        time = error.time if isinstance(error, SimulationError) else None
        values: list[Any] = [None] * (len(MEASURES) + len(self.job.further))
        doubt = None
        if status == COMPLETED and result is not None:
            values, doubt = measures(result, self.job.bands), doubt_of(result)
            values += further_values(self.job.further, self.job.setup(task.values))
        row = [task.run, *task.values, status, cause, None if time is None else float(time), *values]
        return Outcome(row, self._keep(task, result), doubt)

    def _keep(self, task: Task, result: Result | None) -> Result | None:
        if self.job.keep_every is None or result is None:
            return None
        thin = result.decimated(self.job.keep_every)
        return replace(thin, info={**thin.info, "run": task.run}, experiment=None)


def run_batch(payload: bytes, tasks: Sequence[Task]) -> list[Outcome]:
    """Make some runs of a pickled job; what a worker process is asked to do."""
    runner = _runner(payload, threading.get_ident())
    return [runner.outcome(task) for task in tasks]


@lru_cache(maxsize=8)
def _runner(payload: bytes, thread: int) -> Runner:
    """The runner of a job, made once per thread: a user's functions need not be safe to share."""
    import pickle

    return Runner(pickle.loads(payload))


def _paths(experiment: Experiment) -> Iterator[Any]:
    """What decides whether desired motions can be reached, weights inverted, and the plant asked."""
    cell = experiment.cell
    yield from (cell.coupling, cell.space, experiment.plant_type)
    for member in cell.members:
        model = member.robot.model
        yield member.trajectory
        placements = [*model.jointPlacements, model.frames[member.robot.tip_id].placement]
        yield [placement.homogeneous.tolist() for placement in placements]


def _same(a: list[Any], b: list[Any]) -> bool:
    """Equal lists and identical objects."""
    pairs = zip(a, b, strict=True) if len(a) == len(b) else [(False, True)]
    return all(x is y or (isinstance(x, list) and x == y) for x, y in pairs)
