"""A planned run, and the engines that take it through time; whatever ends it hands over what was computed.

Engines have names in one table, or are a user's own: objects with `refuses` and `run`. If an engine makes
steps of its own, a `Solver` is all that it needs: `run.samples(solver)` carries it through time and events,
and `collect` watches and logs. Others find the closed loop in `run.loop`, instants in `run.clock` and pushes
in `run.schedule`, and give `collect` samples of their own making.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..checks import choice, positive_number
from ..coupling.member_checks import warn_of_unasked_friction
from ..coupling.reachability import SAMPLES, check_motions, check_reachable
from ..errors import InputError, RunInterrupted, SimulationError, SynctrlError
from .advance import Sample, Solver, advance
from .clock import Clock
from .closed_loop import ClosedLoop
from .controls import Continuous, Sampled
from .devices import LiveDevices
from .diagnosis import diagnosed
from .guard import Guard, Progress, date, report_time, user_failure
from .integrators import ADAPTIVE, RungeKutta, Scipy, check_method
from .limits import warn_of_saturation
from .recorder import NOTHING, Recorder
from .result import Result
from .schedules import DisturbanceSchedule
from .step_error import StepError, step_report, warn_of_step

#: instants at which weights are looked at before a run, at most
WEIGHT_SAMPLES = 2000


class Run(NamedTuple):
    """A run that is about to start.

    `every` is how many steps of dt a sample of sampled control lasts, or None; `experiment` is what the
    result will know as its own; `step_error` learns what the worst step was; `devices` are sensors and
    actuators at the beginning of the run.
    """

    experiment: Any
    loop: ClosedLoop
    clock: Clock
    schedule: DisturbanceSchedule
    every: int | None
    info: dict[str, Any]
    step_error: StepError
    devices: LiveDevices

    def check(self) -> None:
        """Look ahead, before anything runs.

        Raises:
            TrajectoryError: a desired velocity or acceleration that does not fit the motion.
            UnreachableError: a robot cannot reach its desired positions.
            CouplingError: a weight loses its inverse on the way, or its derivatives do not fit.
            MissingDependencyError, InputError: a library cannot compute the plant, or refuses a robot.
            RunInterrupted: by Ctrl-C.
        """
        cell = self.loop.cell
        with before_the_start(self):
            self.loop.plant.check_robots()
            self.loop.check_plant()
            check_motions(cell, np.array([0.0, self.clock.end]))
            check_reachable(cell, self.clock.spread(SAMPLES))
            with suppress(SimulationError):  # weights that fail end the run, which hands over what it has
                cell.coupling.check_weights(self.clock.spread(WEIGHT_SAMPLES), cell.m)

    def check_step(self) -> None:
        """Refuse a step of "rk4" that is too long for what the plant connects the robots with.

        Raises:
            InputError: with the step that would do.
        """
        controller, dt = self.loop.controller, float(self.info["dt"])
        joint = controller.k_r_space == "joint"
        limit = self.loop.plant.longest_step(controller.K_r if joint else np.zeros(self.loop.cell.v0.shape))
        if dt > limit:
            raise InputError(
                f"expected at most {limit:.2g} s, beyond which {type(self.loop.plant).__qualname__} is "
                f"unstable, found {dt:g}",
                subject="dt",
                found=dt,
            )

    def samples(self, solver: Solver) -> Iterator[Sample]:
        """What a solver makes of this run, see `advance`."""
        loop, clock = self.loop, self.clock
        if self.every is None:
            return advance(loop, clock, self.schedule, Continuous(loop, clock, self.step_error), solver)
        period = float(self.info["control_period"])
        control = Sampled(loop, clock, self.every, period, self.step_error, self.devices)
        return advance(loop, clock, self.schedule, control, solver)


def run_reference(run: Run, progress: Progress | None = None) -> Result:
    """A planned run by the reference engine and the fixed-step integrator."""
    return collect(run, run.samples(RungeKutta(run.loop)), progress)


def run_adaptive(run: Run, method: str, rtol: float, atol: float, progress: Progress | None = None) -> Result:
    """A planned run by one of SciPy's methods."""
    run.info.update(integrator=method, rtol=rtol, atol=atol)
    return collect(run, run.samples(Scipy(run.loop, run.clock, method, rtol, atol)), progress)


def collect(run: Run, samples: Iterator[Sample], progress: Progress | None) -> Result:
    """Watch samples one by one, and log those that belong into the log.

    Args:
        run: the run; its `info` may say more by then.
        samples: what was computed, in order; whatever an engine raises ends the run.
        progress: called with the time of what is logged, s.

    Raises:
        SimulationError: the run had to stop; it carries what was logged.
    """
    recorder, guard = Recorder(run.loop, run.clock, run.devices), Guard(run.loop)

    def log() -> None:
        for sample in samples:
            recorder.state = sample.y
            guard.check(sample)
            recorder.reached = sample.t
            if sample.logged:
                recorder.add(sample)
                report_time(progress, sample.t)

    return finish(run, recorder, log)


