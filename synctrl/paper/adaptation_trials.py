"""Adaptations side by side on one task: errors, torque, what was learned, and possible bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import process_time
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..analysis.consistency import physical_consistency
from ..control.adaptation import Adaptation
from ..coupling.cell import Cell
from ..errors import InputError, StepWarning
from ..simulation.result import Result
from ..simulation.simulate import Experiment

#: of the states at which the torque of the estimates is looked at: how many, and how far around the start
STATES, SPREAD = 60, (0.5, 1.0, 2.0)  # rad, rad/s, rad/s^2
#: share of the run that counts as late
LATE = 0.25


@dataclass(frozen=True)
class AdaptationTrial:
    """One adaptation on one task.

    Attributes:
        name: of the adaptation.
        tracking_peak, tracking_late: largest |e|, of the run and of its last quarter.
        sync_peak: largest |epsilon|.
        peak_torque: N·m.
        torque_error: of the estimates at the end, relative, over random states.
        bodies: whether the estimates were those of bodies that can exist, in words: "yes", "until 0.5 s", or
            "none" where what is adapted are not the parameters of bodies.
        cost: processor time of a step, s, with the engine that made the run.
    """

    name: str
    tracking_peak: float
    tracking_late: float
    sync_peak: float
    peak_torque: float
    torque_error: float
    bodies: str
    cost: float


def try_adaptations(
    experiment: Experiment, adaptations: Mapping[str, Adaptation], **options: Any
) -> list[AdaptationTrial]:
    """One trial for each adaptation; `options` are those of `Experiment.simulate`.

    Each runs twice, and the second run is timed: the first may have to compile.
    """
    return [
        _trial(name, _learning(experiment, adaptation), options) for name, adaptation in adaptations.items()
    ]


def torque_error(cell: Cell, theta_hat: np.ndarray) -> float:
    """How far the torque of estimates, (n, P), is from that of theta, relative, over random states."""
    rng, off, true = np.random.default_rng(0), [], []
    for i, parameters in enumerate(cell.parameters):
        nv, theta = cell.robots[i].nv, parameters.theta
        for _ in range(STATES // cell.n):
            q, v, a = (width * rng.uniform(-1, 1, nv) for width in SPREAD)
            q += cell.q0[i, :nv]
            Y = parameters.regressor(q, v, v, a)
            off.append(Y @ (theta_hat[i, : len(theta)] - theta))
            true.append(Y @ theta)
    return float(np.linalg.norm(off) / np.linalg.norm(true))


def _bodies(run: Result) -> str:
    """Whether the estimates of a run are those of bodies, in words."""
    try:
        until = physical_consistency(run).until
    except InputError:  # maps such as (50)
        return "none"
    return "yes" if until is None else f"until {until:.3g} s"


def _learning(experiment: Experiment, adaptation: Adaptation) -> Experiment:
    return replace(experiment, adaptation=adaptation, gains=experiment.gains.replace(Gamma=None))


def timed(experiment: Experiment, options: dict[str, Any]) -> tuple[Result, float]:
    """A run, and the processor time of one of its steps, s; it is made twice, for the first may compile."""
    with catch_warnings():
        simplefilter("ignore", StepWarning)
        experiment.simulate(**options)
        start = process_time()
        run: Result = experiment.simulate(**options)
    return run, (process_time() - start) / (len(run.t) - 1)


def _trial(name: str, experiment: Experiment, options: dict[str, Any]) -> AdaptationTrial:
    run, cost = timed(experiment, options)
    e, late = np.abs(run.tracking_error), run.t >= (1 - LATE) * run.t[-1]
    return AdaptationTrial(
        name,
        float(e.max()),
        float(e[late].max()),
        float(np.abs(run.sync_error).max()),
        float(np.abs(run.tau).max()),
        torque_error(experiment.cell, run.theta_hat[-1]),
        _bodies(run),
        cost,
    )
