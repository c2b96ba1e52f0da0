"""Sweep: many runs of one experiment, each with other values of some factors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack

from ..checks import count, index
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .distributions import Value
from .evaluation import CrewOptions, Evaluation, progress_bar
from .factors import Factor, Setup
from .journal import Journal
from .measures import warn_of
from .rows import Draws
from .study import Study, StudyOptions
from .worker import Job, Runner, Task


class Sweep:
    """Runs of an experiment under drawn and listed values of factors.

    Every run has a number, and random numbers of its own from the seed and that number alone: any run can be
    made again by itself, and no result depends on the number of workers or on their order. All combinations
    of the factors' grids are run, each `samples` times with new draws.

    Args:
        base: the experiment that is varied.
        factors: what differs from run to run; applied in this order.
        samples: draws per combination of grid values; with no grid, the number of runs.
        options: `seed`, `duration`, `dt`, `engine`, `control_period` and `bands`, see `Study`.

    Raises:
        InputError: a value of the wrong kind, no factor, or two factors of one name.
    """

    def __init__(
        self,
        base: Experiment,
        factors: Sequence[Factor],
        *,
        samples: int = 1,
        **options: Unpack[StudyOptions],
    ):
        self.study = Study(base, factors, **options)
        self.samples = count("samples", samples)
        values = {factor.name: factor.values for factor in self.study.factors}
        self._draws = Draws(values, self.samples, self.study.seed)

    def __repr__(self) -> str:
        return f"Sweep of {len(self)} runs\n{self.study!r}"

    # -- single runs --------------------------------------------------------------------------------------

    def __len__(self) -> int:
        """Number of runs."""
        return self._draws.count

    def values(self, run: int) -> dict[str, Value]:
        """Values of the factors in a run."""
        names = (factor.name for factor in self.study.factors)
        return dict(zip(names, self._task(run).values, strict=True))

    def setup(self, run: int) -> Setup:
        """A run's experiment, and how it is run."""
        return Job(self.study.base, self.study.factors, {}).setup(self._task(run).values)

    def experiment(self, run: int) -> Experiment:
        """A run's experiment."""
        return self.setup(run).experiment

    def simulate(self, run: int) -> Result:
        """The whole result of a run, made again.

        Raises:
            SynctrlError: the run stops or is refused.
        """
        return self.setup(run).simulate()

    def run_one(self, run: int) -> dict[str, Any]:
        """A run's row of the table, made again."""
        job = self.study.job()
        return dict(zip(job.columns, Runner(job).outcome(self._task(run)).row, strict=True))

    # -- all runs -----------------------------------------------------------------------------------------

    def run(
        self,
        folder: str | Path,
        workers: int = 2,
        backend: str = "joblib",
        *,
        client: Any = None,
        keep_every: int | None = None,
        batch: int | None = None,
        progress: bool = True,
    ) -> Path:
        """Make all runs that the folder does not have yet.

        Rows are on the disk as soon as they are there. Whatever ends the sweep, the same call goes on from
        them.

        Args:
            folder: where, see `Journal`; made if it does not exist.
            workers, backend, client, batch: who makes the runs, see `Evaluation`.
            keep_every: keep the trajectories of all runs in `runs/`, every so-many-th instant of each.
            progress: show a progress bar.

        Returns:
            The path of the table, `table.csv`.

        Raises:
            InputError, MissingDependencyError: a wrong value, or a backend or engine that cannot be had.
            ResultError, SweepFileError: another process has the folder, or it holds another sweep, is damaged
                in the line that is named, or cannot be written.
            SweepError: workers die again and again, or a function of a factor fails.

        Warns:
            StepWarning, SaturationWarning: how many of the runs that this call made to their end had too long
                a step or torque cut off, and which was the worst.
        """
        if keep_every is not None:
            count("keep_every", keep_every)
        with Journal(folder) as journal:
            crew = CrewOptions(workers=workers, backend=backend, client=client, batch=batch)
            return self._make(journal, keep_every, progress, crew)

    def about(self, job: Job) -> dict[str, Any]:
        """What the sweep is, as plain data."""
        more = {"samples": self.samples, "runs": len(self), "keep_every": job.keep_every}
        return self.study.about(job, **more)

    # -- internals ----------------------------------------------------------------------------------------

    def _make(self, journal: Journal, keep_every: int | None, progress: bool, crew: CrewOptions) -> Path:
        """Make the runs that a folder does not have yet; returns the path of the table."""
        job = self.study.job(journal.known(), keep_every)
        journal.begin(self.about(job), self._draws)
        evaluation = Evaluation(job, journal, **crew)
        tasks = [self._task(run) for run in range(len(self))]
        with progress_bar(len(tasks), len(journal.rows), progress) as bar, evaluation.open():
            for rows in evaluation.run(tasks):
                bar.update(len(rows))
        table = journal.finish()
        warn_of(evaluation.doubts, "sweep", self.study.base.dt)
        return table

    def _task(self, run: int) -> Task:
        """A run and its values."""
        number = index("run", run, len(self))
        return Task(number, tuple(self._draws.at(number)))  # type: ignore[arg-type]
