"""What is measured of one version of the package: jobs that run on this version and on earlier ones.

A job is a function of plain data that returns plain data. Times are CPU times, s, unless they are called
wall. What a version does not have fails, and the error says what.
"""

from __future__ import annotations

import os
import resource
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_cells import CELLS, joint_cell, joint_parts, planar_chain, planar_ring, ring_parts
from benchmark_features import A460, FEATURES

import synctrl
from synctrl import Experiment
from synctrl.experiments import a460_pair, planar_four

DT = 1e-3
MORE: dict[str, Callable[[], Experiment]] = {
    "sixteen Panda": lambda: joint_cell("panda", 16),
    "30 joints": lambda: planar_chain(30),
    A460: lambda: a460_pair(friction=False),
}
PARTS = {"planar arms": ring_parts, "UR5": partial(joint_parts, "ur5")}
#: a measurement has at most so many robot-steps, for they are all logged, but at least so many steps
MOST, FEWEST = 150_000, 60
#: bytes of tables that engines keep from one run to the next, with some to spare
KEPT = 28e6
#: where `Tables` has been, newest first
TABLES = "synctrl.compiled.tables", "synctrl.compiled.engine", "synctrl.simulation.compiled.engine"
#: share of the steps that a second run has: the difference is what steps cost without what comes before them
FEW = 0.2
#: robots from which on a run is timed while it goes, and how often it has to tell of itself for that
LARGE, TOLD = 500, 3
#: how often a measurement is repeated at most, because it is short
REPEATS = 8


def cell_named(name: str) -> Experiment:
    """An experiment by the name of its cell, as a ring of so many arms, or by that of a feature."""
    if name.startswith("ring of "):
        return planar_ring(int(name.rsplit(" ", 1)[1]))
    if name in FEATURES:
        return FEATURES[name].make()
    if name in CELLS or name in MORE:
        return (CELLS | MORE)[name]()
    return getattr(import_module("synctrl.experiments"), name)()


def engine(libraries: dict, width: int | None = None, kept: bool = False) -> Callable[..., Any]:
    """What takes a planned run through time as generated code.

    Args:
        libraries: what was loaded before.
        width: most lanes; by default the engine's choice.
        kept: whether what is desired is tabulated in the first run and looked up in others.
    """
    tables = _first_of("Tables", *TABLES)() if kept else None
    try:
        compiled = import_module("synctrl.compiled.engine").Compiled
    except ModuleNotFoundError:  # version 0.1
        run = import_module("synctrl.simulation.simulate").run_compiled
        return lambda planned, progress=None: run(planned, progress, libraries, tables)
    return compiled(libraries, tables, **({} if width is None else {"widest": width})).run


def _first_of(name: str, *modules: str) -> Any:
    """What the first of these modules that has it knows under a name."""
    for module in modules:
        with suppress(ModuleNotFoundError, AttributeError):
            return getattr(import_module(module), name)
    raise ImportError(f"no {name} in {', '.join(modules)}")


class Stepper:
    """Two runs of one experiment, of many steps and of few: their difference is what steps cost.

    Args:
        experiment: what is run.
        make: makes an engine.
        options: of the plan.
        seconds: how long a measurement takes, more or less.
        kept: whether tables are kept: then they have to be small enough.
    """

    def __init__(
        self, experiment: Experiment, make: Callable, options: dict[str, float], seconds: float, kept: bool
    ):
        self._plan = partial(self._planned, experiment, options)
        self._engines = make(), make()  # what one keeps is of one length
        self._seconds, self._large = seconds, experiment.cell.n >= LARGE
        self.steps = _enough(partial(self._run, 0), seconds, _most(experiment, kept))
        self.few = max(1, round(FEW * self.steps))
        for which, steps in enumerate((self.steps, self.few)):
            self._run(which, steps)

    def measure(self) -> float:
        """CPU time of a step, s."""
        if self._large and (found := self._on_the_way()):
            return found
        first = _seconds(partial(self._run, 0), self.steps)
        times = [first - _seconds(partial(self._run, 1), self.few)]
        for _ in range(min(REPEATS, int(self._seconds / max(first, 1e-9))) - 1):
            long = _seconds(partial(self._run, 0), self.steps)
            times.append(long - _seconds(partial(self._run, 1), self.few))
        return float(np.median(times)) / (self.steps - self.few)

    def _on_the_way(self) -> float:
        """CPU time of a step, s, from the first to the last time that a run tells of itself; 0 without.

        What comes before the first step of a large cell outweighs its steps: no difference of runs has them.
        """
        marks: list[tuple[float, float]] = []
        self._engines[0](self._plan(self.steps), lambda t: marks.append((t, time.process_time())))
        if len(marks) < TOLD:
            return 0.0
        (began, before), (ended, after) = marks[0], marks[-1]
        return (after - before) * DT / (ended - began)

    def _run(self, which: int, steps: int) -> None:
        self._engines[which](self._plan(steps))

    @staticmethod
    def _planned(experiment: Experiment, options: dict[str, float], steps: int) -> Any:
        return experiment.plan(steps * DT, DT, **options)


