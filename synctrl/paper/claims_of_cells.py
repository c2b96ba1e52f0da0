"""Claims on the two A460 arms and on the four planar arms, section V, and what the paper leaves unsaid."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..analysis.metrics import error_metrics, metrics
from ..simulation.result import Result
from . import claims
from .claims import OURS_OF_THE_PAPER, Claim, Finding, need
from .offsets import offsets_are_due_to_friction_and_gravity


def arms_reach_their_targets(run: Result) -> Claim:
    """Every joint ends within `claims.REACHED` of the way it travels."""
    share = share_of_way(run)
    row, joint = claims.worst(share)
    return Claim(
        f"Both arms reach their targets with small residual offsets ({claims.kind(run)} control).",
        f"section V-A, {'Figs. 2 and 3' if claims.kind(run) == 'synchronized' else 'Figs. 5 and 6'}",
        bool(share.max() <= claims.REACHED),
        (
            Finding("largest final error", np.abs(run.tracking_error[-1]).max(), run.unit("tracking_error")),
            Finding("largest share of the way that is left", share.max()),
        ),
        f"Asked: on every joint at most {claims.REACHED:.0%} of the desired way left after {run.t[-1]:g} s. "
        f"Largest share: {run.names[row]}, {run.info['axes'][joint]}.",
    )


def share_of_way(run: Result) -> np.ndarray:
    """What is left at the end of the way that each joint is to travel, (n, m)."""
    share: np.ndarray = np.abs(run.tracking_error[-1] / (run.x_desired[-1] - run.x_desired[0]))
    return share


def a460_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """Claims on the A460 pair, from its runs `synchronized`, `independent`, `frictionless`, `left_...`."""
    synchronized, independent, frictionless = need(runs, "synchronized", "independent", "frictionless")
    return [
        arms_reach_their_targets(synchronized),
        arms_reach_their_targets(independent),
        claims.sync_error_is_much_smaller(synchronized, independent, "section V-A, Figs. 4 and 7"),
        offsets_are_due_to_friction_and_gravity(runs),
        claims.errors_converge(frictionless, "theorem 1"),
    ]


def others_move_along(undisturbed: Result, disturbed: Result) -> Claim:
    """The disturbance of robot 1 moves robots 2 to 4 the same way when they are synchronized."""
    response = claims.response(disturbed, undisturbed)
    first, others = response[:, 0].ravel(), response[:, 1:].swapaxes(0, 1).reshape(response.shape[1] - 1, -1)
    lengths = np.linalg.norm(others, axis=1) * np.linalg.norm(first)
    cosines = others @ first / np.where(lengths > 0, lengths, np.inf)  # 0 for a robot that does not respond
    sizes = np.abs(response).max(axis=(0, 2))
    figures = [Finding(f"response of {n}", s, "m") for n, s in zip(disturbed.names, sizes, strict=True)]
    return Claim(
        "Disturbed and synchronized, robots 2 to 4 respond to the torque on robot 1 and so avoid large "
        "synchronization errors.",
        "section V-B, Figs. 13 and 14",
        bool(cosines.min() >= claims.ALONG and sizes[1:].min() * claims.MUCH >= sizes[0]),
        (*figures, Finding("smallest cosine between a response and that of robot 1", float(cosines.min()))),
        "Response: tracking error with minus without the disturbance, its peak. Asked: each response has "
        f"at least 1/{claims.MUCH:g} of the size of robot 1's and runs along it, cosine at least "
        f"{claims.ALONG:g}.",
    )


def others_are_untouched(undisturbed: Result, disturbed: Result) -> Claim:
    """Independent robots 2 to 4 are bit for bit the same with and without the disturbance."""
    arrays = ("x", "q", "v", "tau", "tracking_error", "theta_hat")
    differing = sum(claims.changed(undisturbed, disturbed, name, [1, 2, 3]) for name in arrays)
    moved = np.abs(disturbed.tracking_error[:, 0] - undisturbed.tracking_error[:, 0]).max()
    return Claim(
        "Disturbed and independent, robots 2 to 4 move exactly as without the disturbance.",
        "section V-B, Figs. 11 and 15",
        bool(differing == 0 and moved > 0),
        (
            Finding("logged values of robots 2 to 4 that differ", differing),
            Finding("response of robot 1", moved, "m"),
        ),
        "Asked: positions, velocities, torques, errors and estimates of robots 2 to 4 bit for bit the same.",
        "With β = K_ε = 0 nothing in the controller connects the robots, and nothing else does.",
    )


def only_adjacent_sync_errors_grow(undisturbed: Result, disturbed: Result) -> Claim:
    """Independent: epsilon_2 and epsilon_3 stay bit for bit, epsilon_1 and epsilon_4 grow."""
    before, after = metrics(undisturbed).sync_error.peak, metrics(disturbed).sync_error.peak
    growth = after.max(axis=1) / before.max(axis=1)
    differing = claims.changed(undisturbed, disturbed, "sync_error", [1, 2])
    return Claim(
        "Disturbed and independent, ε_2 and ε_3 are unchanged, while ε_1 and ε_4 grow significantly.",
        "section V-B, Figs. 12 and 16",
        bool(differing == 0 and min(growth[0], growth[3]) >= claims.MUCH),
        (
            Finding("logged values of ε_2 and ε_3 that differ", differing),
            Finding("peak of ε_1, disturbed / undisturbed", growth[0]),
            Finding("peak of ε_4, disturbed / undisturbed", growth[3]),
        ),
        "Asked: ε_2 and ε_3 bit for bit the same, the peaks of ε_1 and ε_4 larger by a factor of at least "
        f"{claims.MUCH:g}.",
        "ε_2 and ε_3 are made of errors of robots that nothing connects to robot 1; that the others grow is "
        "found.",
    )


def disturbance_is_shared(synchronized: Result, independent: Result) -> Claim:
    """Under the disturbance, the largest synchronization error is much smaller with synchronization."""
    ours, theirs = (metrics(run).sync_error.peak.max() for run in (synchronized, independent))
    unit = synchronized.unit("sync_error")
    return Claim(
        "Disturbed, the largest synchronization error is much smaller with synchronization than without.",
        "section V-B, Figs. 14 and 16",
        bool(ours * claims.MUCH <= theirs),
        (Finding("largest, synchronized", ours, unit), Finding("largest, independent", theirs, unit)),
        f"Asked: smaller by a factor of at least {claims.MUCH:g}.",
    )


# -- what the paper does not say --------------------------------------------------------------------------


def gain_contributes_little(name: str, paper: Result, without: Result) -> Claim:
    """Our finding: a gain of the paper switched off changes peak and RMS of epsilon little."""
    t, with_it = claims.common(paper, without)
    errors = {"the paper's gains": with_it, f"without {name}": without.sync_error[: len(t)]}
    unit, who = paper.unit("sync_error"), tuple(errors)
    peaks, sizes = zip(*((np.abs(e).max(), whole_rms(t, e)) for e in errors.values()), strict=True)
    lates = [claims.late(e).max() for e in errors.values()]
    change = max(abs(values[1] / values[0] - 1) for values in (peaks, sizes))
    at = t[np.abs(with_it).max(axis=(1, 2)).argmax()]
    return Claim(
        f"At the paper's gains, {name} contributes little to the synchronization of the four arms.",
        OURS_OF_THE_PAPER,
        bool(change <= claims.LITTLE),
        (
            *claims.findings("peak ε", peaks, unit, who),
            *claims.findings("RMS ε", sizes, unit, who),
            *claims.findings("late ε", lates, unit, who),
        ),
        f"Asked: the peak of ε, and its RMS over {t[-1]:g} s, change by at most {claims.LITTLE:.0%}. "
        f"Without {name} the peak, at {1e3 * at:.0f} ms, changes by {peaks[1] / peaks[0] - 1:+z.1%}, the RMS "
        f"by {sizes[1] / sizes[0] - 1:+z.1%}, and what is left over the last tenth by "
        f"{lates[1] / lates[0] - 1:+z.1%}.",
    )


def whole_rms(t: np.ndarray, e: np.ndarray) -> float:
    """RMS of an error over time, rows and axes."""
    return float(np.sqrt(np.square(error_metrics(t, e, 0.0).rms).mean()))


def baseline_is_not_gain_matched(synchronized: Result, stiff: Result) -> Claim:
    """Our finding: an independent controller with a larger Lambda tracks better than the synchronized one."""
    t, _ = claims.common(synchronized, stiff)
    ours, theirs = (np.abs(run.tracking_error[: len(t)]).max() for run in (synchronized, stiff))
    errors = [np.abs(run.sync_error[: len(t)]).max() for run in (synchronized, stiff)]
    unit = synchronized.unit("sync_error")
    return Claim(
        f"β = K_ε = 0 is not a gain-matched comparison: an independent controller with Λ = "
        f"{np.mean(stiff.info['gains']['Lambda']):g} tracks better than the synchronized one.",
        OURS_OF_THE_PAPER,
        bool(theirs < ours),
        (
            Finding("largest tracking error, synchronized", ours, "m"),
            Finding("largest tracking error, independent and stiffer", theirs, "m"),
            Finding("largest synchronization error, synchronized", errors[0], unit),
            Finding("largest synchronization error, independent and stiffer", errors[1], unit),
        ),
        f"Compared over the first {t[-1]:g} s.",
    )


def planar_four_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """Claims on the four arms, from their runs `synchronized`, `independent` and the two `..._disturbed`."""
    names = ("synchronized", "independent", "synchronized_disturbed", "independent_disturbed")
    synchronized, independent, synchronized_disturbed, independent_disturbed = need(runs, *names)
    return [
        claims.errors_converge(synchronized, "theorem 2 and section V-B, Figs. 9 and 10"),
        claims.errors_converge(independent, "section V-B, Figs. 11 and 12"),
        claims.sync_error_is_much_smaller(synchronized, independent, "section V-B, Figs. 10 and 12"),
        others_move_along(synchronized, synchronized_disturbed),
        disturbance_is_shared(synchronized_disturbed, independent_disturbed),
        others_are_untouched(independent, independent_disturbed),
        only_adjacent_sync_errors_grow(independent, independent_disturbed),
    ]


def own_findings(runs: Mapping[str, Result]) -> list[Claim]:
    """What the paper leaves unsaid.

    Args:
        runs: `synchronized`, `without_k_eps`, `without_adaptation` and `stiff`.
    """
    names = ("synchronized", "without_k_eps", "without_adaptation", "stiff")
    synchronized, without_k_eps, without_adaptation, stiff = need(runs, *names)
    return [
        gain_contributes_little("K_ε", synchronized, without_k_eps),
        gain_contributes_little("the adaptation", synchronized, without_adaptation),
        baseline_is_not_gain_matched(synchronized, stiff),
    ]
