"""Fair comparisons: what else the same torque could have bought, and what each part of the law contributes.

The paper compares with beta = K_eps = 0 and everything else unchanged: the synchronized controller then has
more gain. Beside it stand here an independent controller with Lambda + beta for Lambda, and one whose gains
are multiplied by a common factor until its peak torque is that of the synchronized one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulation.simulate import Experiment
from .trials import Bench, Match, Trial, match_peak_torque

PARTS = ("beta", "K_eps", "Gamma")
_SYMBOLS = {"beta": "β", "K_eps": "K_ε", "Gamma": "adaptation", "Lambda": "Λ", "K_r": "K_r"}


@dataclass(frozen=True, eq=False)
class Comparison:
    """Trials of one task, and what they say.

    Attributes:
        title: of the task.
        duration: how long the runs took, s.
        trials: synchronized, independent as in the paper, with Lambda + beta, and with matched peak torque.
        ablation: the parts of the law switched on alone and together.
        match: how the gains were matched.
        units: of e and epsilon.
    """

    title: str
    duration: float
    trials: tuple[Trial, ...]
    ablation: tuple[Trial, ...]
    match: Match
    units: tuple[str, str]

    def findings(self) -> list[str]:
        """What the numbers say, a sentence each."""
        return [*_against_independent(self), _about_torque(self), *_about_parts(self)]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        match = self.match
        return {
            "title": self.title,
            "duration": self.duration,
            "trials": [asdict(trial) for trial in self.trials],
            "ablation": [asdict(trial) for trial in self.ablation],
            "matched": {"factor": match.factor, "scaled": list(match.scaled), "runs": match.runs},
            "units": list(self.units),
            "findings": self.findings(),
        }


def ablation(bench: Bench) -> tuple[Trial, ...]:
    """What beta, K_eps and the adaptation contribute: each alone, all without each, and all together."""
    kept = [(), *((p,) for p in PARTS), *(tuple(p for p in PARTS if p != q) for q in reversed(PARTS)), PARTS]
    gains = bench.experiment.gains
    return tuple(
        bench.trial(
            " + ".join(_SYMBOLS[name] for name in names) or "none of them",
            gains.replace(**{name: 0 * getattr(gains, name) for name in PARTS if name not in names}),
        )
        for names in kept
    )


def compare(experiment: Experiment, scaled: Sequence[str] = ("Lambda",), **options: Any) -> Comparison:
    """The synchronized controller beside independent ones, and part by part.

    Args:
        experiment: the cell under the synchronized controller.
        scaled: gains of the matched controller that are multiplied by a common factor.
        options: for `Experiment.simulate`; a shorter `duration` compares, and matches, over that time.

    Raises:
        InputError: the gains do not synchronize, are unknown, or no factor matches the peak torque.
    """
    bench = Bench(experiment, options)
    gains, independent = experiment.gains, experiment.gains.independent()
    if not (gains.beta.any() or gains.K_eps.any()):
        raise InputError("expected a synchronized controller, found beta = K_eps = 0", subject="experiment")
    ours = bench.trial("synchronized", gains)
    match = match_peak_torque(bench, ours.peak_torque, scaled)
    matched = f"independent, {' and '.join(_SYMBOLS[name] for name in scaled)} times {match.factor:.3g}"
    trials = (
        ours,
        bench.trial("independent", independent),
        bench.trial("independent, Λ + β for Λ", independent.replace(Lambda=gains.Lambda + gains.beta)),
        bench.trial(matched, match.gains),
    )
    units = experiment.cell.unit, experiment.cell.weighted_unit
    duration = float(options.get("duration") or experiment.duration)
    return Comparison(
        experiment.title or experiment.cell.name, duration, trials, ablation(bench), match, units
    )


# -- in words ---------------------------------------------------------------------------------------------


def _against_independent(c: Comparison) -> list[str]:
    ours = c.trials[0]
    return [
        f"Against '{other.name}', synchronized control has an RMS synchronization error that is "
        f"{_times(other.sync_rms, ours.sync_rms)} and an RMS tracking error that is "
        f"{_times(other.tracking_rms, ours.tracking_rms)}, at {ours.peak_torque:.4g} against "
        f"{other.peak_torque:.4g} N·m of peak torque."
        for other in c.trials[1:]
    ]


def _about_torque(c: Comparison) -> str:
    share = c.trials[0].gravity_torque / c.trials[0].peak_torque
    factors = f"{' and '.join(_SYMBOLS[name] for name in c.match.scaled)} by {c.match.factor:.3g}"
    if share > 0.5:
        return (
            f"Multiplying {factors} matches the peak torque, but here that means little: gravity alone takes "
            f"{share:.0%} of it, so peak torque hardly tells gentle from stiff control."
        )
    return f"Multiplying {factors} matches the peak torque, of which gravity takes {share:.0%}."


def _about_parts(c: Comparison) -> list[str]:
    """What each part does alone, compared with none of them, by RMS."""
    nothing, *alone = c.ablation[: 1 + len(PARTS)]
    return [
        f"Alone, {part.name} makes the RMS synchronization error {_change(part.sync_rms, nothing.sync_rms)} "
        f"and the RMS tracking error {_change(part.tracking_rms, nothing.tracking_rms)}."
        for part in alone
    ]


def _times(other: float, ours: float) -> str:
    """Ours compared with the other, as '3.2 times smaller' or '1.4 times larger'."""
    if other == 0 or abs(ours / other - 1) < 0.02:
        return "the same within 2 %" if other else f"{ours:.3g} instead of 0"
    ratio = other / ours if ours else np.inf
    return f"{ratio:.3g} times smaller" if ratio > 1 else f"{1 / ratio:.3g} times larger"


def _change(now: float, before: float) -> str:
    """Now compared with before, in percent."""
    if before == 0:
        return f"{now:.3g} instead of 0"
    return f"{abs(now / before - 1):.1%} {'smaller' if now <= before else 'larger'}"
