"""Trials: one task under many gains, each run once and kept as a few numbers."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..analysis.metrics import metrics
from ..checks import instance
from ..control.gains import Gains
from ..errors import SimulationError, StepWarning
from ..simulation.result import Result
from ..simulation.simulate import Experiment


@dataclass(frozen=True)
class Trial:
    """One controller on one task, in numbers over all robots and axes.

    Attributes:
        name: what is different about the controller.
        tracking_peak, tracking_rms: of e, rad or m.
        sync_peak, sync_rms: of epsilon, in the unit of c e.
        peak_torque: of any joint, N·m.
        gravity_torque: largest torque that gravity alone asks for along the run, N·m.
        gains: as plain lists.
    """

    name: str
    tracking_peak: float
    tracking_rms: float
    sync_peak: float
    sync_rms: float
    peak_torque: float
    gravity_torque: float
    gains: dict[str, Any]


class Bench:
    """Runs one experiment under different gains; gains that were tried before are not run again.

    Args:
        experiment: the task.
        options: for `Experiment.simulate`.

    Attributes:
        runs: how many runs there were.
    """

    def __init__(self, experiment: Experiment, options: dict[str, Any]):
        instance("experiment", experiment, Experiment, "an Experiment")
        self.experiment, self.options, self.runs = experiment, options, 0
        self._known: dict[str, Trial | SimulationError] = {}

    def trial(self, name: str, gains: Gains) -> Trial:
        """The task under these gains.

        Raises:
            SimulationError: the run had to stop.
        """
        key = json.dumps(gains.as_dict())
        if key not in self._known:
            self._known[key] = self._run(gains)
        found = self._known[key]
        if isinstance(found, SimulationError):
            raise found
        return replace(found, name=name)

    def peak_torque(self, gains: Gains) -> float:
        """Peak torque; gains under which the run has to stop count as ten times what it took until then."""
        try:
            return self.trial("", gains).peak_torque
        except SimulationError as error:
            tau = error.result.tau if error.result is not None else np.zeros(0)
            return 10 * float(np.nan_to_num(np.abs(tau), nan=0.0, posinf=0.0).max(initial=1e3))

    def _run(self, gains: Gains) -> Trial | SimulationError:
        """A trial of gains; those for which the step is too long are part of a search, and no news."""
        self.runs += 1
        try:
            with catch_warnings():
                simplefilter("ignore", StepWarning)
                return measure("", replace(self.experiment, gains=gains).simulate(**self.options))
        except SimulationError as error:
            return error


def measure(name: str, result: Result) -> Trial:
    """A run that was just made, in numbers."""
    found = metrics(result)
    e, epsilon = found.tracking_error, found.sync_error
    rms = [float(np.sqrt(np.square(error.rms).mean())) for error in (e, epsilon)]
    peaks = [float(array.max()) for array in (e.peak, epsilon.peak, found.peak_torque)]
    gains = dict(result.info["gains"])
    return Trial(name, peaks[0], rms[0], peaks[1], rms[1], peaks[2], gravity_torque(result), gains)


def gravity_torque(result: Result) -> float:
    """Largest torque that gravity alone asks of a joint along a run, N·m, from up to fifty instants of it."""
    robots, every = result.experiment.cell.robots, max(1, len(result.t) // 50)
    return max(
        float(np.abs(robot.gravity(q)).max())
        for i, robot in enumerate(robots)
        for q in result.q[::every, i, : robot.nv]
    )
