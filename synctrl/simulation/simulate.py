"""simulate: a cell under control, from its initial state to a Result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import choice, instance, positive_number
from ..control.controller import Controller
from ..control.gains import Gains
from ..errors import InputError, SimulationError
from ..tasks.cell import Cell
from ..tasks.reachability import check_reachable
from .clock import Clock, make_clock
from .closed_loop import ClosedLoop
from .disturbances import Disturbance, DisturbanceSchedule
from .guard import Guard
from .integrators import ADAPTIVE, Sample, adaptive, rk4
from .plant import Plant
from .recorder import Recorder
from .result import Result
from .sampled import sampled_rk4, steps_per_sample

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
    """

    cell: Cell
    gains: Gains
    duration: float
    disturbances: Sequence[Disturbance] = ()
    reference_acceleration: str = "exact"
    k_r_space: str = "joint"
    title: str | None = None

    def __post_init__(self) -> None:
        instance("cell", self.cell, Cell, "a Cell")
        instance("gains", self.gains, Gains, "Gains")
        positive_number("duration", self.duration)
        self.closed_loop()
        DisturbanceSchedule(self.cell, self.disturbances)

    def closed_loop(self) -> ClosedLoop:
        """The differential equation of this experiment."""
        controller = Controller(
            self.cell,
            self.gains,
            reference_acceleration=self.reference_acceleration,
            k_r_space=self.k_r_space,
        )
        return ClosedLoop(controller, Plant(self.cell))

    def simulate(
        self,
        duration: float | None = None,
        dt: float = 1e-3,
        integrator: str = "rk4",
        *,
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
            control_period: None for continuous control; otherwise torque and adaptation are held for this
                long, a multiple of dt, s. Only with "rk4".
            rtol, atol: tolerances of SciPy's methods.
            progress: called with the time reached, s, at every logged instant.

        Raises:
            InputError: a duration, step, period or tolerance that is not positive, an unknown integrator, or
                sampled control with another integrator than "rk4".
            UnreachableError: a robot cannot reach its desired positions; raised before anything runs.
            NonFiniteError, SingularJacobianError: the run had to stop; the error carries what was computed.
        """
        choice("integrator", integrator, ("rk4", *ADAPTIVE))
        tolerances = positive_number("rtol", rtol), positive_number("atol", atol)
        duration = self.duration if duration is None else duration
        schedule = DisturbanceSchedule(self.cell, self.disturbances)
        clock = make_clock(duration, dt, (*schedule.edges, *self.cell.breaks))
        check_reachable(self.cell, clock.logged)
        info: dict[str, Any] = {"integrator": integrator, "dt": float(dt), "duration": float(duration)}
        info["title"] = self.title or self.cell.name
        info["disturbances"] = [_describe(d) for d in self.disturbances]
        loop = self.closed_loop()
        if control_period is not None:
            info["control_period"] = control_period
            samples = _sampled(loop, clock, schedule, integrator, control_period, dt)
        elif integrator == "rk4":
            samples = rk4(loop, clock, schedule)
        else:
            samples = adaptive(loop, clock, schedule, integrator, *tolerances)
            info["rtol"], info["atol"] = tolerances
        return _run(self, loop, clock, samples, info, progress)


def _sampled(
    loop: ClosedLoop,
    clock: Clock,
    schedule: DisturbanceSchedule,
    integrator: str,
    period: float,
    dt: float,
) -> Iterator[Sample]:
    if integrator != "rk4":
        raise InputError(f"control_period: sampled control needs the integrator 'rk4', found {integrator!r}")
    return sampled_rk4(loop, clock, schedule, steps_per_sample(period, dt) * dt)


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
    progress: Progress | None = None,
) -> Result:
    """Run a cell under adaptive synchronized control: `Experiment(...).simulate(...)` in one call."""
    experiment = Experiment(cell, gains, duration, disturbances, reference_acceleration, k_r_space)
    return experiment.simulate(dt=dt, integrator=integrator, progress=progress)


def _run(
    experiment: Experiment,
    loop: ClosedLoop,
    clock: Clock,
    samples: Iterator[Sample],
    info: dict[str, Any],
    progress: Progress | None,
) -> Result:
    """Collect samples; a failure takes along what was collected."""
    recorder, guard = Recorder(loop, len(clock.logged)), Guard(loop)
    with np.errstate(all="ignore"):  # overflow is found and named by the guard
        try:
            for sample in samples:
                guard.check(sample)
                recorder.add(sample)
                if progress is not None:
                    progress(sample.t)
        except SimulationError as error:
            error.result = recorder.result(f"stopped: {error}", info, experiment)
            raise
    return recorder.result("completed", info, experiment)


def _describe(disturbance: Disturbance) -> dict[str, Any]:
    return {
        "robot": int(disturbance.robot),
        "torque": disturbance.torque.tolist(),
        "start": float(disturbance.start),
        "stop": float(disturbance.stop),
    }
