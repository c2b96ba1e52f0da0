"""Gain matching: the independent controller that takes as much torque as a synchronized one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import instance, positive_number
from ..errors import InputError, SimulationError
from ..simulation.result import Result
from ..simulation.simulate import Experiment

#: largest factor tried on the gains
LARGEST_FACTOR = 64.0
#: relative accuracy of the factor
TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Match:
    """An independent controller with the peak torque of a synchronized one.

    Attributes:
        experiment: the cell under the independent controller.
        factor: by which the gains in `scaled` were multiplied.
        scaled: names of those gains.
        target: peak torque of the synchronized controller, N·m.
        peak_torque: of the independent one, N·m.
        runs: how many runs the search took.
    """

    experiment: Experiment
    factor: float
    scaled: tuple[str, ...]
    target: float
    peak_torque: float
    runs: int


def peak_torque(result: Result) -> float:
    """Largest torque of the controller on any joint, N·m."""
    return float(np.abs(result.tau).max())


def match_peak_torque(
    experiment: Experiment, scaled: Sequence[str] = ("Lambda",), target: float | None = None, **options: Any
) -> Match:
    """The independent controller with the same peak torque: one factor on some gains, found as a root.

    The factor is looked for upwards from 1, in steps of 2, and only if there is none, downwards: where
    several factors give the same peak torque, the baseline gets the one next above the gains it was given.

    Args:
        experiment: the cell under the synchronized controller.
        scaled: gains that are multiplied by the factor.
        target: peak torque to match, N·m; by default what a run of `experiment` takes.
        options: for `Experiment.simulate`.

    Raises:
        InputError: a gain that cannot be scaled, or no factor between 1/64 and 64 gives this peak torque.
    """
    from scipy.optimize import brentq

    instance("experiment", experiment, Experiment, "an Experiment")
    if not scaled or set(scaled) - {"Lambda", "K_r", "Gamma"}:
        raise InputError(f"scaled: expected some of Lambda, K_r, Gamma, found {list(scaled)!r}")
    target = (
        peak_torque(experiment.simulate(**options)) if target is None else positive_number("target", target)
    )
    base, tried = experiment.gains.independent(), {}

    def candidate(factor: float) -> Experiment:
        gains = base.replace(**{name: factor * getattr(base, name) for name in scaled})
        return replace(experiment, gains=gains, title=f"{experiment.cell.name}, independent, matched")

    def excess(logarithm: float) -> float:
        if logarithm not in tried:
            tried[logarithm] = _peak(candidate(np.exp(logarithm)), options) / target - 1
        return tried[logarithm]

    low, high = _bracket(excess)
    root = low if low == high else float(brentq(excess, low, high, xtol=TOLERANCE))
    peak = (1 + excess(root)) * target
    factor = float(np.exp(root))
    return Match(candidate(factor), factor, tuple(scaled), target, float(peak), len(tried))


# -- the search -------------------------------------------------------------------------------------------


def _bracket(excess: Callable[[float], float]) -> tuple[float, float]:
    """Two logarithms of the factor between which the peak torque passes the target."""
    if excess(0.0) == 0.0:
        return 0.0, 0.0
    step = float(np.log(2.0))
    for direction in (1, -1):
        near = 0.0
        while abs(near) < np.log(LARGEST_FACTOR) - 1e-9:
            far = near + direction * step
            if excess(near) * excess(far) <= 0:
                return min(near, far), max(near, far)
            near = far
    raise InputError(
        f"gains: expected that a factor between 1/{LARGEST_FACTOR:g} and {LARGEST_FACTOR:g} on them gives "
        "the peak torque of the synchronized controller, found none"
    )


def _peak(experiment: Experiment, options: dict[str, Any]) -> float:
    """Peak torque of a run; gains under which it has to stop count as ten times what it took until then."""
    try:
        return peak_torque(experiment.simulate(**options))
    except SimulationError as error:
        tau = error.result.tau if error.result is not None else np.zeros(0)
        return 10 * float(np.nan_to_num(np.abs(tau), nan=0.0, posinf=0.0).max(initial=1e3))
