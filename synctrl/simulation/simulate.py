"""simulate: a cell under control, from its initial state to a Result.

Engines make runs with fixed steps, by the method of Runge and Kutta called "rk4". "pinocchio" is the
reference; "compiled" is the same closed loop as generated C. SciPy's methods choose their steps, and only
the reference has them; the last bits of "Radau" and "BDF", which solve linear systems, depend on the number
of threads of the BLAS library. The plant may be computed by "mujoco" instead of "pinocchio": it reads the
robots' URDF by itself and is an independent judge of the physics. With a control period torque and
adaptation are held in between, as on a digital controller, which only "rk4" follows. What is computed does
not depend on what is logged.

A run that has to stop raises a kind of `SimulationError`, which says why; an interrupt, as by Ctrl-C,
becomes a `RunInterrupted`. These, and whatever else of our errors ends a run that has begun, carry what was
computed as `.result`. A run that came to its end warns if torque was cut off while the controller went on
adapting, and if the step of "rk4" was too long: `info["step_error"]` then says which step does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import boolean, choice, instance, label, positive_number
from ..control.adaptation import Adaptation
from ..control.admittance import Admittance
from ..control.agent import Agent, agents_of
from ..control.controller import Controller
from ..control.discrete import DiscreteController
from ..control.gains import Gains
from ..control.laws import Law
from ..control.network import Communication, Network
from ..coupling.cell import Cell
from ..renamed import names_elsewhere
from .clock import TIE, make_clock, multiple
from .closed_loop import ClosedLoop
from .devices import Actuator, Devices, Sensor
from .engines import Engine, Run, carry_out
from .guard import Progress
from .limits import learning_within
from .log import keeping
from .plant import PHYSICS, Plant, torque_limits
from .result import Result
from .schedules import Disturbance, DisturbanceSchedule, Payload
from .step_error import StepError

#: the room of cell files, which is above this one
CELLS = "synctrl.cells"


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
        adaptation: how the controller learns; by default `Gradient(gains.Gamma)`, eq. (14), which is
            `bounded` if the plant saturates, so that estimates cannot run away.
        law: from errors to reference motion and force; by default `SunMills`.
        network: what the robots know of each other; by default `Ideal`.
        admittance: how they give way to the forces inside what they hold; by default they do not.
        sensors: what stands between the motion of the joints and a controller that samples it, in the order
            in which they measure; by default it knows all exactly.
        actuators: what stands between the torque that it asks for and the joints, in the order in which
            they act; by default nothing.

    Raises:
        InputError: a part that is none, does not fit the others, or gives arrays that do not fit the cell.
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
    network: Communication | None = None
    admittance: Admittance | None = None
    sensors: Sequence[Sensor] = ()
    actuators: Sequence[Actuator] = ()

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
        cell = self.told_cell
        body = self.plant_type(cell, physics=plant, payloads=self.payloads, saturate=self.saturate)
        gains, adaptation = learning_within(body, self.gains, self.adaptation)
        controller = Controller(
            cell,
            gains,
            adaptation=adaptation,
            law=self.law,
            network=self.network,
            admittance=self.admittance,
            torque_limits=torque_limits(cell) if self.saturate else None,
            reference_acceleration=self.reference_acceleration,
            k_r_space=self.k_r_space,
        )
        return ClosedLoop(controller, body, Devices(self.cell, self.sensors, self.actuators))

    @property
    def told_cell(self) -> Cell:
        """The cell as its robots are told of it, whose clocks the network may have put ahead."""
        if not isinstance(self.network, Network):
            return self.cell
        return self.cell.with_clocks(self.cell.clocks + self.network.clocks(self.cell.n))

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
        log_to: str | Path | None = None,
        log_dtype: str = "float64",
        rtol: float = 1e-9,
        atol: float = 1e-11,
        progress: Progress | None = None,
    ) -> Result:
        """Run it; the head of this module says more of engines, integrators and runs that stop.

        Args:
            duration: s; by default the experiment's.
            dt: step of "rk4", s.
            integrator: "rk4", or of SciPy's methods "RK45", "RK23", "DOP853", "Radau", "BDF" or "LSODA".
            engine: "pinocchio", "compiled" (the same as generated C), or an `Engine` of one's own.
            plant: library that computes the plant, "pinocchio" or "mujoco".
            control_period: None for continuous control; else how long torque is held, a multiple of dt, s.
            log_dt: interval of the log, a multiple of dt, s; by default dt. Every dt is watched all the same.
            log_to, log_dtype: a folder for files, not there yet; "float64" or "float32"; see `Result`.
            rtol, atol, progress: SciPy's tolerances; a function that is told the time reached, s.

        Raises:
            InputError, UnreachableError: a wrong value; a log without room; a path out of reach.
            MissingDependencyError, CompilationError: the compiled engine cannot be had, and why.
            SimulationError, RunInterrupted: the run had to stop, or was interrupted.

        Warns:
            SaturationWarning, StepWarning: torque was cut off; the step of "rk4" was too long.
            GainWarning, RobotWarning: forces inside may grow; nobody says if stated friction acts.
        """
        run = self.plan(duration, dt, control_period, plant, log_dt, log_to, log_dtype)
        return carry_out(run, integrator, engine, (rtol, atol), progress)

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

    def agents(self, period: float, **options: Any) -> tuple[Agent, ...]:
        """The same as one agent per robot, see `agents_of`; arguments and errors as of `controller`."""
        return agents_of(self.controller(period, **options))

    @classmethod
    def from_file(cls, path: str | Path) -> Experiment:
        """The experiment of a cell file, see `synctrl.cells.read_cell`, which says what is raised."""
        return import_module(CELLS).read_cell(path)

    def to_file(self, path: str | Path) -> Path:
        """Write this as a cell file, see `synctrl.cells.write_cell`, which says what is raised."""
        return import_module(CELLS).write_cell(self, path)

    def plan(
        self,
        duration: float | None,
        dt: float,
        control_period: float | None = None,
        plant: str = "pinocchio",
        log_dt: float | None = None,
        log_to: str | Path | None = None,
        log_dtype: str = "float64",
    ) -> Run:
        """Everything that a run needs; arguments as in `simulate`."""
        choice("plant", plant, tuple(PHYSICS))
        kept = keeping(log_to, log_dtype)
        duration = self.duration if duration is None else duration
        loop = self.closed_loop(plant)
        schedule = DisturbanceSchedule(self.cell, self.disturbances)
        edges = [*schedule.edges, *loop.plant.schedule.edges, *loop.events]
        devices = loop.devices.start(control_period)
        if control_period is None:
            edges += loop.messages.between(0.0, positive_number("duration", duration))
        else:
            edges += loop.devices.switches(control_period, duration)
        clock = make_clock(duration, dt, edges, loop.cell.breaks, log_dt)
        every = None if control_period is None else multiple("control_period", control_period, dt)
        info: dict[str, Any] = {"integrator": "rk4", "dt": float(dt), "duration": float(duration)}
        info["log_dt"], info["log_dtype"] = float(dt if log_dt is None else log_dt), kept.dtype
        info["engine"], info["plant"], info["saturate"] = "pinocchio", plant, bool(self.saturate)
        info["title"], info["control_period"] = self.title or self.cell.name, control_period
        info["start"] = list(self.cell.starts)
        info["friction"] = [member.friction_from for member in self.cell.members]
        info["disturbances"] = [disturbance.as_dict() for disturbance in self.disturbances]
        info["payloads"] = [payload.as_dict() for payload in self.payloads]
        events = [float(t) for t in np.sort(loop.events) if 0 <= t < clock.end - TIE * dt]
        info["events"] = [{"t": t, "part": type(loop.plant).__qualname__} for t in events]
        step_error = StepError(self.cell.n, self.cell.nv)
        return Run(self, loop, clock, schedule, every, info, step_error, devices, kept)


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
    network: Communication | None = None,
    admittance: Admittance | None = None,
    sensors: Sequence[Sensor] = (),
    actuators: Sequence[Actuator] = (),
    engine: str | Engine = "pinocchio",
    plant: str = "pinocchio",
    control_period: float | None = None,
    log_dt: float | None = None,
    log_to: str | Path | None = None,
    log_dtype: str = "float64",
    rtol: float = 1e-9,
    atol: float = 1e-11,
    progress: Progress | None = None,
) -> Result:
    """Run a cell under adaptive synchronized control: `Experiment(...).simulate(...)` in one call.

    The arguments are those of `Experiment` and of `Experiment.simulate`, which say what they mean, and what
    is raised and warned of.
    """
    given = dict(locals())  # every argument by its name
    experiment = Experiment(**{field.name: given.pop(field.name) for field in fields(Experiment)})
    return experiment.simulate(**given)


__getattr__ = names_elsewhere(__name__, ".engines", "run_reference")
