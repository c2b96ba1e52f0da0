"""Who asks for the next runs: one who looks for the best of one goal, and one for the front of several.

Both search the unit cube, whose edges are the ranges of the factors, a generation of points at a time. What
they ask for depends on the seed and on what they were told, and on nothing else: a search is taken up again
by asking once more from the start and telling what is known.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..errors import MissingDependencyError

#: points, (points, factors) -> what is to be small there, (points, goals)
Tell = Callable[[np.ndarray], np.ndarray]


def for_one(tell: Tell, start: np.ndarray, generations: int, rng: np.random.Generator) -> None:
    """SciPy's differential evolution.

    Args:
        tell: makes runs.
        start: the first generation, (population, factors).
        generations: how often it is renewed.
        rng: random numbers.
    """
    from scipy.optimize import differential_evolution

    differential_evolution(
        lambda shares: tell(shares.T)[:, 0],
        [(0.0, 1.0)] * start.shape[1],
        init=start,
        maxiter=generations,
        tol=0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=rng,
    )


def for_several(
    tell: Tell, start: np.ndarray, generations: int, goals: int, rng: np.random.Generator
) -> None:
    """Optuna's NSGA-II, with operators for numbers: a child is in a box around its parents, or near one.

    Args:
        tell, start, generations, rng: see `for_one`.
        goals: how many.

    Raises:
        MissingDependencyError: Optuna is not installed.
    """
    optuna = need_optuna()
    population, dimensions = start.shape
    operators = optuna.samplers.nsgaii
    names = [f"factor {k}" for k in range(dimensions)]
    ranges = {name: optuna.distributions.FloatDistribution(0.0, 1.0) for name in names}
    with _quiet(optuna):
        sampler = optuna.samplers.NSGAIISampler(
            population_size=population,
            crossover=operators.BLXAlphaCrossover(),
            mutation=operators.PolynomialMutation(),
            seed=int(rng.integers(2**32)),
        )
        study = optuna.create_study(directions=["minimize"] * goals, sampler=sampler)
    for point in start.tolist():
        study.enqueue_trial(dict(zip(names, point, strict=True)))
    for _ in range(1 + generations):
        trials = [study.ask(ranges) for _ in range(population)]
        points = np.array([[trial.params[name] for name in names] for trial in trials])
        for trial, values in zip(trials, tell(points).tolist(), strict=True):
            study.tell(trial, values)


def need_optuna() -> Any:
    """Optuna.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of its progress bar, in notebooks that have no widgets
            import optuna
    except ImportError as error:
        raise MissingDependencyError(
            "searching for several goals needs Optuna: pip install 'synctrl[tune]'", subject="optuna"
        ) from error
    return optuna


@contextlib.contextmanager
def _quiet(optuna: Any) -> Iterator[None]:
    """Without Optuna's words that a study has begun, and that the interface of an operator may change."""
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)


def spread(rng: np.random.Generator, count: int, dimensions: int) -> np.ndarray:
    """Points of a Latin hypercube, (count, dimensions): every axis is covered evenly."""
    columns = [rng.permutation(count) for _ in range(dimensions)]
    return (np.stack(columns, axis=1) + rng.random((count, dimensions))) / count
