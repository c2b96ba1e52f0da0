"""The third task of the paper's introduction on the page: two beads on one path, until they meet.

The cell, its gains and the push are our choice; the paper has the task, but neither a path nor a gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from ..experiments.bead_on_path import GAINS, bead_on_path
from ..show.curves import Curves
from ..simulation.result import Result
from .claims import MUCH, Claim, findings
from .reproduction import PlannedRun
from .tasks import COMPARED, OUR_CELL, Drawing, Task, more_than_gain, since_push

#: Lambda + beta: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=26.0)
#: until after they have met, s
_run = partial(PlannedRun, duration=4.0, dt=2.5e-3, log_dt=1e-2, engine="compiled")


def when_they_meet(run: Result, values: np.ndarray) -> float:
    """Of values over time, (T,), the one at which the beads should meet, or the last one before."""
    return float(np.interp(run.info["path"]["duration"], run.outputs.get("phase", run.t), values))


def gap_there(run: Result) -> float:
    """Error of the gap where the beads meet, m, above 0 where it is too large."""
    return when_they_meet(run, run.outputs["gap_error"])


def gap_peak(run: Result) -> float:
    """Largest error of the gap from the push on, m."""
    return float(np.abs(since_push(run, run.outputs["gap_error"])).max())


def point_off(run: Result) -> float:
    """How far along the path the beads meet beyond the place that was meant, m."""
    return when_they_meet(run, run.outputs["bead_error"][..., 0].mean(axis=1))


def speed_off(run: Result, robot: int) -> float:
    """Largest speed of a nozzle against the commanded one from the push on, m/s."""
    return float(np.abs(since_push(run, run.outputs["speed_error"][:, robot])).max())


def gap_curves(run: Result) -> list[Curves]:
    """Error of the gap over time."""
    gap = 1e3 * run.outputs["gap_error"][:, None]
    return [Curves("error of the gap between the nozzles", "mm", gap, ["gap"], [(0.0,)])]


def speed_curves(run: Result) -> list[Curves]:
    """Speeds of both nozzles against the commanded ones, over time."""
    off = 1e3 * run.outputs["speed_error"]
    return [
        Curves(f"speed of robot {k + 1}, actual less commanded", "mm/s", off[:, [k]], ["speed"])
        for k in (0, 1)
    ]


def path_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """What is asked of the runs of the task."""
    return [
        gap_is_kept(runs["gap"], runs["alone"]),
        not_by_gain(runs["gap"], runs["stiff"], runs["alone"]),
        weights_count_at_the_end(runs["weighted"], runs["gap"]),
        phase_keeps_the_point(runs["phase"], runs["gap"]),
        robot_2_pays(runs["gap"], runs["alone"]),
    ]


def gap_is_kept(gap: Result, alone: Result) -> Claim:
    """Peak and last error of the gap are smaller by `MUCH`."""
    ours, theirs = ((abs(gap_there(run)), gap_peak(run)) for run in (gap, alone))
    who = "synchronized", "independent"
    return Claim(
        "Synchronization along the path keeps the gap although one robot is pushed back.",
        OUR_CELL,
        all(a * MUCH <= b for a, b in zip(ours, theirs, strict=True)),
        (
            *findings("error of the gap where they meet", (ours[0], theirs[0]), "m", who),
            *findings("its peak since the push", (ours[1], theirs[1]), "m", who),
        ),
        f"Asked: both smaller by a factor of at least {MUCH:g}.",
    )


def not_by_gain(gap: Result, stiff: Result, alone: Result) -> Claim:
    """`more_than_gain` of the gap's peak, with its error where they meet."""
    peaks = [gap_peak(run) for run in (gap, stiff, alone)]
    there = [abs(gap_there(run)) for run in (gap, stiff, alone)]
    seen = [
        *findings("peak of the gap's error", peaks, "m", COMPARED),
        *findings("error where they meet", there, "m", COMPARED),
    ]
    return more_than_gain(peaks, seen, "With still more Λ, independent robots would keep the gap as well.")


