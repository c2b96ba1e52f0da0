"""What a single run would warn of, gathered over many: too long a step, and torque that was cut off."""

from __future__ import annotations

from typing import NamedTuple

from ..errors import SaturationWarning, StepWarning, warn
from ..simulation.result import Result
from ..simulation.step_error import LIMIT
from .measures import cut_off


class Doubt(NamedTuple):
    """Why the measures of one run are to be doubted.

    Attributes:
        estimate: error of its worst step, as a share of its largest velocity; None if its step will do.
        advised: a step that does, s, or None.
        share: of the instants at which the torque of a joint was cut off, the largest; 0 if none was.
    """

    estimate: float | None
    advised: float | None
    share: float


def doubt_of(result: Result) -> Doubt:
    """What is to be doubted of a run, by its `info`."""
    step = result.info["step_error"] or {}
    advised = step.get("advised_step")
    return Doubt(None if advised is None else step["estimate"], advised, cut_off(result))


class Doubts:
    """Those of many runs, by number of the run: what is said does not depend on who made them, or when."""

    def __init__(self) -> None:
        self._runs: dict[int, Doubt] = {}

    def add(self, run: int, doubt: Doubt | None) -> None:
        """Take note of a run; None is one that did not go to its end."""
        if doubt is not None:
            self._runs[run] = doubt

    def warn(self, what: str, dt: float) -> None:
        """Warn whoever called the package, once of each kind.

        Args:
            what: made the runs, for the message.
            dt: their step, s.
        """
        self._warn_of_steps(what, dt)
        self._warn_of_saturation(what)

    def _warn_of_steps(self, what: str, dt: float) -> None:
        found = {run: d.estimate for run, d in self._runs.items() if d.estimate is not None}
        if not found:
            return
        worst = _largest(found)
        shortest = min(d.advised for d in self._runs.values() if d.advised is not None)
        warn(
            f"{what}: dt = {dt:g} s is too long in {len(found)} of the {len(self._runs)} runs that were made "
            f"to their end; in run {worst} a step errs by {found[worst]:.2g} of the largest velocity, "
            f"expected at most {LIMIT:g}. Begin again with a step of at most {shortest:g} s",
            StepWarning,
        )

    def _warn_of_saturation(self, what: str) -> None:
        found = {run: d.share for run, d in self._runs.items() if d.share > 0}
        if not found:
            return
        worst = _largest(found)
        warn(
            f"{what}: torque was cut off in {len(found)} of the {len(self._runs)} runs that were made "
            f"to their end, most in run {worst}, at one joint for {found[worst]:.0%} of the time. Estimates "
            "and integrals of the synchronization errors went on meanwhile as if the robots had got it; "
            "lower the gains or their ranges, or ask for a slower motion",
            SaturationWarning,
        )


def _largest(values: dict[int, float]) -> int:
    """The run with the largest value, the first one if there are more."""
    return max(values, key=lambda run: (values[run], -run))