class Bench:
    """Jobs, and what they keep from one measurement to the next."""

    def __init__(self) -> None:
        self._cells: dict[str, Experiment] = {}
        self._libraries: dict = {}
        self._steppers: dict[tuple, Stepper] = {}
        self._results: dict[float, Any] = {}

    def hello(self) -> dict[str, Any]:
        """Where the package is that runs here."""
        return {"package": str(Path(synctrl.__file__).resolve())}

    def per_step(
        self,
        cell: str,
        seconds: float,
        width: int | None = None,
        kept: bool = False,
        options: dict[str, float] | None = None,
    ) -> dict[str, float]:
        """What a step costs without what a run costs before its first, and how many robots the cell has.

        Args:
            cell: see `cell_named`.
            seconds: how long the measurement takes, more or less.
            width, kept: see `engine`.
            options: of the plan of a run.
        """
        if cell not in self._cells:
            self._cells[cell] = cell_named(cell)
        experiment, key = self._cells[cell], (cell, width, kept, str(options))
        make = partial(engine, self._libraries, width, kept)
        if key not in self._steppers:
            self._steppers[key] = Stepper(experiment, make, options or {}, seconds, kept)
        return {"seconds": self._steppers[key].measure(), "robots": experiment.cell.n}

    def rollout(self, arm: str, seconds: float) -> dict[str, float]:
        """What a step of MuJoCo's `rollout` costs: RK4, open loop, one arm, one thread, all states kept."""
        import mujoco
        from mujoco import rollout

        from synctrl.simulation.mujoco import MujocoArm

        model = MujocoArm(synctrl.load_robot(arm)).model
        model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, DT
        data, kind = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
        start = np.zeros((1, mujoco.mj_stateSize(model, kind)))
        mujoco.mj_getState(model, data, start[0], kind)

        def run(steps: int) -> None:
            rollout.rollout(model, data, start, nstep=steps)

        steps = max(100, int(100_000 * seconds))
        return {"seconds": (_seconds(run, steps) - _seconds(run, steps // 5)) / (steps - steps // 5)}

    def certify(self, duration: float) -> dict[str, float]:
        """A certificate of a run of the four planar arms, which is made once."""
        if duration not in self._results:
            self._results[duration] = planar_four().simulate(duration, DT, engine="compiled")
        judge = import_module("synctrl.analysis.certify").certify
        return {"seconds": _seconds(judge, self._results[duration])}

    def first_step(self, kind: str, robots: int, duration: float) -> dict[str, float]:
        """From `Experiment(...)` until the library is back for the first time, and memory; in a new process.

        `build` is what the cell takes before that, and `memory` the process at its largest less what it had
        at first, bytes.
        """
        before, start, reached = _memory(), time.process_time(), []
        parts = PARTS[kind](robots)
        made = time.process_time()

        def progress(_: float) -> None:
            reached.append(time.process_time())

        Experiment(*parts).simulate(duration, DT, engine="compiled", progress=progress)
        seconds = {"seconds": reached[0] - made, "build": made - start}
        return {**seconds, "memory": _memory() - before, "base": before}

    def sweep(self, runs: int, duration: float, dt: float, workers: int) -> dict[str, float]:
        """A sweep of the four planar arms with all measures, from its first run to its table."""
        from synctrl.sweep import LogUniform, Sweep, Uniform, gain, model_error

        factors = [
            gain("beta", LogUniform(5, 150)), gain("K_eps", LogUniform(0.1, 10)),
            gain("Lambda", LogUniform(2, 50)), model_error(Uniform(-0.9, 0.5)),
        ]  # fmt: skip
        planar_four().simulate(0.01, dt, engine="compiled")
        with tempfile.TemporaryDirectory() as folder:
            start, before = time.perf_counter(), os.times()
            sweep = Sweep(planar_four(), factors, samples=runs, seed=0, duration=duration, dt=dt)
            backend = "serial" if workers == 1 else "joblib"
            sweep.run(Path(folder) / "sweep", workers, backend, progress=False)
            wall = time.perf_counter() - start
            _end_workers()
            return {"wall": wall, "seconds": _all_seconds() - sum(before[:4])}

    def compile(self, cell: str) -> dict[str, float]:
        """A first run of two steps on an empty cache, in a new process; the compiler's time counts."""
        experiment = cell_named(cell)
        if experiment.payloads:
            experiment = Experiment(experiment.cell, experiment.gains, experiment.duration)
        with tempfile.TemporaryDirectory() as cache:
            os.environ["SYNCTRL_CACHE"] = cache
            start, before = time.perf_counter(), _all_seconds()
            engine({})(experiment.plan(2 * DT, DT))
            return {"wall": time.perf_counter() - start, "seconds": _all_seconds() - before}


# -- internals --------------------------------------------------------------------------------------------


def _seconds(run: Callable[[Any], Any], argument: Any) -> float:
    """CPU time of a call, s."""
    start = time.process_time()
    run(argument)
    return time.process_time() - start


def _all_seconds() -> float:
    """CPU time of this process and of all that it started and that have ended, s."""
    return sum(os.times()[:4])


def _most(experiment: Experiment, kept: bool) -> int:
    """How many steps a measurement has at most."""
    cell = experiment.cell
    most = max(MOST // cell.n, FEWEST)
    weights = 0 if cell.coupling.is_constant else 4 * cell.m**2
    fitting = int(KEPT / (24 * cell.n * (4 * cell.m + weights)))  # three instants, four rows at most
    return max(10, min(most, fitting)) if kept else most


def _enough(run: Callable[[int], Any], seconds: float, most: int) -> int:
    """How many steps take about so long, and outweigh what comes before them."""
    run(5)  # code is generated and compiled in a first run
    steps = 10
    before = _seconds(run, 5)
    goal = max(seconds, before)
    while (spent := _seconds(run, steps) - before) < 0.2 * goal and steps < most:
        steps *= 2
    return int(np.clip(steps * goal / max(spent, 1e-9), 10, most))


def _memory() -> float:
    """Largest size of this process so far, bytes.

    Linux has it in a file; what `getrusage` says may be that of the process that started this one.
    """
    with suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(1024.0 * float(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _end_workers() -> None:
    """Let processes that wait for more work end, so that their CPU time counts."""
    try:
        from joblib.externals.loky import get_reusable_executor
    except ImportError:
        return
    get_reusable_executor(reuse=True).shutdown(wait=True)
