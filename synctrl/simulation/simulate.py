"""simulate: a cell under control, from its initial state to a Result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..checks import boolean, choice, instance, positive_number
from ..control.controller import Controller
from ..control.gains import Gains
from ..errors import InputError, SimulationError
from ..tasks.cell import Cell
from ..tasks.motion_checks import check_motions
from ..tasks.reachability import check_reachable
from .clock import Clock, make_clock
from .closed_loop import ClosedLoop
from .disturbances import Disturbance, DisturbanceSchedule
from .guard import Guard
from .integrators import ADAPTIVE, Sample, adaptive, rk4
from .payloads import Payload
from .plant import PHYSICS, Plant
from .recorder import Recorder, SampleRecorder
from .result import Result
from .sampled import sampled_rk4, steps_per_sample

if TYPE_CHECKING:
    from ctypes import CDLL

    from .compiled.engine import Tables

Progress = Callable[[float], Any]


@dataclass(frozen=True, eq=False)
class Experiment:
    """A cell with its controller and what disturbs it, ready to run.

    Args:
        cell: robots, task and coupling.
        gains: gains of the controller.
        duration: how long it runs unless told otherwise, s.
        disturbances: torques from outside.
        reference_acceleration: "exact" or "paper", see `Controller`.
        k_r_space: "joint" or "task", see `Controller`.
        title: for figures and files.
        payloads: what robots pick up and put down, of which the controller is not told.
        saturate: whether the plant cuts torques off at the limits of the robots' descriptions.
        plant_type: `Plant`, or a kind of plant with joints that the controller does not know.
    """

    cell: Cell
    gains: Gains
    duration: float
    disturbances: Sequence[Disturbance] = ()
    reference_acceleration: str = "exact"
    k_r_space: str = "joint"
    title: str | None = None
    payloads: Sequence[Payload] = ()
    saturate: bool = False
    plant_type: Callable[..., Plant] = Plant

    def __post_init__(self) -> None:
        instance("cell", self.cell, Cell, "a Cell")
        instance("gains", self.gains, Gains, "Gains")
        instance("title", self.title, (str, NoneType), "a text")
        positive_number("duration", self.duration)
        boolean("saturate", self.saturate)
        self.closed_loop()
        DisturbanceSchedule(self.cell, self.disturbances)

    def closed_loop(self, plant: str = "pinocchio") -> ClosedLoop:
        """The differential equation of this experiment; `plant` as in `simulate`."""
        controller = Controller(
            self.cell,
            self.gains,
            reference_acceleration=self.reference_acceleration,
            k_r_space=self.k_r_space,
        )
        body = self.plant_type(self.cell, physics=plant, payloads=self.payloads, saturate=self.saturate)
        return ClosedLoop(controller, body)

    def simulate(
        self,
        duration: float | None = None,
        dt: float = 1e-3,
        integrator: str = "rk4",
        *,
        engine: str = "pinocchio",
        plant: str = "pinocchio",
        control_period: float | None = None,
        rtol: float = 1e-9,
        atol: float = 1e-11,
        progress: Progress | None = None,
    ) -> Result:
        """Run it.

        Args:
            duration: s; by default the experiment's.
            dt: step of "rk4" and interval of the log, s.
            integrator: "rk4", or a method of SciPy's solve_ivp: "RK45", "RK23", "DOP853", "Radau", "BDF",
                "LSODA".
            engine: "pinocchio", the reference, or "compiled": the same closed loop as generated C, for "rk4".
            plant: library that computes the plant: "pinocchio", or "mujoco", which reads the robots' URDF by
                itself and is an independent judge of the physics.
            control_period: None for continuous control; otherwise torque and adaptation are held for this
                long, a multiple of dt, s. Only with "rk4".
            rtol, atol: tolerances of SciPy's methods.
            progress: called now and then with the time reached, s.

        Raises:
            InputError: a duration, step, period or tolerance that is not positive, an unknown integrator or
                engine, or a combination that does not exist.
            UnreachableError: a robot cannot reach its desired positions; raised before anything runs.
            MissingDependencyError, CompilationError: the compiled engine cannot be had, and why.
            SimulationError: the run had to stop; its kinds say why, and it carries what was computed.
        """
        choice("integrator", integrator, ("rk4", *ADAPTIVE))
        choice("engine", engine, ("pinocchio", "compiled"))
        if progress is not None and not callable(progress):
            raise InputError(f"progress: expected a function of the time reached, found {progress!r}")
        choice("plant", plant, tuple(PHYSICS))
        tolerances = positive_number("rtol", rtol), positive_number("atol", atol)
        run = self.plan(duration, dt, control_period, plant)
        run.check()
        if integrator != "rk4":
            _needs_rk4(integrator, engine, control_period)
            run.info.update(integrator=integrator, rtol=tolerances[0], atol=tolerances[1])
            return _collect(
                run, adaptive(run.loop, run.clock, run.schedule, integrator, *tolerances), progress
            )
        if engine == "compiled":
            return run_compiled(run, progress)
        return run_reference(run, progress)

    def plan(
        self, duration: float | None, dt: float, control_period: float | None = None, plant: str = "pinocchio"
    ) -> Run:
        """Everything that a run needs; arguments as in `simulate`."""
        duration = self.duration if duration is None else duration
        loop = self.closed_loop(plant)
        schedule = DisturbanceSchedule(self.cell, self.disturbances)
        clock = make_clock(duration, dt, (*schedule.edges, *loop.plant.schedule.edges), self.cell.breaks)
        every = None if control_period is None else steps_per_sample(control_period, dt)
        info: dict[str, Any] = {"integrator": "rk4", "dt": float(dt), "duration": float(duration)}
        info["engine"] = "pinocchio"
        info["plant"], info["saturate"] = plant, bool(self.saturate)
        info["title"] = self.title or self.cell.name
        info["control_period"] = control_period
        info["disturbances"] = [_describe(d) for d in self.disturbances]
        info["payloads"] = [payload.as_dict() for payload in self.payloads]
        return Run(self, loop, clock, schedule, every, info)


class Run(NamedTuple):
    """A run that is about to start.

    `every` is how many logged instants a sample of sampled control lasts, or None.
    """

    experiment: Experiment
    loop: ClosedLoop
    clock: Clock
    schedule: DisturbanceSchedule
    every: int | None
    info: dict[str, Any]

    def check(self) -> None:
        """Look ahead, before anything runs.

        Raises:
            TrajectoryError: a desired velocity or acceleration that does not fit the motion.
            UnreachableError: a robot cannot reach its desired positions.
            CouplingError: a weight loses its inverse on the way, or its derivatives do not fit.
            MissingDependencyError, InputError: a library cannot compute the plant, or refuses a robot.
        """
        cell = self.experiment.cell
        self.loop.plant.prepare()
        check_motions(cell, self.clock.logged)
        check_reachable(cell, self.clock.logged)
        cell.coupling.check_weights(self.clock.logged, cell.m)


def simulate(
    cell: Cell,
    gains: Gains,
    duration: float,
    dt: float = 1e-3,
    integrator: str = "rk4",
    *,
    disturbances: Sequence[Disturbance] = (),
    reference_acceleration: str = "exact",
    k_r_space: str = "joint",
    engine: str = "pinocchio",
    plant: str = "pinocchio",
    progress: Progress | None = None,
) -> Result:
    """Run a cell under adaptive synchronized control: `Experiment(...).simulate(...)` in one call."""
    experiment = Experiment(cell, gains, duration, disturbances, reference_acceleration, k_r_space)
    return experiment.simulate(dt=dt, integrator=integrator, engine=engine, plant=plant, progress=progress)


def _needs_rk4(integrator: str, engine: str, control_period: float | None) -> None:
    if engine == "compiled":
        raise InputError(f"engine='compiled' has the integrator 'rk4' only, found {integrator!r}")
    if control_period is not None:
        raise InputError(f"control_period: sampled control needs the integrator 'rk4', found {integrator!r}")


def _needs_plain_plant(plant: Plant) -> None:
    special = {
        f"plant='{plant.physics}'": plant.physics != "pinocchio",
        "saturation": plant.saturate,
        "payloads": bool(plant.payloads),
        type(plant).__name__: type(plant) is not Plant,
    }
    for name in (name for name, found in special.items() if found):
        raise InputError(f"engine='compiled' does not have {name}; use engine='pinocchio'")


def _collect(run: Run, samples: Iterator[Sample], progress: Progress | None) -> Result:
    """Log samples one by one."""
    recorder, guard = SampleRecorder(run.loop, len(run.clock.logged)), Guard(run.loop)

    def log() -> None:
        for sample in samples:
            guard.check(sample)
            recorder.add(sample)
            if progress is not None:
                progress(sample.t)

    return _finish(run, recorder, log)


def run_reference(run: Run, progress: Progress | None = None) -> Result:
    """A planned run by the reference engine and the fixed-step integrator."""
    if run.every is not None:
        return _collect(run, sampled_rk4(run.loop, run.clock, run.schedule, run.every), progress)
    return _collect(run, rk4(run.loop, run.clock, run.schedule), progress)


def run_compiled(
    run: Run,
    progress: Progress | None = None,
    libraries: dict[str, CDLL] | None = None,
    tables: Tables | None = None,
) -> Result:
    """A planned run by generated code; `libraries` and `tables` are what earlier runs have left."""
    from .compiled.engine import advance
    from .compiled.program import Program

    _needs_plain_plant(run.loop.plant)
    run.info["engine"] = "compiled"
    recorder, program = Recorder(run.loop, len(run.clock.logged)), Program(run.loop, libraries)
    return _finish(
        run,
        recorder,
        lambda: advance(program, run.clock, run.schedule, recorder, run.every, progress, tables),
    )


def _finish(run: Run, recorder: Recorder, log: Callable[[], None]) -> Result:
    """Let a run log itself; a failure takes along what was logged."""
    with np.errstate(all="ignore"):  # overflow is found and named by the guard
        try:
            log()
        except SimulationError as error:
            error.result = recorder.result(f"stopped: {error}", run.info, run.experiment)
            raise
    return recorder.result("completed", run.info, run.experiment)


def _describe(disturbance: Disturbance) -> dict[str, Any]:
    return {
        "robot": int(disturbance.robot),
        "torque": disturbance.torque.tolist(),
        "start": float(disturbance.start),
        "stop": float(disturbance.stop),
    }
