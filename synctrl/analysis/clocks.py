"""Errors that robots with clocks of their own do not see: each follows its path, but not at the same time."""

from __future__ import annotations

import numpy as np

from ..control.law import compute_weighted_errors
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import experiment_of


def true_sync_error(result: Result, experiment: Experiment | None = None) -> np.ndarray:
    """Synchronization errors by one clock for all, epsilon = S c e with e of the true time, (T, p, m).

    A robot whose clock is ahead by d follows x^d(t + d): when its own error is zero, e is -d x^d' to first
    order, so epsilon goes to -S c d x^d'. Without offsets this is `result.sync_error`.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment for a result loaded from a file.
    """
    cell = experiment_of(result, experiment).cell
    w = [
        compute_weighted_errors(reference.weights, cell.task.measure(motion, reference.desired).error)[0]
        for reference, motion in zip(
            cell.references(result.t), np.stack((result.q, result.v), axis=1), strict=True
        )
    ]
    return cell.coupling.compare(np.array(w))
