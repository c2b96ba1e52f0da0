"""What is asked of two arms that hold one payload, and what it is measured by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..assembly.body import place_of
from ..experiments.carry import GEOMETRIC_ERROR
from ..simulation.result import Result
from .claims import MUCH, Claim, Finding, findings
from .tasks import OUR_CELL, root_mean_square

#: how near a force has to come to one that was predicted, as a share of it
NEAR = 0.05
SOURCE = f"{OUR_CELL}, with forces"
_DIRECTION = GEOMETRIC_ERROR[:3] / np.linalg.norm(GEOMETRIC_ERROR[:3])
#: a share of the force that is small
THIRD = 1 / 3


def force(run: Result) -> np.ndarray:
    """Size of the internal force, (T,), N; two hands have the same."""
    return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)


def moment(run: Result, hand: int) -> float:
    """RMS of the internal moment at a hand, N·m."""
    return root_mean_square(run.outputs["internal_force"][:, hand, 3:])


def off_its_path(run: Result) -> float:
    """RMS of the distance of the payload from where it should be, mm."""
    return 1e3 * root_mean_square(run.outputs["object_desired"][:, :3] - run.outputs["object_pose"][:, :3])


def whole_millimetre(run: Result) -> float:
    """The force at which both fixtures together give the whole geometric error, N: K g / 2."""
    return 0.5 * float(run.info["grasps"][0]["stiffness"][0]) * float(np.linalg.norm(GEOMETRIC_ERROR[:3]))


def along_error(run: Result, vectors: np.ndarray) -> np.ndarray:
    """Parts of vectors in world axes, (T, 3), along the geometric error, (T,): it turns with the payload."""
    _, R = place_of(run.outputs["object_pose"])
    return np.matvec(R.mT, vectors) @ _DIRECTION


def pull(run: Result) -> np.ndarray:
    """Internal force at hand 1 along the geometric error, (T,), N, above 0 where the hands pull."""
    return -along_error(run, run.outputs["internal_force"][:, 0, :3])


def carry_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """What is asked of the runs of the task."""
    return [
        synchronization_helps(runs["exact"], runs["exact_alone"]),
        integral_takes_it_all(runs["paper"], runs["alone"]),
        leak_stops_it(runs["leak"], runs["paper"]),
        leak_is_better(runs["leak"], runs["alone"]),
        admittance_does_much(runs["yielding"], runs["alone"]),
        whole_leaves_a_third(runs["whole"], runs["alone"], "With the geometric error"),
        whole_leaves_a_third(runs["rough_whole"], runs["rough_alone"], "With friction and a push as well"),
        whole_is_better(runs["rough_whole"], runs["rough_yielding"]),
    ]


def synchronization_helps(exact: Result, alone: Result) -> Claim:
    """RMS and final force are smaller with synchronization, where the geometry is exact."""
    return _less_force(
        "With exact geometry synchronization takes force out of the payload.",
        {"synchronized": exact, "independent": alone},
        "The fixtures give a little, so ε is not zero and synchronization has something to act on.",
    )


def integral_takes_it_all(paper: Result, alone: Result) -> Claim:
    """With geometric error the force grows to K g / 2, the one at which the fixtures give the whole error."""
    predicted, end = whole_millimetre(paper), float(pull(paper)[-1])
    return Claim(
        "With a millimetre of geometric error the paper's integral is destructive: the force grows until the "
        "fixtures give the whole millimetre.",
        SOURCE,
        abs(end - predicted) <= NEAR * predicted and end >= MUCH * float(pull(alone)[-1]),
        (
            Finding("final pull along the error", end, "N"),
            Finding("predicted, K g/2", predicted, "N"),
            Finding("independent", float(pull(alone)[-1]), "N"),
        ),
        f"Asked: a final pull within {NEAR:.0%} of the predicted one, and at least {MUCH:g} times that of "
        "independent control. ε cannot vanish while one arm is wrong about where it holds the payload, so "
        "its integral grows. The theorem does not know of forces between robots, and is not contradicted.",
    )


def leak_stops_it(leak: Result, paper: Result) -> Claim:
    """The largest late force is smaller by `MUCH` when the integral leaks."""
    late = [float(force(run)[-max(1, len(run.t) // 10) :].max()) for run in (leak, paper)]
    return Claim(
        "A leak of the integral stops that growth.",
        SOURCE,
        late[0] * MUCH <= late[1],
        (Finding("largest late force with a leak", late[0], "N"), Finding("without", late[1], "N")),
        f"Asked: over the last tenth of the run a force smaller by a factor of at least {MUCH:g}. The leak "
        "is Λ, the largest for which V' keeps its sign.",
    )


def leak_is_better(leak: Result, alone: Result) -> Claim:
    """RMS and final force are smaller than under independent control, with geometric error and a leak."""
    return _less_force(
        "With a leak, synchronization has less force than independent control, geometric error or not.",
        {"with a leak": leak, "independent": alone},
        "A leak keeps the harm away; it does not make synchronization useful where the geometry is wrong.",
    )


def admittance_does_much(yielding: Result, alone: Result) -> Claim:
    """Force and moment inside are smaller where independent arms give way to them."""
    forces = [root_mean_square(force(run)) for run in (yielding, alone)]
    moments = [largest_moment(run) for run in (yielding, alone)]
    return Claim(
        "An admittance alone, on the independent controller, already does much.",
        SOURCE,
        forces[0] < forces[1] and moments[0] * MUCH <= moments[1],
        (
            *findings("RMS force", forces, "N", ("with an admittance", "independent")),
            *findings("RMS moment", moments, "N·m", ("with an admittance", "independent")),
        ),
        f"Asked: a smaller RMS force, and an RMS moment smaller by a factor of at least {MUCH:g}, at the "
        "hand where it is larger. Nothing is synchronized here: what helps is that forces are felt.",
    )


def whole_leaves_a_third(whole: Result, alone: Result, where: str) -> Claim:
    """The RMS force is at most `THIRD` of that of independent control, and its peak is smaller."""
    ours, theirs = ((root_mean_square(force(run)), float(force(run).max())) for run in (whole, alone))
    who, off = ("with everything", "independent"), [1e-3 * off_its_path(run) for run in (whole, alone)]
    return Claim(
        f"{where}, a tare, a leak, an admittance and a high K_ε leave less than a third of the "
        "independent controller's RMS force.",
        SOURCE,
        ours[0] <= THIRD * theirs[0] and ours[1] < theirs[1],
        (
            *findings("RMS force", (ours[0], theirs[0]), "N", who),
            *findings("peak force", (ours[1], theirs[1]), "N", who),
            *findings("payload off its path, RMS", off, "m", who),
        ),
        "Asked: at most a third of the RMS force, and a smaller peak. The peak is that of the start or of "
        "the push, before anything can give way. The motion of the payload is not asked to be better.",
    )


def whole_is_better(whole: Result, yielding: Result) -> Claim:
    """Synchronization has its part in it: less RMS force than of independent arms with an admittance."""
    forces = [root_mean_square(force(run)) for run in (whole, yielding)]
    return Claim(
        "Synchronization has its part in that: with friction and a push an admittance alone leaves more.",
        SOURCE,
        forces[0] * MUCH <= forces[1],
        tuple(findings("RMS force", forces, "N", ("with everything", "independent, with an admittance"))),
        f"Asked: an RMS force smaller by a factor of at least {MUCH:g}.",
    )


def largest_moment(run: Result) -> float:
    """RMS of the internal moment, at the hand where it is larger, N·m."""
    return max(moment(run, hand) for hand in (0, 1))


def _less_force(text: str, runs: Mapping[str, Result], remark: str) -> Claim:
    """RMS and final force are smaller in the first of two runs than in the second, independent control."""
    ours, theirs = (_rms_and_end(run) for run in runs.values())
    return Claim(
        text,
        SOURCE,
        all(a.value < b.value for a, b in zip(ours, theirs, strict=True)),
        tuple(each for who, found in zip(runs, (ours, theirs), strict=True) for each in _named(who, found)),
        f"Asked: RMS and final internal force smaller than under independent control. {remark}",
    )


def _rms_and_end(run: Result) -> tuple[Finding, Finding]:
    found = force(run)
    return Finding("RMS force", root_mean_square(found), "N"), Finding("final force", float(found[-1]), "N")


def _named(who: str, findings: tuple[Finding, ...]) -> list[Finding]:
    return [Finding(f"{each.name}, {who}", each.value, each.unit) for each in findings]
