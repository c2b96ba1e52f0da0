"""All runs of the paper's section V, and those that its claims are checked against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from ..analysis.judge import Comparison, compare_runs
from ..errors import SimulationError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .a460_full import a460_full_pair
from .a460_pair import a460_pair
from .judged import joint_pair
from .planar_four import GAINS, planar_four

#: Lambda + beta of the paper's four arms: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=110.0)
JUDGED_DURATION = 0.4  # s


@dataclass(frozen=True)
class Job:
    """A run to be made: how its experiment is built, how long it takes, and what computes the plant."""

    make: Callable[[], Experiment]
    duration: float | None = None
    plant: str = "pinocchio"


JOBS: Mapping[str, Job] = {
    "a460_pair_synchronized": Job(partial(a460_pair)),
    "a460_pair_independent": Job(partial(a460_pair, synchronized=False)),
    "a460_pair_frictionless": Job(partial(a460_pair, friction=False), 12.0),
    "a460_pair_friction_unknown": Job(partial(a460_pair), 6.0),
    "a460_pair_friction_adapted": Job(partial(a460_pair, adapt_friction=True), 6.0),
    "a460_pair_full": Job(partial(a460_full_pair)),
    "a460_pair_full_alone": Job(partial(a460_full_pair, synchronized=False)),
    "planar_four_synchronized": Job(partial(planar_four)),
    "planar_four_independent": Job(partial(planar_four, synchronized=False)),
    "planar_four_synchronized_disturbed": Job(partial(planar_four, disturbance="torque")),
    "planar_four_independent_disturbed": Job(partial(planar_four, synchronized=False, disturbance="torque")),
    "planar_four_without_k_eps": Job(partial(planar_four, gains=GAINS.replace(K_eps=0.0))),
    "planar_four_without_adaptation": Job(partial(planar_four, gains=GAINS.replace(Gamma=0.0))),
    "planar_four_stiff": Job(partial(planar_four, synchronized=False, gains=STIFF)),
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


def judged(runs: Mapping[str, Result]) -> list[Comparison]:
    """The comparisons that runs of `judge_jobs` make."""
    pairs = [(run, runs.get(f"{name}_mujoco")) for name, run in runs.items()]
    return [compare_runs(ours, theirs) for ours, theirs in pairs if theirs is not None]


def run_all(folder: Path, workers: int = 2, jobs: Mapping[str, Job] = JOBS) -> dict[str, Result]:
    """Make all runs, with a progress bar each, and save each as soon as it is complete.

    Args:
        folder: where the `.npz` files go.
        workers: number of processes.
        jobs: the runs.

    Raises:
        SimulationError: a run had to stop; the others are saved, and of this one what was computed.
        ResultError: a file cannot be written.
    """
    context = get_context("spawn")
    lock = context.RLock()
    with ProcessPoolExecutor(workers, context, initializer=_share_lock, initargs=(lock,)) as pool:
        futures: dict[str, Future[Path]] = {
            name: pool.submit(_work, name, job, folder, place)
            for place, (name, job) in enumerate(jobs.items())
        }
        saved = {name: future.exception() or future.result() for name, future in futures.items()}
    for outcome in saved.values():
        if isinstance(outcome, BaseException):
            raise outcome
    return {name: Result.load(path) for name, path in saved.items() if isinstance(path, Path)}


def _work(name: str, job: Job, folder: Path, place: int) -> Path:
    """Make one run in a process of its own."""
    from tqdm import tqdm

    experiment = job.make()
    path = folder / f"{name}.npz"
    duration = job.duration or experiment.duration
    layout = "{desc:36} {percentage:3.0f}% |{bar}| {n:.1f}/{total:.0f} s"
    with tqdm(total=duration, desc=name, position=place, bar_format=layout, mininterval=0.2) as bar:
        progress = partial(_show, bar)
        try:
            return experiment.simulate(duration, plant=job.plant, progress=progress).save(path)
        except SimulationError as error:
            if error.result is not None:
                error.result.save(path)
                error.result = None  # too large to travel between processes, and safe on disk
            raise


def _show(bar: Any, t: float) -> None:
    bar.update(t - bar.n)


def _share_lock(lock: Any) -> None:
    """One lock for the bars of all processes."""
    from tqdm import tqdm

    tqdm.set_lock(lock)
