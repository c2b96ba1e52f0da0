"""All runs of the paper's section V, and those that its claims are checked against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec

from ..experiments.a460_full import a460_full_pair
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import GAINS, planar_four
from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .batch import PlannedRun
from .judge import DURATION as JUDGED_DURATION
from .judge import Agreement, compare_runs, joint_pair

#: Lambda + beta of the paper's four arms: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=110.0)
#: in which the errors of the undisturbed arms have their peaks, s
PEAKS = 1.0

PLANNED: Mapping[str, PlannedRun] = {
    "a460_pair_synchronized": PlannedRun(a460_pair),
    "a460_pair_independent": PlannedRun(partial(a460_pair, synchronized=False)),
    "a460_pair_frictionless": PlannedRun(partial(a460_pair, friction=False), 8.0),
    "a460_pair_friction_unknown": PlannedRun(a460_pair, 6.0),
    "a460_pair_friction_adapted": PlannedRun(partial(a460_pair, adapt_friction=True), 6.0),
    "a460_pair_full": PlannedRun(a460_full_pair),
    "a460_pair_full_alone": PlannedRun(partial(a460_full_pair, synchronized=False)),
    "planar_four_synchronized": PlannedRun(planar_four),
    "planar_four_independent": PlannedRun(partial(planar_four, synchronized=False)),
    "planar_four_synchronized_disturbed": PlannedRun(partial(planar_four, disturbance="torque")),
    "planar_four_independent_disturbed": PlannedRun(
        partial(planar_four, synchronized=False, disturbance="torque")
    ),
    "planar_four_without_k_eps": PlannedRun(partial(planar_four, gains=GAINS.replace(K_eps=0.0)), PEAKS),
    "planar_four_without_adaptation": PlannedRun(partial(planar_four, gains=GAINS.replace(Gamma=0.0)), PEAKS),
    "planar_four_stiff": PlannedRun(partial(planar_four, synchronized=False, gains=STIFF), PEAKS),
}

#: cells in which MuJoCo judges the plants, none of which has friction
_JUDGED: Mapping[str, Callable[[], Experiment]] = {
    "planar_four": planar_four,
    "a460": partial(a460_pair, friction=False),
    "ur5": partial(joint_pair, "ur5"),
    "panda": partial(joint_pair, "panda"),
}


def judge_runs() -> dict[str, PlannedRun]:
    """Runs to be compared, `judge_<cell>` by Pinocchio and `judge_<cell>_mujoco`; none without MuJoCo."""
    if find_spec("mujoco") is None:
        return {}
    planned = {}
    for name, make in _JUDGED.items():
        planned[f"judge_{name}"] = PlannedRun(make, JUDGED_DURATION)
        planned[f"judge_{name}_mujoco"] = PlannedRun(make, JUDGED_DURATION, "mujoco")
    return planned


def judged(runs: Mapping[str, Result]) -> list[Agreement]:
    """How far the plants agree in the runs of `judge_runs`."""
    pairs = [(run, runs.get(f"{name}_mujoco")) for name, run in runs.items()]
    return [compare_runs(ours, theirs) for ours, theirs in pairs if theirs is not None]


__getattr__ = names_elsewhere(__name__, ".reproduction", JOBS="PLANNED", judge_jobs="judge_runs")
