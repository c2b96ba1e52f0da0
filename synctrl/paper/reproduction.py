"""All runs of the paper's section V, and those that its claims are checked against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec

from ..experiments.a460_full import a460_full_pair
from ..experiments.a460_pair import a460_pair
from ..experiments.planar_four import GAINS, planar_four
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .batch import Job
from .judge import DURATION as JUDGED_DURATION
from .judge import Agreement, compare_runs, joint_pair

#: Lambda + beta of the paper's four arms: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=110.0)
#: in which the errors of the undisturbed arms have their peaks, s
PEAKS = 1.0

JOBS: Mapping[str, Job] = {
    "a460_pair_synchronized": Job(partial(a460_pair)),
    "a460_pair_independent": Job(partial(a460_pair, synchronized=False)),
    "a460_pair_frictionless": Job(partial(a460_pair, friction=False), 8.0),
    "a460_pair_friction_unknown": Job(partial(a460_pair), 6.0),
    "a460_pair_friction_adapted": Job(partial(a460_pair, adapt_friction=True), 6.0),
    "a460_pair_full": Job(partial(a460_full_pair)),
    "a460_pair_full_alone": Job(partial(a460_full_pair, synchronized=False)),
    "planar_four_synchronized": Job(partial(planar_four)),
    "planar_four_independent": Job(partial(planar_four, synchronized=False)),
    "planar_four_synchronized_disturbed": Job(partial(planar_four, disturbance="torque")),
    "planar_four_independent_disturbed": Job(partial(planar_four, synchronized=False, disturbance="torque")),
    "planar_four_without_k_eps": Job(partial(planar_four, gains=GAINS.replace(K_eps=0.0)), PEAKS),
    "planar_four_without_adaptation": Job(partial(planar_four, gains=GAINS.replace(Gamma=0.0)), PEAKS),
    "planar_four_stiff": Job(partial(planar_four, synchronized=False, gains=STIFF), PEAKS),
}

#: cells in which MuJoCo judges the plants, none of which has friction
_JUDGED: Mapping[str, Callable[[], Experiment]] = {
    "planar_four": planar_four,
    "a460": partial(a460_pair, friction=False),
    "ur5": partial(joint_pair, "ur5"),
    "panda": partial(joint_pair, "panda"),
}


def judge_jobs() -> dict[str, Job]:
    """Runs to be compared, `judge_<cell>` by Pinocchio and `judge_<cell>_mujoco`; none without MuJoCo."""
    if find_spec("mujoco") is None:
        return {}
    jobs = {}
    for name, make in _JUDGED.items():
        jobs[f"judge_{name}"] = Job(make, JUDGED_DURATION)
        jobs[f"judge_{name}_mujoco"] = Job(make, JUDGED_DURATION, "mujoco")
    return jobs


def judged(runs: Mapping[str, Result]) -> list[Agreement]:
    """How far plants agree, from runs of `judge_jobs` make."""
    pairs = [(run, runs.get(f"{name}_mujoco")) for name, run in runs.items()]
    return [compare_runs(ours, theirs) for ours, theirs in pairs if theirs is not None]
