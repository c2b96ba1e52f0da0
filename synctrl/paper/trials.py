"""Trials: one task under many gains, and the independent controller that takes as much torque as another."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from ..analysis.free_gain import LARGEST_FACTOR, factor_for
from ..analysis.metrics import metrics
from ..checks import instance, positive_number
from ..control.gains import Gains
from ..errors import InputError, SimulationError, StepWarning
from ..simulation.result import Result
from ..simulation.simulate import Experiment

#: gains that an independent controller has
SCALABLE = ("Lambda", "K_r", "Gamma")


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
    return Trial(name, peaks[0], rms[0], peaks[1], rms[1], peaks[2], largest_gravity_torque(result), gains)


def largest_gravity_torque(result: Result) -> float:
    """Largest torque that gravity alone asks of a joint along a run, N·m, from up to fifty instants of it."""
    robots, every = result.experiment.cell.robots, max(1, len(result.t) // 50)
    return max(
        float(np.abs(robot.gravity(q)).max())
        for i, robot in enumerate(robots)
        for q in result.q[::every, i, : robot.nv]
    )


@dataclass(frozen=True, eq=False)
class Match:
    """Gains of an independent controller with the peak torque of a synchronized one.

    Attributes:
        gains: of the independent controller.
        factor: by which the gains in `scaled` were multiplied.
        scaled: names of those gains.
        target: peak torque of the synchronized controller, N·m.
        peak_torque: of the independent one, N·m.
        runs: how many runs the search took.
    """

    gains: Gains
    factor: float
    scaled: tuple[str, ...]
    target: float
    peak_torque: float
    runs: int


def match_peak_torque(bench: Bench, target: float, scaled: Sequence[str] = ("Lambda",)) -> Match:
    """The independent controller with a given peak torque: one factor on some gains, found as a root.

    Where several factors give the same peak torque, it is the first that `factor_for` finds.

    Args:
        bench: the task under the synchronized controller.
        target: peak torque to match, N·m.
        scaled: gains that are multiplied by the factor.

    Raises:
        InputError: a gain that cannot be scaled, or no factor between 1/64 and 64 gives this peak torque.
    """
    target = positive_number("target", target)
    if not scaled or set(scaled) - set(SCALABLE):
        raise InputError(
            f"expected some of {', '.join(SCALABLE)}, found {list(scaled)!r}",
            subject="scaled",
            found=list(scaled),
        )
    base, before = bench.experiment.gains.independent(), bench.runs

    def gains(factor: float) -> Gains:
        return base.replace(**{name: factor * getattr(base, name) for name in scaled})

    factor = factor_for(lambda factor: bench.peak_torque(gains(factor)) / target - 1)
    if factor is not None:
        peak = bench.peak_torque(gains(factor))
        return Match(gains(factor), factor, tuple(scaled), target, peak, bench.runs - before)
    raise InputError(
        f"expected that a factor between 1/{LARGEST_FACTOR:g} and {LARGEST_FACTOR:g} on them gives "
        "the peak torque of the synchronized controller, found none",
        subject="gains",
    )
