"""One process's share of a sweep: runs side by side or alone, each of which ends as a row."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from ..analysis.metrics import Band
from ..checks import choice
from ..errors import SimulationError, SweepError, SynctrlError
from ..simulation.engines import Run, find_engine
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .blocks import LANES, Blocks
from .factors import Setup
from .further import further_values
from .measures import doubt_of, measures
from .own import OwnMeasure, OwnMeasures
from .rows import COMPLETED, REFUSED, STOPPED
from .tasks import Job, Outcome
from .tasks import Task as Task


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
        self._engine, self._libraries = find_engine(engine), dict[str, Any]()
        if engine == "compiled":
            from ..compiled.engine import Compiled
            from ..compiled.tables import Tables

            self._engine = Compiled(self._libraries, Tables())
            self._engine.load(run)

    def simulate(self, experiment: Experiment, control_period: float | None = None) -> Result:
        """Run a variation of the experiment.

        Whether its paths can be reached, and its plant fits, is looked at again only if it has other paths,
        arms or kinds of plant.

        Raises:
            see `Experiment.simulate`
        """
        return self._engine.run(self._looked_at(experiment, control_period), None)

    def batch(
        self, setup: Setup, bands: Mapping[str, Band], own: Sequence[OwnMeasure] = ()
    ) -> tuple[Run, Any]:
        """A variation as the base of many, and what makes runs side by side that differ from it in numbers.

        Raises:
            InputError: own measures that cannot be traced.
            see `Experiment.simulate`
        """
        from ..compiled.batch import Batch

        run = self._looked_at(setup.experiment, setup.control_period)
        return run, Batch(run, bands, self._libraries, own=[measure.value for measure in own])

    def _looked_at(self, experiment: Experiment, control_period: float | None) -> Run:
        """A run that can begin."""
        run = self._plan(experiment, control_period)
        run.check_step()
        if not _same(list(_paths(experiment)), self._known):
            run.check()
        return run

    def _plan(self, experiment: Experiment, control_period: float | None) -> Run:
        return experiment.plan(self.duration, self.dt, control_period, log_dt=self.log_dt)


class Runner:
    """Makes the runs of a job in this process.

    Attributes:
        job: the job.
        lanes: how many runs it makes side by side; 1 if it makes them one by one.

    Raises:
        MissingDependencyError, CompilationError: the engine cannot be had, and why.
        UnreachableError, CouplingError: the base experiment cannot run.
    """

    def __init__(self, job: Job):
        self.job = job
        self._prepared = Prepared(*job.base[:4])
        self._blocks = Blocks(job, partial(self._prepared.batch, bands=job.bands, own=job.own))
        self._own = OwnMeasures(job.own, job.base.engine)
        self.lanes = LANES if self._blocks.possible else 1

    def outcomes(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Make runs, side by side where that can be. One that stops or is refused is a row too.

        Raises:
            SweepError: a function of the user failed.
        """
        found = self._blocks.outcomes(tasks)
        return (found[task.run] if task.run in found else self.outcome(task) for task in tasks)

    def go_together(self, tasks: Sequence[Task]) -> bool:
        """Whether runs like these can be made side by side; what they share is ready from then on."""
        return bool(self._blocks.outcomes(tasks[: self.lanes]))

    def outcome(self, task: Task) -> Outcome:
        """Make a run by itself.

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
        values: list[Any] = [None] * len(self.job.measures)
        doubt = None
        if status == COMPLETED and result is not None:
            values, doubt = measures(result, self.job.bands), doubt_of(result)
            setup = self.job.setup(task.values)
            values += further_values(self.job.further, setup) + self._own.of(result, setup.experiment)
        row = [task.run, *task.values, status, cause, None if time is None else float(time), *values]
        return Outcome(row, self._keep(task, result), doubt)

    def _keep(self, task: Task, result: Result | None) -> Result | None:
        if self.job.keep_every is None or result is None:
            return None
        thin = result.decimated(self.job.keep_every)
        return replace(thin, info={**thin.info, "run": task.run}, experiment=None)


def run_batch(payload: bytes, tasks: Sequence[Task]) -> list[Outcome]:
    """Make some runs of a pickled job; what a worker process is asked to do."""
    return [*_runner(payload, threading.get_ident()).outcomes(tasks)]


def runner_of(payload: bytes) -> Runner:
    """The runner of a pickled job."""
    import pickle

    return Runner(pickle.loads(payload))


@lru_cache(maxsize=8)
def _runner(payload: bytes, thread: int) -> Runner:
    """The runner of a job, made once per thread: a user's functions need not be safe to share."""
    return runner_of(payload)


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
