"""simulate: a cell under control, from its initial state to a Result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..checks import boolean, choice, instance, label, positive_number
from ..control.adaptation import Adaptation
from ..control.controller import Controller
from ..control.discrete import DiscreteController
from ..control.gains import Gains
from ..control.laws import Law
from ..control.network import Network
from ..coupling.cell import Cell
from ..errors import InputError
from ..renamed import names_elsewhere
from .clock import TIE, make_clock
from .closed_loop import ClosedLoop
from .disturbances import Disturbance, DisturbanceSchedule
from .engines import Engine, find_engine
from .handover import Progress
from .integrators import ADAPTIVE
from .payloads import Payload
from .plant import PHYSICS, Plant
from .result import Result
from .run import Run, run_adaptive
from .sampled import steps_per_sample
from .saturation import warn_of_saturation
from .step_error import StepError, warn_of_step


@dataclass(frozen=True, eq=False)
class Experiment:
    """A cell with its controller and what disturbs it, ready to run.

    Args:
        cell: robots, task and coupling.
        gains: gains of the controller.
        duration: how long it runs unless told otherwise, s.
        disturbances: torques from outside.
        reference_acceleration: "exact" or "paper", shorthand for the option of `SunMills`.
        k_r_space: "joint" or "task", where the damping acts, see `Controller`.
        title: for figures and files.
        payloads: what robots pick up and put down, of which the controller is not told.
        saturate: whether the plant cuts torques off at the limits of the robots' descriptions.
        plant_type: `Plant`, or a kind of plant with a state of its own.
        adaptation: how the controller learns; by default `Gradient(gains.Gamma)`, eq. (14).
        law: from errors to reference motion and force; by default `SunMills`.
        network: what the robots know of each other; by default `Ideal`.
    """

    cell: Cell
    gains: Gains
    duration: float
    disturbances: Sequence[Disturbance] = ()
    reference_acceleration: str | None = None
    k_r_space: str | None = None
    title: str | None = None
    payloads: Sequence[Payload] = ()
    saturate: bool = False
    plant_type: Callable[..., Plant] = Plant
    adaptation: Adaptation | None = None
    law: Law | None = None
    network: Network | None = None

    def __post_init__(self) -> None:
        instance("cell", self.cell, Cell, "a Cell")
        instance("gains", self.gains, Gains, "Gains")
        if self.title is not None:
            label("title", self.title)
        positive_number("duration", self.duration)
        boolean("saturate", self.saturate)
        self.closed_loop()
        DisturbanceSchedule(self.cell, self.disturbances)

    def closed_loop(self, plant: str = "pinocchio") -> ClosedLoop:
        """The differential equation of this experiment; `plant` as in `simulate`."""
        controller = Controller(
            self.cell,
            self.gains,
            adaptation=self.adaptation,
            law=self.law,
            network=self.network,
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
        engine: str | Engine = "pinocchio",
        plant: str = "pinocchio",
        control_period: float | None = None,
        log_dt: float | None = None,
        rtol: float = 1e-9,
        atol: float = 1e-11,
        progress: Progress | None = None,
    ) -> Result:
        """Run it.

        Args:
            duration: s; by default the experiment's.
            dt: step of "rk4", s.
            integrator: "rk4", or a method of SciPy's solve_ivp: "RK45", "RK23", "DOP853", "Radau", "BDF",
                "LSODA". The last bits of "Radau" and "BDF", which solve linear systems, depend on the number
                of threads of the BLAS library.
            engine: "pinocchio", the reference, or "compiled": the same closed loop as generated C, for "rk4";
                or an `Engine` of one's own.
            plant: library that computes the plant: "pinocchio", or "mujoco", which reads the robots' URDF by
                itself and is an independent judge of the physics.
            control_period: None for continuous control; otherwise torque and adaptation are held for this
                long, a multiple of dt, s. Only with "rk4".
            log_dt: interval of the log, a multiple of dt, s; by default dt. What is computed does not depend
                on it, and every dt is watched.
            rtol, atol: tolerances of SciPy's methods.
            progress: called now and then with the time reached, s.

        Raises:
            InputError: a duration, step, period, interval or tolerance that is not positive, an unknown
                integrator or engine, a combination that does not exist, or a log that does not fit into
                memory.
            UnreachableError: a robot cannot reach its desired positions; raised before anything runs.
            MissingDependencyError, CompilationError: the compiled engine cannot be had, and why.
            SimulationError: the run had to stop; its kinds say why. This and whatever else of our errors ends
                a run that has begun carries what was computed as `.result`.
            RunInterrupted: by Ctrl-C, or another KeyboardInterrupt; it carries the same.

        Warns:
            SaturationWarning: torque was cut off while the controller went on adapting.
            StepWarning: the step of "rk4" was too long, and which one does; `info["step_error"]` says more.
        """
        choice("integrator", integrator, ("rk4", *ADAPTIVE))
        by = find_engine(engine)
        if progress is not None and not callable(progress):
            raise InputError(f"progress: expected a function of the time reached, found {progress!r}")
        choice("plant", plant, tuple(PHYSICS))
        tolerances = positive_number("rtol", rtol), positive_number("atol", atol)
        run = self.plan(duration, dt, control_period, plant, log_dt)
        if integrator != "rk4":
            _needs_rk4(integrator, engine, control_period)
        elif (reason := by.refuses(run)) is not None:
            raise InputError(reason)
        run.check()
        if integrator != "rk4":
            result = run_adaptive(run, integrator, *tolerances, progress)
        else:
            result = by.run(run, progress)
        warn_of_step(result.info["step_error"], result.names, dt)
        warn_of_saturation(result)
        return result

    def controller(
        self, period: float, *, include_gravity: bool = True, faults: str = "error"
    ) -> DiscreteController:
        """This experiment's controller for a loop of one's own, see `DiscreteController`.

        Torque is cut off at the limits of the robots' descriptions if the experiment saturates.

        Args:
            period: time between two calls of its `step`, s.
            include_gravity: False for robots that add the torque of gravity by themselves.
            faults: "error" or "hold".

        Raises:
            InputError: a period that is not positive, or an unknown word.
        """
        loop = self.closed_loop()
        limits = loop.plant.torque_limits if self.saturate else None
        return DiscreteController(
            loop.controller, period, torque_limits=limits, include_gravity=include_gravity, faults=faults
        )

    def plan(
        self,
        duration: float | None,
        dt: float,
        control_period: float | None = None,
        plant: str = "pinocchio",
        log_dt: float | None = None,
    ) -> Run:
        """Everything that a run needs; arguments as in `simulate`."""
        duration = self.duration if duration is None else duration
        loop = self.closed_loop(plant)
        schedule = DisturbanceSchedule(self.cell, self.disturbances)
        edges = [*schedule.edges, *loop.plant.schedule.edges, *loop.events]
        if control_period is None:
            edges += loop.messages.between(0.0, positive_number("duration", duration))
        clock = make_clock(duration, dt, edges, self.cell.breaks, log_dt)
        every = None if control_period is None else steps_per_sample(control_period, dt)
        info: dict[str, Any] = {"integrator": "rk4", "dt": float(dt), "duration": float(duration)}
        info["log_dt"] = float(dt if log_dt is None else log_dt)
        info["engine"] = "pinocchio"
        info["plant"], info["saturate"] = plant, bool(self.saturate)
        info["title"] = self.title or self.cell.name
        info["control_period"] = control_period
        info["disturbances"] = [_describe(d) for d in self.disturbances]
        info["payloads"] = [payload.as_dict() for payload in self.payloads]
        info["events"] = loop.events_within(clock.end - TIE * dt)
        return Run(self, loop, clock, schedule, every, info, StepError(self.cell.n, self.cell.nv))


def simulate(
    cell: Cell,
    gains: Gains,
    duration: float,
    dt: float = 1e-3,
    integrator: str = "rk4",
    *,
    disturbances: Sequence[Disturbance] = (),
    reference_acceleration: str | None = None,
    k_r_space: str | None = None,
    title: str | None = None,
    payloads: Sequence[Payload] = (),
    saturate: bool = False,
    plant_type: Callable[..., Plant] = Plant,
    adaptation: Adaptation | None = None,
    law: Law | None = None,
    network: Network | None = None,
    engine: str | Engine = "pinocchio",
    plant: str = "pinocchio",
    control_period: float | None = None,
    log_dt: float | None = None,
    rtol: float = 1e-9,
    atol: float = 1e-11,
    progress: Progress | None = None,
) -> Result:
    """Run a cell under adaptive synchronized control: `Experiment(...).simulate(...)` in one call.

    Args:
        cell, gains, duration: as in `Experiment`.
        disturbances, reference_acceleration, k_r_space, title: as in `Experiment`.
        payloads, saturate, plant_type, adaptation, law, network: as in `Experiment`.
        dt, integrator, engine, plant, control_period, log_dt: as in `Experiment.simulate`.
        rtol, atol, progress: as in `Experiment.simulate`.

    Raises:
        SynctrlError: see `Experiment` and `Experiment.simulate`.
        RunInterrupted: by Ctrl-C.
    """
    experiment = Experiment(
        cell,
        gains,
        duration,
        disturbances,
        reference_acceleration,
        k_r_space,
        title,
        payloads,
        saturate,
        plant_type,
        adaptation,
        law,
        network,
    )
    return experiment.simulate(
        dt=dt,
        integrator=integrator,
        engine=engine,
        plant=plant,
        control_period=control_period,
        log_dt=log_dt,
        rtol=rtol,
        atol=atol,
        progress=progress,
    )


def _needs_rk4(integrator: str, engine: str | Engine, control_period: float | None) -> None:
    if engine != "pinocchio":
        raise InputError(f"engine={engine!r} has the integrator 'rk4' only, found {integrator!r}")
    if control_period is not None:
        raise InputError(f"control_period: sampled control needs the integrator 'rk4', found {integrator!r}")


def _describe(disturbance: Disturbance) -> dict[str, Any]:
    return {
        "robot": int(disturbance.robot),
        "torque": disturbance.torque.tolist(),
        "start": float(disturbance.start),
        "stop": float(disturbance.stop),
    }


__getattr__ = names_elsewhere(__name__, ".run", "run_reference")
