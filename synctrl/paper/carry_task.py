"""The first task of the paper's introduction on the page: two arms that hold one payload.

The cell, its gains and the errors are our choice; the paper has the task, but neither a payload nor a force.
"""

from __future__ import annotations

from functools import partial

from ..experiments.carry import GAINS, carry_ur5
from ..show.assembly_figures import internal_force_curves, object_error_curves
from ..show.curves import Curves
from ..simulation.result import Result
from .claims_of_carrying import along_error, carry_claims, force, moment, off_its_path, pull, whole_millimetre
from .reproduction import PlannedRun
from .tasks import Drawing, Task, root_mean_square

#: K_eps of a synchronization that is to be stiff, N/m and N·m/rad
STIFF = GAINS.replace(K_eps=[2e4] * 3 + [200.0] * 3)
#: steps of 4 ms are below the limit of the fixtures
_run = partial(PlannedRun, dt=4e-3, log_dt=8e-3, engine="compiled")
_wrong = partial(carry_ur5, geometric_error=True)
_rough = partial(_wrong, friction=True, push=True)
_whole = {"tare": True, "admittance": True, "gains": STIFF}


def integral_curves(run: Result) -> list[Curves]:
    """The force along the geometric error beside the one that is predicted, and epsilon along it."""
    left = -1e3 * along_error(run, run.sync_error[:, 0, :3])
    predicted = [(whole_millimetre(run),)]
    return [
        Curves("pull along the error; dashed: K g/2", "force, N", pull(run)[:, None], ["pull"], predicted),
        Curves("ε along the error, which the integral works off", "mm", left[:, None], ["ε"], [(0.0,)]),
    ]


_TASK = (
    "The first task of the paper's introduction: all robots hold one rigid payload. Two UR5 hold 4 kg that "
    "they know in part, in fixtures that give a little (10⁵ N/m), and swing it about. Forces pass through "
    "the payload from hand to hand; the internal force is what the hands do to it beyond carrying it. The "
    "controllers do not see it."
)
_ERROR = (
    "Geometric error: arm 1 is wrong about where it holds the payload, by 1 mm and 0.5°. Then ε = 0 means to "
    "bend the fixtures by that millimetre, and the paper's integral does not rest before they are. With a "
    "leak I' = ε - ΛI, where without one I' = ε."
)
_MORE = (
    "Three parts beside the paper's law take the force out again. A tare: both arms take over where arm 1 "
    "believes the payload. An admittance: arms give way to the forces inside that their hands measure, so "
    "here the controllers do see them. And with both a stiff synchronization does no harm, with K_ε of "
    "2·10⁴ N/m and 200 N·m/rad. “With everything” is all of these with a leak of Λ. In the last four runs "
    "joints rub, of which the controllers do not know, and from 1 s to 1.5 s arm 1 is pushed."
)

CARRY = Task(
    name="carry",
    title="One payload, two hands",
    words=(_TASK, _ERROR, _MORE),
    planned={
        "exact_alone": _run(partial(carry_ur5, synchronized=False)),
        "exact": _run(carry_ur5),
        "alone": _run(partial(_wrong, synchronized=False)),
        "paper": _run(_wrong),
        "leak": _run(partial(_wrong, leak=True)),
        "yielding": _run(partial(_wrong, synchronized=False, admittance=True)),
        "whole": _run(partial(_wrong, **_whole)),
        "rough_alone": _run(partial(_rough, synchronized=False)),
        "rough_paper": _run(_rough),
        "rough_yielding": _run(partial(_rough, synchronized=False, admittance=True)),
        "rough_whole": _run(partial(_rough, **_whole)),
    },
    labels={
        "exact_alone": "exact geometry, independent",
        "exact": "exact geometry, the paper's law",
        "alone": "geometric error, independent",
        "paper": "geometric error, the paper's law",
        "leak": "geometric error, with a leak",
        "yielding": "geometric error, independent, with an admittance",
        "whole": "geometric error, with everything",
        "rough_alone": "error, friction and push, independent",
        "rough_paper": "error, friction and push, the paper's law",
        "rough_yielding": "error, friction and push, independent, with an admittance",
        "rough_whole": "error, friction and push, with everything",
    },
    drawings=(
        Drawing("carry_exact", "Exact geometry.", internal_force_curves, ("exact_alone", "exact")),
        Drawing(
            "carry_error",
            "One arm is wrong by 1 mm and 0.5°.",
            internal_force_curves,
            ("alone", "paper", "leak"),
        ),
        Drawing(
            "carry_integral", "The paper's integral in a closed chain.", integral_curves, ("paper", "leak")
        ),
        Drawing(
            "carry_rough",
            "One arm is wrong, joints rub, and arm 1 is pushed.",
            internal_force_curves,
            ("rough_alone", "rough_yielding", "rough_whole"),
        ),
        Drawing(
            "carry_object",
            "The payload, desired less actual.",
            object_error_curves,
            ("rough_alone", "rough_whole"),
        ),
    ),
    animated=("alone", "paper", "whole"),
    columns={
        "internal force, N, peak": lambda run: float(force(run).max()),
        "RMS": lambda run: root_mean_square(force(run)),
        "final": lambda run: float(force(run)[-1]),
        "moment, N·m, RMS at hand 1": partial(moment, hand=0),
        "at hand 2": partial(moment, hand=1),
        "payload off its path, mm, RMS": off_its_path,
    },
    claims=carry_claims,
)