def weights_count_at_the_end(weighted: Result, gap: Result) -> Claim:
    """The gap's error is smaller where they meet, and its peak is larger."""
    there, peaks = ([measure(run) for run in (weighted, gap)] for measure in (gap_there, gap_peak))
    who = "weighted", "not weighted"
    return Claim(
        "Weights that grow towards the meeting keep the gap better there, and worse before.",
        OUR_CELL,
        abs(there[0]) < abs(there[1]) and peaks[0] > peaks[1],
        (
            *findings("error of the gap where they meet", there, "m", who),
            *findings("its peak since the push", peaks, "m", who),
        ),
        "Asked: a smaller error where they meet, and a larger peak.",
    )


def phase_keeps_the_point(phase: Result, gap: Result) -> Claim:
    """With equal lags in time the point is off by less, and the gap by more, by `MUCH` each."""
    off, there = ([measure(run) for run in (phase, gap)] for measure in (point_off, gap_there))
    who = "phase", "gap"
    return Claim(
        "Robots that compare how late they are keep the point where they meet, and not the gap.",
        OUR_CELL,
        abs(off[0]) * MUCH <= abs(off[1]) and abs(there[1]) * MUCH <= abs(there[0]),
        (
            *findings("point off along the path", off, "m", who),
            *findings("error of the gap there", there, "m", who),
        ),
        f"Asked: a point off by less and a gap off by more, by factors of at least {MUCH:g}.",
    )


def robot_2_pays(gap: Result, alone: Result) -> Claim:
    """The speed of robot 2 is off by more when it minds robot 1."""
    speeds = [speed_off(run, 1) for run in (gap, alone)]
    return Claim(
        "Robot 2 pays for robot 1: its own speed, which its dispenser has to follow, is disturbed.",
        OUR_CELL,
        speeds[0] >= MUCH * speeds[1],
        tuple(findings("largest error of robot 2's speed", speeds, "m/s", ("synchronized", "independent"))),
        f"Asked: an error of its speed that is larger by a factor of at least {MUCH:g}.",
    )


_TASK = (
    "The third task of the paper's introduction: two robots spread adhesive on one path. They begin at its "
    "ends and meet after 3.8 s, with 20 mm left between their nozzles. Joints rub, of which the controllers "
    "do not know, and from 0.8 s to 0.3 s before they meet robot 1 is pushed back. Robots are synchronized "
    "along the path alone: across it nobody has to wait for the other one."
)
_MODES = (
    "What they compare is a choice. The gap: robot 2 moves up where robot 1 is late. The gap, weighted: the "
    "same, in full where they meet and less before. The phase: by how much time each is late, which keeps "
    "the point where they meet, and not the gap."
)

PATH = Task(
    name="path",
    title="Two beads that meet",
    words=(_TASK, _MODES),
    planned={
        "alone": _run(partial(bead_on_path, "independent")),
        "stiff": _run(partial(bead_on_path, "independent", gains=STIFF)),
        "gap": _run(partial(bead_on_path, "gap")),
        "weighted": _run(partial(bead_on_path, "gap_weighted")),
        "phase": _run(partial(bead_on_path, "phase")),
        "waiting": _run(partial(bead_on_path, "gap_weighted", True), duration=4.2, engine="pinocchio"),
    },
    labels={
        "alone": "independent",
        "stiff": "independent, Λ = 26 s⁻¹",
        "gap": "gap",
        "weighted": "gap, weighted",
        "phase": "phase",
        "waiting": "gap, weighted, and a motion that waits",
    },
    drawings=(
        Drawing("path_gap", "The gap.", gap_curves, ("alone", "stiff", "gap", "weighted", "phase")),
        Drawing("path_gap_close", "The gap where it is kept.", gap_curves, ("gap", "weighted", "waiting")),
        Drawing("path_speed", "Speeds.", speed_curves, ("alone", "gap", "weighted")),
    ),
    animated=("alone", "weighted"),
    columns={
        "gap's error where they meet, mm": lambda run: 1e3 * gap_there(run),
        "its peak since the push": lambda run: 1e3 * gap_peak(run),
        "point off along the path, mm": lambda run: 1e3 * point_off(run),
        "speed of robot 1 off, mm/s": lambda run: 1e3 * speed_off(run, 0),
        "of robot 2": lambda run: 1e3 * speed_off(run, 1),
        "they meet at, s": lambda run: when_they_meet(run, run.t),
    },
    claims=path_claims,
)
