"""The second task of the paper's introduction on the page: a bead on the edge of what another robot carries.

The cell, its gains and the push are our choice; the paper has the task, but neither a plate nor a bead.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from ..experiments.bead_on_edge import GAINS, bead_on_edge
from ..show.curves import Curves
from ..simulation.result import Result
from .claims import MUCH, Claim, findings
from .reproduction import PlannedRun
from .tasks import COMPARED, OUR_CELL, Drawing, Task, more_than_gain, root_mean_square, since_push

#: Lambda + beta: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=26.0)
#: robots of the cell
CARRIER, NOZZLE = 0, 1
#: the end of a run, when the push is over, s
END = 2.0
#: without friction steps may be long
_run = partial(PlannedRun, dt=5e-3, log_dt=1e-2, engine="compiled")


def missed(run: Result) -> np.ndarray:
    """How far the nozzle is from its place on the plate, (T,), m."""
    return np.linalg.norm(run.outputs["bead_error"], axis=1)


def speed_off(run: Result) -> np.ndarray:
    """Speed of the nozzle along the edge less the desired one, (T,), m/s."""
    return run.outputs["bead_speed"] - run.outputs["bead_speed_desired"]


def peak(run: Result) -> float:
    """Largest error of the bead from the push on, m."""
    return float(since_push(run, missed(run)).max())


def end(run: Result) -> float:
    """RMS error of the bead over the last `END` seconds, m."""
    return root_mean_square(missed(run)[run.t >= run.t[-1] - END])


def off_own_path(run: Result, robot: int) -> float:
    """Largest distance from the push on of a robot's point from where it should be in the world, m."""
    return float(np.linalg.norm(since_push(run, run.tracking_error[:, robot, :3]), axis=1).max())


def bead_curves(run: Result) -> list[Curves]:
    """Error of the bead, of the speed along the edge, and of the nozzle's angle, over time."""
    return [
        Curves("error of the bead against the plate", "mm", 1e3 * missed(run)[:, None], ["error"]),
        Curves("speed along the edge, actual less desired", "mm/s", 1e3 * speed_off(run)[:, None], ["speed"]),
        Curves("nozzle off its tilt", "deg", np.rad2deg(run.outputs["normal_angle"])[:, None], ["angle"]),
    ]


def path_curves(run: Result) -> list[Curves]:
    """How far both robots are from where they should be in the world."""
    off = 1e3 * np.linalg.norm(run.tracking_error[..., :3], axis=2)
    names = "at the nozzle's place on the plate, by the arm that carries", "the nozzle"
    return [Curves(name, "mm", off[:, [k]], ["distance"]) for k, name in enumerate(names)]


def edge_claims(runs: Mapping[str, Result]) -> list[Claim]:
    """What is asked of the runs of the task."""
    alone, stiff, together = (runs[name] for name in ("alone", "stiff", "together"))
    peaks = [peak(run) for run in (together, stiff, alone)]
    seen = findings("peak of the bead's error", peaks, "m", COMPARED)
    return [stays_on_the_edge(together, alone), more_than_gain(peaks, seen), paid(together, alone)]


def stays_on_the_edge(together: Result, alone: Result) -> Claim:
    """Peak and late error of the bead are smaller by `MUCH`."""
    who, ours, theirs = ("synchronized", "independent"), *((peak(r), end(r)) for r in (together, alone))
    return Claim(
        "Synchronization keeps the bead on the edge while the robot that carries the plate is pushed.",
        OUR_CELL,
        all(a * MUCH <= b for a, b in zip(ours, theirs, strict=True)),
        (
            *findings("peak of the bead's error", (ours[0], theirs[0]), "m", who),
            *findings(f"its RMS over the last {END:g} s", (ours[1], theirs[1]), "m", who),
        ),
        f"Asked: both smaller by a factor of at least {MUCH:g}. ε is exactly the error of the bead, for the "
        "errors of the arm that carries count where the nozzle should be on the plate.",
    )


def paid(together: Result, alone: Result) -> Claim:
    """The nozzle is farther from its own path when it follows the plate."""
    off = [off_own_path(run, NOZZLE) for run in (together, alone)]
    plate = [off_own_path(run, CARRIER) for run in (together, alone)]
    return Claim(
        "The nozzle pays for it: to stay on the plate it leaves its own path.",
        OUR_CELL,
        off[0] > off[1],
        (
            *findings("nozzle off its path, peak", off, "m", ("synchronized", "independent")),
            *findings("plate there, peak", plate, "m", ("synchronized", "independent")),
        ),
        "Asked: a larger peak of the nozzle's distance from where it should be in the world.",
    )


_TASK = (
    "The second task of the paper's introduction: one robot carries a payload while another one spreads "
    "adhesive on its moving edge. Here a UR5 swings a plate of 2 kg that it knows nothing of, and a second "
    "one goes along the plate's edge with a nozzle tilted by 30°, at 0.14 m/s. From 2 s to 2.3 s the first "
    "one is pushed. No force passes between the robots. What counts is where the nozzle is against the "
    "plate: an error that both make together does no harm."
)

EDGE = Task(
    name="edge",
    title="A bead on a moving edge",
    words=(_TASK,),
    planned={
        "alone": _run(partial(bead_on_edge, synchronized=False)),
        "stiff": _run(partial(bead_on_edge, synchronized=False, gains=STIFF)),
        "together": _run(bead_on_edge),
    },
    labels={
        "alone": "independent",
        "stiff": "independent, Λ = 26 s⁻¹",
        "together": "the paper's law, β = 20 s⁻¹",
    },
    drawings=(
        Drawing("edge_bead", "The bead.", bead_curves, ("alone", "stiff", "together")),
        Drawing("edge_paths", "Both robots against the world.", path_curves, ("alone", "stiff", "together")),
    ),
    animated=("alone", "together"),
    columns={
        "bead's error, mm, peak since the push": lambda run: 1e3 * peak(run),
        f"RMS over the last {END:g} s": lambda run: 1e3 * end(run),
        "speed along the edge off, mm/s": lambda run: (
            1e3 * float(np.abs(since_push(run, speed_off(run))).max())
        ),
        "nozzle off its tilt, deg": lambda run: float(
            np.rad2deg(since_push(run, run.outputs["normal_angle"]).max())
        ),
        "plate off its path, mm": lambda run: 1e3 * off_own_path(run, CARRIER),
        "nozzle off its path, mm": lambda run: 1e3 * off_own_path(run, NOZZLE),
    },
    claims=edge_claims,
)
