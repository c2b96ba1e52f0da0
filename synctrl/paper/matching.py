"""Gain matching: the independent controller that takes as much torque as a synchronized one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import positive_number
from ..control.gains import Gains
from ..errors import InputError
from .trials import Bench

#: gains that an independent controller has
SCALABLE = ("Lambda", "K_r", "Gamma")
#: largest factor tried on the gains
LARGEST_FACTOR = 64.0
#: relative accuracy of the factor
TOLERANCE = 3e-4
#: relative excess of torque that counts as any larger one: runs about to diverge tell the search nothing
MUCH = 10.0


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

    The factor is looked for upwards from 1, in steps of 2, and only if there is none, downwards: where
    several factors give the same peak torque, the baseline gets the one next above the gains it was given.

    Args:
        bench: the task under the synchronized controller.
        target: peak torque to match, N·m.
        scaled: gains that are multiplied by the factor.

    Raises:
        InputError: a gain that cannot be scaled, or no factor between 1/64 and 64 gives this peak torque.
    """
    from scipy.optimize import brentq

    target = positive_number("target", target)
    if not scaled or set(scaled) - set(SCALABLE):
        raise InputError(f"expected some of {', '.join(SCALABLE)}, found {list(scaled)!r}", subject="scaled")
    base, before = bench.experiment.gains.independent(), bench.runs

    def gains(logarithm: float) -> Gains:
        return base.replace(**{name: np.exp(logarithm) * getattr(base, name) for name in scaled})

    def excess(logarithm: float) -> float:
        return min(bench.peak_torque(gains(logarithm)) / target - 1, MUCH)

    low, high = _bracket(excess)
    root = low if low == high else float(brentq(excess, low, high, xtol=TOLERANCE))
    peak = bench.peak_torque(gains(root))
    return Match(gains(root), float(np.exp(root)), tuple(scaled), target, peak, bench.runs - before)


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
        f"expected that a factor between 1/{LARGEST_FACTOR:g} and {LARGEST_FACTOR:g} on them gives "
        "the peak torque of the synchronized controller, found none",
        subject="gains",
    )