def finish(run: Run, recorder: Recorder, log: Callable[[], None]) -> Result:
    """Let a run log itself; whatever ends it, while it is looked into too, takes along what was logged."""
    with np.errstate(all="ignore"):  # overflow is found and named by the guard
        try:
            return _made(run, recorder, log)
        except KeyboardInterrupt:
            raise _interrupted(run, recorder) from None


@contextmanager
def before_the_start(run: Run) -> Iterator[None]:
    """Hand over an empty result if Ctrl-C comes while a run is being prepared."""
    try:
        yield
    except KeyboardInterrupt:
        raise _interrupted(run, Recorder(run.loop, run.clock, run.devices)) from None


def _made(run: Run, recorder: Recorder, log: Callable[[], None]) -> Result:
    """The result of a run that nobody interrupts; its error has the result of one that had to stop."""
    try:
        log()
        return _logged(run, recorder, "completed")
    except SynctrlError as error:
        date(error, recorder.reached)
        told = _diagnosed(run, recorder, error)
        told.result = _logged(run, recorder, f"stopped: {told}")
        if told is error:
            raise
        raise told from None
    except Exception as error:
        failure = user_failure(error, recorder.reached)
        failure.result = _logged(run, recorder, f"stopped: {failure}")
        raise failure from error


def _logged(run: Run, recorder: Recorder, status: str) -> Result:
    """The result of a run; why it stopped is worth more than why the plant says nothing of it."""
    try:
        account = recorder.account(run.info)
    except Exception:
        if status == "completed":
            raise
        account = NOTHING
    run.info["step_error"] = step_report(run.step_error, run.loop, recorder.logged(), run.info)
    return recorder.result(status, run.info, run.experiment, account)


def _diagnosed(run: Run, recorder: Recorder, error: SynctrlError) -> SynctrlError:
    """An error of the guard's with its cause; others as they are, and those whose cause cannot be found."""
    if not isinstance(error, SimulationError):
        return error
    try:
        return diagnosed(error, run.loop, run.schedule, recorder.logged(), recorder.state, run.info)
    except Exception:  # numbers near the end, or a plant of a user's, that cannot be calculated with
        return error


def _interrupted(run: Run, recorder: Recorder) -> RunInterrupted:
    message = f"interrupted at t = {recorder.reached:g} s"
    result = _logged(run, recorder, f"stopped: {message}")
    return RunInterrupted(message, time=recorder.reached, result=result)


# -- engines -----------------------------------------------------------------------------------------------


class Engine(Protocol):
    """A way through time with fixed steps."""

    def refuses(self, run: Run) -> str | None:
        """Why this engine cannot make a run, or None if it can."""

    def run(self, run: Run, progress: Progress | None) -> Result:
        """Make it.

        Args:
            run: what is to be done, already checked.
            progress: called now and then with the time reached, s, or None.

        Raises:
            SimulationError: the run had to stop; it carries what was computed.
        """


class ReferenceEngine:
    """The equations as they are written, on Pinocchio's algorithms."""

    def refuses(self, run: Run) -> str | None:
        return None

    def run(self, run: Run, progress: Progress | None) -> Result:
        return run_reference(run, progress)


#: the engines that have a name: their module and class, which is imported when it is asked for
ENGINES = {
    "pinocchio": ("synctrl.simulation.engines", "ReferenceEngine"),
    "compiled": ("synctrl.compiled.engine", "Compiled"),
}


def find_engine(engine: str | Engine) -> Engine:
    """An engine by its name, or the one given.

    Raises:
        InputError: an unknown name, or something that is no engine.
    """
    if isinstance(engine, str):
        module, kind = ENGINES[choice("engine", engine, tuple(ENGINES))]
        return getattr(import_module(module), kind)()
    if isinstance(engine, type) or not all(callable(getattr(engine, m, None)) for m in ("refuses", "run")):
        known = ", ".join(map(repr, ENGINES))
        raise InputError.expected(f"one of {known}, or an engine of your own", engine, "engine")
    return engine


def carry_out(
    run: Run,
    integrator: str,
    engine: str | Engine,
    tolerances: tuple[float, float],
    progress: Progress | None,
) -> Result:
    """Check what is left to be checked, and make a run.

    Args:
        run: the run.
        integrator, engine, progress: as of `Experiment.simulate`.
        tolerances: rtol and atol of SciPy's methods.

    Raises:
        InputError: one of them means nothing, they do not go together, or the engine refuses the run.
        SimulationError: the run had to stop; it carries what was logged.
    """
    choice("integrator", integrator, ("rk4", *ADAPTIVE))
    by = find_engine(engine)
    if progress is not None and not callable(progress):
        raise InputError.expected("a function of the time reached", progress, "progress")
    rtol, atol = (positive_number(*each) for each in zip(("rtol", "atol"), tolerances, strict=True))
    if adaptive := integrator != "rk4":
        check_method(integrator, engine, run.info["control_period"])
    elif (reason := by.refuses(run)) is not None:
        raise InputError(reason, subject="engine")
    else:
        run.check_step()
    run.check()
    warn_of_unasked_friction(run.experiment.cell)
    run.loop.warn()
    result = run_adaptive(run, integrator, rtol, atol, progress) if adaptive else by.run(run, progress)
    warn_of_step(result.info["step_error"], result.names, run.info["dt"])
    warn_of_saturation(result)
    return result
