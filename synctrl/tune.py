"""Tune: values of factors, such as gains, that make a measure as small as possible under a torque limit.

A run that exceeds the torque limit counts as worse than every run that does not, and one that stops as worse
still; among them the smaller excess and the later end are better. The same seed gives the same search,
whatever the number of workers.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from .checks import choice, count, instance, positive_number
from .control.gains import Gains
from .errors import InputError, SweepError
from .simulation.simulate import Experiment
from .sweep.distributions import LogUniform, Uniform
from .sweep.evaluation import Evaluation, Evaluator, progress_bar
from .sweep.factors import Factor, gain
from .sweep.journal import Journal
from .sweep.measures import MEASURES, torque_unit, warn_of
from .sweep.rows import COMPLETED, Generations, columns
from .sweep.sweep import Study, StudyOptions
from .sweep.worker import Task

Range = Uniform | LogUniform


@dataclass(frozen=True, eq=False, repr=False)
class Tuned:
    """What tuning has found.

    Attributes:
        values: the best value of each factor.
        experiment: the experiment with them.
        measures: the measures of its run, under the names of a sweep's table.
        history: every run that was made, in order, as a row of a sweep's table.
    """

    values: dict[str, float]
    experiment: Experiment
    measures: dict[str, float | None]
    history: list[dict[str, Any]]

    @property
    def gains(self) -> Gains:
        """The gains of the best run."""
        return self.experiment.gains

    def __repr__(self) -> str:
        values, measured = (
            ", ".join(f"{name} = {value:.4g}" for name, value in numbers.items() if value is not None)
            for numbers in (self.values, self.measures)
        )
        return f"Tuned: the best of {len(self.history)} runs\n  values: {values}\n  measures: {measured}"


def tune(
    experiment: Experiment,
    search: Mapping[str, Range] | Sequence[Factor],
    *,
    minimize: str = "sync_rms",
    torque_limit: float | None = None,
    generations: int = 20,
    population: int = 24,
    folder: str | Path | None = None,
    progress: bool = True,
    workers: int = 2,
    backend: str = "joblib",
    client: Any = None,
    **options: Unpack[StudyOptions],
) -> Tuned:
    """Search by differential evolution, a generation of runs at a time.

    Args:
        experiment: where to start: everything that is not searched stays as it is.
        search: ranges of gains by name, `{"beta": LogUniform(1, 1000)}`, or factors of a sweep; each with
            `Uniform` or `LogUniform` values.
        minimize: one of the measures of a sweep's table.
        torque_limit: largest |tau| allowed on any joint, N·m, and N of joints that slide.
        generations: how often the population is renewed.
        population: runs per generation, at least 5.
        folder: write every run there, and read runs made there before instead of making them again.
        progress, workers, backend, client: see `Sweep.run`, also for errors and warnings.
        options: `seed`, `duration`, `dt`, `engine`, `control_period` and `bands`, see `Study`.

    Raises:
        InputError: a value of the wrong kind.
        SweepError: no run stayed within the torque limit, ran to its end and has the measure.
    """
    finder = _Search(Study(experiment, _factors(search), **options), minimize, torque_limit, population)
    crew = partial(Evaluation, workers=workers, backend=backend, client=client)
    return finder.find(count("generations", generations), folder, progress, crew)


class _Search:
    """Differential evolution over the unit cube, whose edges are the ranges of the factors."""

    def __init__(self, study: Study, minimize: str, torque_limit: float | None, population: int):
        self.study, self.minimize = study, choice("minimize", minimize, MEASURES)
        self.limit = np.inf if torque_limit is None else positive_number("torque_limit", torque_limit)
        self.population = count("population", population, least=5)
        self.columns = columns(factor.name for factor in study.factors)
        self.runs = Generations({factor.name: factor.values for factor in study.factors}, self.population)
        self.history: list[dict[str, Any]] = []

    def find(self, generations: int, folder: str | Path | None, progress: bool, crew: Evaluator) -> Tuned:
        """Make all runs, in a folder if there is one, and return the best; more generations may follow."""
        limit = self.limit if np.isfinite(self.limit) else None
        search = {"minimize": self.minimize, "torque_limit": limit, "population": self.population}
        with contextlib.ExitStack() as stack:
            journal = None if folder is None else stack.enter_context(Journal(folder))
            job = self.study.job(None if journal is None else journal.known())
            if journal is not None:
                journal.begin(self.study.about(job, search=search), self.runs)
            evaluation = crew(job, journal)
            stack.enter_context(evaluation.open())
            runs = self.population * (1 + generations)
            bar = stack.enter_context(progress_bar(runs, 0, progress))
            self.run(generations, evaluation, bar)
            if journal is not None:
                journal.finish()
        warn_of(evaluation.doubts, "tune", self.study.base.dt)
        return self.best()

    def run(self, generations: int, evaluation: Evaluation, bar: Any) -> None:
        """Make the runs of the first population and of all further ones."""
        from scipy.optimize import differential_evolution

        def costs(shares: np.ndarray) -> np.ndarray:
            rows = self._generation(shares.T, evaluation, bar)
            return np.array([self.cost(row) for row in rows])

        rng = np.random.default_rng(self.study.seed)
        differential_evolution(
            costs,
            [(0.0, 1.0)] * len(self.study.factors),
            init=_spread(rng, self.population, len(self.study.factors)),
            maxiter=generations,
            tol=0,
            polish=False,
            updating="deferred",
            vectorized=True,
            rng=rng,
        )

    def cost(self, row: Mapping[str, Any]) -> float:
        """What is compared: up to 1 within the torque limit, from there to 2 outside, to 3 if the run stops.

        It is 1 for a run within the limit that has no such measure, because it never settles, for example.
        Differential evolution only asks which of two is smaller, so that any increasing function will do.
        """
        value, torque = row[self.minimize], row["peak_torque"]
        if row["status"] != COMPLETED or torque is None:
            return 3 - (row["stop_time"] or 0.0) / self.study.base.duration
        if torque > self.limit:
            return 2 - self.limit / torque
        return 1.0 if value is None else value / (1 + value)

    def best(self) -> Tuned:
        """The best run of all.

        Raises:
            SweepError: none was within the limit, ran to its end and has the measure.
        """
        best = min(self.history, key=self.cost)
        if self.cost(best) >= 1:
            unit = torque_unit(self.study.base.experiment.cell)
            torque = min((x for row in self.history if (x := row["peak_torque"]) is not None), default=None)
            least = f"the smallest peak torque was {torque:.4g} {unit}" if torque else "all runs stopped"
            raise SweepError(
                f"none of {len(self.history)} runs stayed within a torque of {self.limit:g} {unit} to its "
                f"end and has a {self.minimize}; {least}; search other ranges, or allow more torque",
                subject="search" if torque is None else "torque_limit" if torque > self.limit else "minimize",
                found=torque,
            )
        values = {factor.name: best[factor.name] for factor in self.study.factors}
        experiment = self.study.base.experiment
        for factor in self.study.factors:
            experiment = factor.change(experiment, values[factor.name])
        return Tuned(values, experiment, {name: best[name] for name in MEASURES}, self.history)

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
    return factors


def _spread(rng: np.random.Generator, count: int, dimensions: int) -> np.ndarray:
    """Points of a Latin hypercube, (count, dimensions): every axis is covered evenly."""
    columns = [rng.permutation(count) for _ in range(dimensions)]
    return (np.stack(columns, axis=1) + rng.random((count, dimensions))) / count
