"""Claims on the two A460 arms, section V-A."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..simulation.result import Result
from .claims import (
    CONVERGED,
    MUCH,
    REACHED,
    Claim,
    Finding,
    common,
    errors_converge,
    kind,
    late,
    left,
    need,
    sync_error_is_much_smaller,
    worst,
)


def arms_reach_their_targets(run: Result) -> Claim:
    """Every joint ends within `REACHED` of the way it travels."""
    way = np.abs(run.x_desired[-1] - run.x_desired[0])
    share = np.abs(run.tracking_error[-1]) / way
    row, joint = worst(share)
    return Claim(
        f"Both arms reach their targets with small residual offsets ({kind(run)} control).",
        f"section V-A, {'Figs. 2 and 3' if kind(run) == 'synchronized' else 'Figs. 5 and 6'}",
        bool(share.max() <= REACHED),
        (
            Finding("largest final error", np.abs(run.tracking_error[-1]).max(), run.unit("tracking_error")),
            Finding("largest share of the way that is left", share.max()),
        ),
        f"Asked: on every joint at most {REACHED:.0%} of the desired way left after {run.t[-1]:g} s. Largest "
        f"share: {run.names[row]}, {run.info['axes'][joint]}.",
    )


def offsets_are_due_to_friction(run: Result, frictionless: Result) -> Claim:
    """The offset that friction leaves is much smaller, at the same time, in a plant without friction."""
    t = common(run, frictionless)[0]
    ours, theirs = (late(r.tracking_error[: len(t)]).max() for r in (run, frictionless))
    unit = run.unit("tracking_error")
    return Claim(
        "The residual offsets of the joints are due to friction.",
        "section V-A",
        bool(theirs * MUCH <= ours),
        (Finding("largest late error with friction", ours, unit), Finding("without", theirs, unit)),
        "Friction is in the plant and not in the regressor Y. Asked: the same cell without friction has, "
        f"over the last tenth of the first {t[-1]:g} s, a tracking error smaller by a factor of at least "
        f"{MUCH:g}.",
    )


def offsets_are_due_to_gravity(frictionless: Result) -> Claim:
    """Gravity alone would leave an offset: an error that does not converge without friction."""
    remaining = left(frictionless.tracking_error)
    return Claim(
        "The residual offsets of the joints are due to gravity.",
        "section V-A",
        bool(remaining > CONVERGED),
        (
            Finding("late error / peak, gravity without friction", remaining),
            Finding(
                "largest late error, gravity without friction",
                late(frictionless.tracking_error).max(),
                frictionless.unit("tracking_error"),
            ),
        ),
        "Gravity is in the regressor Y, so the adaptation takes it up. The claim would hold if, with gravity "
        f"and without friction, more than {CONVERGED:.0%} of the peak error were left over the last tenth of "
        "the run.",
    )


def a460_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """Claims on the A460 pair, from its runs `synchronized`, `independent` and `frictionless`."""
    synchronized, independent, frictionless = need(runs, "synchronized", "independent", "frictionless")
    return [
        arms_reach_their_targets(synchronized),
        arms_reach_their_targets(independent),
        sync_error_is_much_smaller(synchronized, independent, "section V-A, Figs. 4 and 7"),
        offsets_are_due_to_friction(synchronized, frictionless),
        offsets_are_due_to_gravity(frictionless),
        errors_converge(frictionless, "theorem 1"),
    ]
