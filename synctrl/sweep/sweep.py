"""Sweep: many runs of one experiment, each with other values of some factors; Study: what searches share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np

from ..analysis.metrics import Band, settling_bands
from ..checks import choice, count, index, instance, positive_number
from ..errors import InputError, SimulationError
from ..simulation.description import versions
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .description import OWN, checked_bands, describe_base
from .distributions import Value
from .evaluation import Evaluation, Evaluator, progress_bar
from .factors import Factor, Setup
from .further import FURTHER
from .journal import Journal
from .measures import MEASURES, definitions, warn_of
from .own import OwnMeasure, checked_measures
from .rows import Draws, columns
from .tasks import Drawn, Job, Task
from .worker import Prepared, Runner


class StudyOptions(TypedDict, total=False):
    """How all runs of a sweep or a search are made: arguments of `Study`, which says what they mean."""

    seed: int
    duration: float | None
    dt: float
    engine: str
    control_period: float | None
    bands: Mapping[str, Band] | None
    measures: Sequence[OwnMeasure]


class Study:
    """What all runs of a sweep or a search share.

    Args:
        base: the experiment that is varied.
        factors: what differs from run to run; applied in this order.
        seed: whole number from 0.
        duration: s; by default the experiment's.
        dt: step, s.
        engine: "compiled" or "pinocchio", see `Experiment.simulate`.
        control_period: None for continuous control, or the period of sampled control, s.
        bands: settling bands by kind of error, in its unit; by default 5% of the largest error of the base
            experiment's run, which then has to run to its end.
        measures: measures of your own, which the table has after all others.

    Raises:
        InputError: a value of the wrong kind, no factor, two columns of one name, or an adaptation and Gamma.
    """

    def __init__(
        self,
        base: Experiment,
        factors: Sequence[Factor],
        *,
        seed: int = 0,
        duration: float | None = None,
        dt: float = 1e-3,
        engine: str = "compiled",
        control_period: float | None = None,
        bands: Mapping[str, Band] | None = None,
        measures: Sequence[OwnMeasure] = (),
    ):
        instance("base", base, Experiment, "an Experiment")
        duration = base.duration if duration is None else positive_number("duration", duration)
        choice("engine", engine, ("compiled", "pinocchio"))
        period = None if control_period is None else positive_number("control_period", control_period)
        self.base = Setup(base, duration, positive_number("dt", dt), engine, period)
        self.factors = _checked_factors(factors)
        taken = columns((factor.name for factor in self.factors), (*MEASURES, *FURTHER))
        self.measures = checked_measures(measures, taken)
        self.seed = count("seed", seed, least=0)
        self._bands = None if bands is None else checked_bands(bands)

    def job(self, known: Mapping[str, Any] | None = None, keep_every: int | None = None) -> Job:
        """What workers are told; with the settling bands of a description that is there, if any."""
        if self._bands is None and known is not None:
            bands = checked_bands(known["settling_bands"])
        else:
            bands = self._found_bands
        return Job(self.base, self.factors, bands, keep_every, own=self.measures)

    def about(self, job: Job, **more: Any) -> dict[str, Any]:
        """Everything that a row depends on, as plain data, and what its entries mean."""
        setup = self.base
        measured = definitions(setup.experiment.cell)
        measured |= {name: FURTHER[name].measure for name in job.further}
        measured |= {own.name: own.measure for own in job.own}
        if job.own:
            more[OWN] = [own.describe() for own in job.own]
        return {
            "factors": [factor.describe() for factor in self.factors],
            "seed": self.seed,
            **more,
            "duration": setup.duration,
            "dt": setup.dt,
            "engine": setup.engine,
            "control_period": setup.control_period,
            "base": describe_base(setup),
            "settling_bands": {kind: np.asarray(band).tolist() for kind, band in job.bands.items()},
            "columns": job.columns,
            "measures": {name: measured[name]._asdict() for name in job.measures},
            "versions": versions(),
        }

    def __repr__(self) -> str:
        factors = "".join(f"\n  {factor.name}: {factor.values!r}" for factor in self.factors)
        return f"Study of {self.base!r}, seed {self.seed}{factors}"

    @cached_property
    def _found_bands(self) -> dict[str, Band]:
        if self._bands is not None:
            return self._bands
        setup = self.base
        try:
            result = Prepared(*setup[:4]).simulate(setup.experiment, setup.control_period)
        except SimulationError as error:
            raise InputError(
                f"its own run stops, so there is no scale for settling times: {error}; give `bands`, "
                "or start from an experiment that runs to its end",
                subject="base",
            ) from error
        return settling_bands(result)


class Sweep:
    """Runs of an experiment under drawn and listed values of factors.

    Every run has a number, and random numbers of its own from the seed and that number alone: any run can be
    made again by itself, and no result depends on the number of workers or on their order. All combinations
    of the factors' grids are run, each `samples` times with new draws.

    Args:
        base: the experiment that is varied.
        factors: what differs from run to run; applied in this order.
        samples: draws per combination of grid values; with no grid, the number of runs.
        options: `seed`, `duration`, `dt`, `engine`, `control_period`, `bands` and `measures`, see `Study`.

    Raises:
        InputError: a value of the wrong kind, no factor, or two columns of one name.
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
        (outcome,) = Runner(job).outcomes([self._task(run)])
        return dict(zip(job.columns, outcome.row, strict=True))

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
            crew = partial(Evaluation, workers=workers, backend=backend, client=client, batch=batch)
            return self._make(journal, keep_every, progress, crew)

    def about(self, job: Job) -> dict[str, Any]:
        """What the sweep is, as plain data."""
        more = {"samples": self.samples, "runs": len(self), "keep_every": job.keep_every}
        return self.study.about(job, **more)

    # -- internals ----------------------------------------------------------------------------------------

    def _make(self, journal: Journal, keep_every: int | None, progress: bool, crew: Evaluator) -> Path:
        """Make the runs that a folder does not have yet; returns the path of the table."""
        job = self.study.job(journal.known(), keep_every)
        journal.begin(self.about(job), self._draws)
        evaluation = crew(job, journal)
        tasks = Drawn(self._draws, range(len(self)))
        with progress_bar(len(tasks), len(journal.rows), progress) as bar, evaluation.open():
            for rows in evaluation.run(tasks):
                bar.update(len(rows))
        table = journal.finish()
        warn_of(evaluation.look_into_doubts(), "sweep", self.study.base.dt)
        return table

    def _task(self, run: int) -> Task:
        """A run and its values."""
        return Drawn(self._draws, range(len(self)))[index("run", run, len(self))]


def _checked_factors(factors: Sequence[Factor]) -> tuple[Factor, ...]:
    for factor in factors:
        instance("factors", factor, Factor, "Factor objects")
    names = [factor.name for factor in factors]
    taken = [name for name in names if names.count(name) > 1 or name in columns(())]
    if taken:
        raise InputError(
            f"the name '{taken[0]}' is taken; give each column a name of its own", subject="factors"
        )
    if not names:
        raise InputError("expected at least one, found none", subject="factors")
    varied = {"Gamma", "Gamma_scale"} & {*names}
    if "adaptation" in names and varied:
        one = "one of both, for an adaptation takes the place of the gain Gamma"
        raise InputError.expected(one, ("adaptation", min(varied)), "factors")
    return tuple(factors)
