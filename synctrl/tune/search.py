"""The search: runs of a study, a generation at a time, made or read, and what is found among them."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from ..checks import count, instance
from ..errors import InputError, SweepError
from ..simulation.simulate import Experiment
from ..sweep.distributions import LogUniform, Uniform
from ..sweep.evaluation import Evaluation, Evaluator, progress_bar
from ..sweep.factors import Factor, gain
from ..sweep.further import FURTHER
from ..sweep.journal import Journal
from ..sweep.measures import MEASURES, definitions, warn_of
from ..sweep.rows import COMPLETED, Generations, columns
from ..sweep.sweep import Study, StudyOptions
from ..sweep.tasks import Job, Task
from .asking import for_one, for_several, need_optuna, spread
from .goals import TORQUE, Goal, Judge, read_goals, read_limits
from .tuned import FRONT, Tuned

Range = Uniform | LogUniform


def tune(
    experiment: Experiment,
    search: Mapping[str, Range] | Sequence[Factor],
    *,
    minimize: str | Sequence[str] = "sync_rms",
    maximize: str | Sequence[str] = (),
    torque_limit: float | None = None,
    limits: Mapping[str, float] | None = None,
    generations: int = 20,
    population: int = 24,
    folder: str | Path | None = None,
    progress: bool = True,
    workers: int = 2,
    backend: str = "joblib",
    client: Any = None,
    **options: Unpack[StudyOptions],
) -> Tuned:
    """Search for the best run, or for the front of several goals, a generation of runs at a time.

    Args:
        experiment: where to start: everything that is not searched stays as it is.
        search: ranges of gains, `{"beta": LogUniform(1, 1000)}`, or factors with such values.
        minimize, maximize: measures of a sweep's table; "delay_margin" may be maximized too.
        torque_limit: largest |tau| allowed on any joint, N·m, and N of joints that slide.
        limits: the largest values allowed of measures, by name, such as {"saturation": 0}.
        generations, population: how often the population is renewed, and its size, at least 5.
        folder: write every run there, and read runs made there before instead of making them again.
        progress, workers, backend, client: see `Sweep.run`, also for errors and warnings.
        options: `seed`, `duration`, `dt`, `engine`, `control_period`, `bands` and `measures`, see `Study`.

    Raises:
        InputError: a value of the wrong kind.
        SweepError: no run kept the limits, ran to its end and has all measures.
        MissingDependencyError: several goals need Optuna.
    """
    goals, most = read_goals(minimize, maximize), read_limits(limits, torque_limit)
    finder = _Search(Study(experiment, _factors(search), **options), goals, most, population)
    crew = partial(Evaluation, workers=workers, backend=backend, client=client)
    return finder.find(count("generations", generations), folder, progress, crew)


class _Search:
    """A search over the unit cube, whose edges are the ranges of the factors.

    Args:
        study: what all runs share.
        goals, limits: see `Judge`.
        population: runs per generation.
    """

    def __init__(self, study: Study, goals: tuple[Goal, ...], limits: Mapping[str, float], population: int):
        self.study, self.judge = study, Judge(goals, limits, study.base.duration)
        self.population = count("population", population, least=5)
        self.further = tuple(goal.name for goal in goals if goal.name in FURTHER)
        for name in self.further:
            FURTHER[name].find(study.base)  # refuses an experiment that has none
        self.several = len(goals) > 1
        self.optuna = need_optuna().__version__ if self.several else None
        self.own = {own.name: own.measure for own in study.measures}
        self.names = (*MEASURES, *self.further, *self.own)
        self.columns = columns((factor.name for factor in study.factors), self.names)
        self.runs = Generations({factor.name: factor.values for factor in study.factors}, self.population)
        self.history: list[dict[str, Any]] = []

    def find(self, generations: int, folder: str | Path | None, progress: bool, crew: Evaluator) -> Tuned:
        """Make all runs, in a folder if there is one, and return the best; more generations may follow."""
        with contextlib.ExitStack() as stack:
            journal = None if folder is None else stack.enter_context(Journal(folder))
            job = self.study.job(None if journal is None else journal.known())
            job = job._replace(further=self.further)
            if journal is not None:
                journal.begin(self.about(job), self.runs)
            evaluation = crew(job, journal)
            stack.enter_context(evaluation.open())
            runs = self.population * (1 + generations)
            bar = stack.enter_context(progress_bar(runs, 0, progress))
            self.run(generations, evaluation, bar)
            if journal is not None:
                journal.finish()
            found = self.found()
            if journal is not None:
                found.save_front(journal.folder / FRONT)
        warn_of(evaluation.look_into_doubts(), "tune", self.study.base.dt)
        return found

    def about(self, job: Job) -> dict[str, Any]:
        """What the search is, as plain data."""
        search = {
            "minimize": [goal.name for goal in self.judge.goals if not goal.larger],
            "maximize": [goal.name for goal in self.judge.goals if goal.larger],
            "further": [*self.further],
            "limits": {**self.judge.limits},
            "population": self.population,
            "method": f"NSGA-II, Optuna {self.optuna}" if self.several else "differential evolution",
        }
        return self.study.about(job, search=search)

    def run(self, generations: int, evaluation: Evaluation, bar: Any) -> None:
        """Make the runs of the first population and of all further ones."""

        def tell(shares: np.ndarray) -> np.ndarray:
            return np.array([self.judge.told(row) for row in self._generation(shares, evaluation, bar)])

        rng = np.random.default_rng(self.study.seed)
        start = spread(rng, self.population, len(self.study.factors))
        if self.several:
            for_several(tell, start, generations, len(self.judge.goals), rng)
        else:
            for_one(tell, start, generations, rng)

    def found(self) -> Tuned:
        """The front of all runs.

        Raises:
            SweepError: there is none.
        """
        front = self.judge.front(self.history)
        if not front:
            raise self._nothing()
        experiment = self.study.base.experiment
        measured = definitions(experiment.cell) | {name: FURTHER[name].measure for name in self.further}
        measured = {name: (measured | self.own)[name] for name in self.names}
        whole = Tuned(
            self.judge, self.history, front, front[0]["run"], measured, experiment, self.study.factors
        )
        return whole.best()

    def _nothing(self) -> SweepError:
        """Why no run counts."""
        ended = [row for row in self.history if row["status"] == COMPLETED]
        none, advice = f"none of {len(self.history)} runs", "search other ranges"
        if not ended:
            return SweepError(f"{none} went to its end; {advice}", subject="search")
        units = definitions(self.study.base.experiment.cell)
        for name, limit in self.judge.limits.items():
            least = min((row[name] for row in ended if row[name] is not None), default=None)
            if least is None or least > limit:
                found = "had one" if least is None else f"had less than {least:.4g}"
                return SweepError(
                    f"{none} kept {name} within {limit:g} {units[name].unit} to its end, and none {found}; "
                    f"{advice}, or allow more",
                    subject="torque_limit" if name == TORQUE else f"limits, {name}",
                    found=least,
                )
        names = ", ".join(goal.name for goal in self.judge.goals)
        subject = "maximize" if self.judge.goals[0].larger else "minimize"
        return SweepError(f"{none} kept all limits to its end and has {names}; {advice}", subject=subject)

    def _generation(self, shares: np.ndarray, evaluation: Evaluation, bar: Any) -> list[dict[str, Any]]:
        ranges: list[Any] = [factor.values for factor in self.study.factors]
        values = [tuple(x.at(float(s)) for x, s in zip(ranges, share, strict=True)) for share in shares]
        tasks = [Task(run, each) for run, each in enumerate(values, start=len(self.history))]
        for _ in evaluation.run(tasks):
            pass
        bar.update(len(tasks))
        rows = [dict(zip(self.columns, evaluation.rows[task.run], strict=True)) for task in tasks]
        self.history += rows
        return rows


def _factors(search: Mapping[str, Range] | Sequence[Factor]) -> list[Factor]:
    factors = [gain(*pair) for pair in search.items()] if isinstance(search, Mapping) else list(search)
    for factor in factors:
        instance("search", factor, Factor, "ranges of gains by name, or Factor objects")
        instance(f"search, {factor.name}", factor.values, (Uniform, LogUniform), "Uniform or LogUniform")
        if type(factor) is not Factor:
            raise InputError(f"'{factor.name}' belongs to the run and cannot be searched", subject="search")
        if factor.name in FURTHER:
            raise InputError(f"the name '{factor.name}' is taken", subject="search")
    return factors
