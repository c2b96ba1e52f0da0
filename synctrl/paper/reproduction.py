"""All runs of the paper's section V, and those that its claims are checked against: which, and how made."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import Self

from ..compiled.build import require_casadi
from ..compiled.compiler import compiler
from ..errors import GainWarning, MissingDependencyError, SimulationError, StepWarning
from ..experiments.a460_pair import a460_full_pair, a460_pair
from ..experiments.planar_four import GAINS, planar_four
from ..files import reported
from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .judge import DURATION as JUDGED_DURATION
from .judge import Agreement, compare_runs, joint_pair
from .processes import Processes, processes, report
from .saved_runs import SavedRuns

LAYOUT = "{desc:36} {percentage:3.0f}% |{bar}| {n:.1f}/{total:g} s  [{elapsed}]"
INTERVAL = 0.1  # s between two reports of a run


@dataclass(frozen=True)
class PlannedRun:
    """A run to be made: how its experiment is built, how long it takes, and what computes the plant.

    `dt`, `log_dt`, s, and `engine` are those of `Experiment.simulate`.
    """

    make: Callable[[], Experiment]
    duration: float | None = None
    plant: str = "pinocchio"
    dt: float = 1e-3
    log_dt: float | None = None
    engine: str = "pinocchio"

    def shortened(self, duration: float) -> Self:
        """This run, cut off where it would take longer than `duration`, s."""
        return replace(self, duration=min(duration, self.duration or self.make().duration))

    def possible(self) -> Self:
        """This run, by the reference engine where there is no CasADi or no compiler for the compiled one."""
        return replace(self, engine=fastest_engine()) if self.engine == "compiled" else self


def fastest_engine() -> str:
    """The compiled engine, or the reference engine on a machine without CasADi or a C compiler."""
    try:
        require_casadi()
        compiler()
    except MissingDependencyError:
        return "pinocchio"
    return "compiled"


def run_all(folder: Path, workers: int, planned: Mapping[str, PlannedRun]) -> SavedRuns:
    """Make runs, with a progress bar each in simulated seconds, and save each as soon as it is complete.

    Args:
        folder: where the `.npz` files go.
        workers: number of processes.
        planned: the runs by name, which is also that of the file.

    Raises:
        SimulationError: a run had to stop, or its process was killed; the others are saved, and of a run that
            stopped what was computed.
        ResultError: a file cannot be written.
    """
    with processes(workers) as pool:
        return finished(pool, begun(pool, folder, planned), folder)


def begun(pool: Processes, folder: Path, planned: Mapping[str, PlannedRun]) -> dict[str, Future[Path]]:
    """`run_all` as far as giving the runs to processes; those that take longest, by their engine, are first.

    Raises:
        ResultError: nothing can be written into the folder.
    """
    with reported("write into the folder", folder):  # before anything runs
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    order = sorted(planned, key=lambda name: planned[name].engine == "compiled")
    futures = {name: pool.submit(_work, name, planned[name], folder) for name in order}
    return {name: futures[name] for name in planned}


def finished(pool: Processes, futures: Mapping[str, Future[Path]], folder: Path) -> SavedRuns:
    """The runs that were `begun`, when all are complete.

    Raises:
        SimulationError, ResultError: as of `run_all`.
    """
    _watch(futures, pool)
    for name, future in futures.items():
        error = future.exception()
        if isinstance(error, BrokenExecutor):
            ended = SimulationError(f"the process of run '{name}' ended without a result: was it killed?")
            raise ended.about(name)
        if error is not None:
            raise error
    return SavedRuns(folder, futures)


def _watch(futures: Mapping[str, Future[Path]], pool: Processes) -> None:
    """Draw a bar for every run until all are done."""
    with _bars() as draw:
        done = False
        while not done:
            done = all(future.done() for future in futures.values())
            for event in pool.reports():
                draw(*event)
            time.sleep(0 if done else INTERVAL)


@contextmanager
def _bars() -> Iterator[Callable[[str, float, float], None]]:
    """A function that draws how far a run is, given its name and two times; only ends without a terminal."""
    import sys

    from tqdm import tqdm

    bars: dict[str, tqdm] = {}
    pause = INTERVAL if sys.stderr.isatty() else float("inf")

    def draw(name: str, t: float, duration: float) -> None:
        if name not in bars:
            bars[name] = tqdm(total=duration, desc=name, bar_format=LAYOUT, mininterval=pause, leave=True)
        bars[name].update(t - bars[name].n)
        if t >= duration:
            bars[name].close()

    try:
        yield draw
    finally:
        for bar in bars.values():
            bar.close()


def _work(name: str, run: PlannedRun, folder: Path) -> Path:
    """Make one run, in one of the processes."""
    experiment, path = run.make(), folder / f"{name}.npz"
    duration = run.duration or experiment.duration
    try:
        progress = _reporter(name, duration)
        with warnings.catch_warnings():
            for known in (StepWarning, GainWarning):  # what the page has sections on
                warnings.simplefilter("ignore", known)
            made = experiment.simulate(
                duration, run.dt, plant=run.plant, engine=run.engine, log_dt=run.log_dt, progress=progress
            )
            return made.save(path)
    except SimulationError as error:
        if error.result is not None:
            error.result.save(path)
            error.result = None  # too large to travel between processes, and safe on disk
        raise


def _reporter(name: str, duration: float) -> Callable[[float], None]:
    """A function that reports how far a run is, now and then, and its end."""
    last = -INTERVAL

    def progress(t: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= INTERVAL or t >= duration:
            last = now
            report(name, t, duration)

    return progress


#: Lambda + beta of the paper's four arms: what an independent controller could be given instead, 1/s
STIFF = GAINS.replace(Lambda=110.0)
#: in which the errors of the undisturbed arms have their peaks, s
PEAKS = 1.0
#: long enough to see what is left of errors after the motion, s
LONG = 12.0
_run = partial(PlannedRun, engine="compiled")
_left = partial(_run, duration=LONG, log_dt=1e-2)

PLANNED: Mapping[str, PlannedRun] = {
    "a460_pair_synchronized": _run(a460_pair),
    "a460_pair_independent": _run(partial(a460_pair, synchronized=False)),
    "a460_pair_frictionless": _run(partial(a460_pair, friction=False), 8.0),
    "a460_pair_friction_unknown": _run(a460_pair, 6.0),
    "a460_pair_friction_adapted": _run(partial(a460_pair, adapt_friction=True), 6.0),
    "a460_pair_left_both": _left(a460_pair),
    "a460_pair_left_friction": _left(partial(a460_pair, gravity=False)),
    "a460_pair_left_gravity": _left(partial(a460_pair, friction=False)),
    "a460_pair_left_neither": _left(partial(a460_pair, friction=False, gravity=False)),
    # wrists that PID controllers hold are a plant that is not compiled
    "a460_pair_full": PlannedRun(a460_full_pair),
    "a460_pair_full_alone": PlannedRun(partial(a460_full_pair, synchronized=False)),
    "planar_four_synchronized": _run(planar_four),
    "planar_four_independent": _run(partial(planar_four, synchronized=False)),
    # its balance of V, with an edge of the push, asks for a shorter step than the others
    "planar_four_synchronized_disturbed": _run(partial(planar_four, disturbance="torque"), dt=5e-4),
    "planar_four_independent_disturbed": _run(partial(planar_four, synchronized=False, disturbance="torque")),
    "planar_four_without_k_eps": _run(partial(planar_four, gains=GAINS.replace(K_eps=0.0))),
    "planar_four_without_adaptation": _run(partial(planar_four, gains=GAINS.replace(Gamma=0.0))),
    "planar_four_stiff": _run(partial(planar_four, synchronized=False, gains=STIFF), PEAKS),
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


__getattr__ = names_elsewhere(
    __name__, ".reproduction", Job="PlannedRun", JOBS="PLANNED", judge_jobs="judge_runs"
)
