"""Watches a run, stops it when its numbers no longer mean anything, and says what else has ended it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isfinite
from traceback import walk_tb
from typing import Any, NamedTuple, cast

import numpy as np

from ..coupling.cell import Cell
from ..errors import (
    NonFiniteError,
    OrientationError,
    SimulationError,
    SingularJacobianError,
    SynctrlError,
    failed,
)
from ..tasks.measurement import first_beyond
from ..tasks.measurement import limits_of as limits_of
from ..tasks.pose import MAX_ANGLE
from ..tasks.spaces import Measurement
from .advance import Sample
from .closed_loop import ClosedLoop

Progress = Callable[[float], Any]

#: packages in which no function of the user's stands
LIBRARIES = frozenset({"synctrl", "numpy", "scipy", "pinocchio", "mujoco", "casadi"})
#: parts of the state, in order
PARTS = ("position", "velocity", "parameter estimate", "integral of the synchronization error")


class Alarm(NamedTuple):
    """What made a guard stop a run.

    Attributes:
        check: which of the `checks` failed.
        robot: the first one that failed it.
        value: the number that was too large: an angle, rad, a condition number, or the space's own.
    """

    check: str
    robot: int = 0
    value: float = 0.0


def checks(watched: Iterable[str]) -> tuple[str, ...]:
    """What a guard may find, in the order in which it looks; driver.c counts them from 1."""
    return ("state", *watched, "side", "torque")


class Guard:
    """Checks every instant for non-finite states, and for task coordinates that their space calls invalid.

    A square Jacobian is also singular when its determinant has changed sign since the instant before: the arm
    has jumped across a singular configuration in between. A space with damping may be singular.
    """

    def __init__(self, loop: ClosedLoop):
        self._loop, self._space = loop, cast(Any, loop.cell.task)
        self._has_sides, self._sides = hasattr(self._space, "sides"), np.zeros((loop.cell.n, 1))
        self._v = np.zeros((loop.cell.n, loop.cell.nv))

    def check(self, sample: Sample) -> None:
        """Stop the run if its numbers at this instant mean nothing.

        Raises:
            NonFiniteError: a part of the state, or a torque, is infinite or not a number.
            OrientationError: an orientation error is so large that its direction is about to be undefined.
            SingularJacobianError: a robot cannot follow its reference because its Jacobian is singular.
            SimulationError: what a space of another kind calls invalid.
        """
        found = self._look(sample)
        if found is not None:
            raise stopped(self._loop, sample.t, sample.y, self._v, found)
        self._v[...] = sample.y[self._v.size : 2 * self._v.size].reshape(self._v.shape)

    def _look(self, sample: Sample) -> Alarm | None:
        """The first check that fails, in the order of `checks`."""
        if not isfinite(np.add.reduce(sample.y)) and not np.isfinite(sample.y).all():
            return Alarm("state")
        task, tau = sample.signals.task, sample.signals.tau
        if (beyond := first_beyond(self._space, task)) is not None:
            return Alarm(beyond.name, beyond.robot, beyond.value)
        if (found := self._crossed(task)) is not None:
            return found
        if not isfinite(np.add.reduce(tau, axis=None)) and (rows := _non_finite_rows(tau)).size:
            return Alarm("torque", int(rows[0]))
        return None

    def _crossed(self, task: Measurement) -> Alarm | None:
        """The first robot on the other side of a singular configuration than at the instant before."""
        if not self._has_sides:
            return None
        before, self._sides = self._sides, np.sign(self._space.sides(task))
        crossed = before * self._sides < 0
        return Alarm("side", int(crossed.argmax())) if crossed.any() else None


def stopped(loop: ClosedLoop, t: float, y: np.ndarray, v: np.ndarray, found: Alarm) -> SimulationError:
    """The error of a run that was stopped, in the words of all engines; why it came to that is not in it.

    Args:
        loop: the closed loop.
        t: when, s.
        y: the state.
        v: joint velocities at the instant before, (n, nv), rad/s.
        found: what stopped it.
    """
    check, robot, value = found
    name = loop.cell.names[robot]
    about: dict[str, Any] = {"time": t, "robot": robot}
    if check == "state":
        return _run_away(loop, t, y, v)
    if check == "torque":
        return _not_finite(loop.cell, t, robot, check)
    if check == "orientation":
        return OrientationError(
            f"the orientation error of {name} is {value:.3g} rad at t = {t:g} s; expected at most "
            f"{MAX_ANGLE:g} rad, because at pi its direction is not defined",
            **about,
        ).about(check, found=value)
    if check in ("condition", "side"):
        large = f"{value:.3g}" if value < 1e12 else "infinite"  # above it is made of rounding errors
        side = "its determinant changed sign since the instant before"
        seen = side if check == "side" else f"its condition number is {large}"
        error = SingularJacobianError(f"the Jacobian of {name} is singular at t = {t:g} s: {seen}", **about)
        return error.about(check, found=None if check == "side" else value)
    return SimulationError(
        f"the {check} of {name} is {value:.3g} at t = {t:g} s; {loop.cell.space!r} says that its coordinates "
        "mean nothing there",
        **about,
    ).about(check, found=value)


def _run_away(loop: ClosedLoop, t: float, y: np.ndarray, v: np.ndarray) -> NonFiniteError:
    """The error of a state with infinite or undefined numbers."""
    state = loop.state(y)
    parts = state.q, state.v, state.z, loop.controller.network.integral(state.memory)
    named = zip(PARTS, map(_non_finite_rows, parts), strict=True)
    name, rows = next(((name, rows) for name, rows in named if rows.size), (None, np.zeros(0)))
    if name is None:
        what = "network's memory" if not np.isfinite(state.memory).all() else "plant's own state"
        return NonFiniteError(f"the {what} is no longer finite at t = {t:g} s", time=t)
    robots = rows if name != PARTS[3] else np.unique(loop.cell.coupling.edges[rows])
    fastest = np.abs(v[robots]).max(axis=1).argmax()  # of robots that broke down together, as coupled ones do
    return _not_finite(loop.cell, t, int(robots[fastest]), name)


def _not_finite(cell: Cell, t: float, robot: int, what: str) -> NonFiniteError:
    """The error of a robot whose numbers ran away."""
    return NonFiniteError(
        f"the {what} of {cell.names[robot]} is no longer finite at t = {t:g} s", time=t, robot=robot
    )


def _non_finite_rows(part: np.ndarray) -> np.ndarray:
    return np.flatnonzero(~np.isfinite(part).all(axis=1))


def user_failure(error: Exception, t: float) -> SimulationError:
    """The error of a run that an exception ended which nobody foresaw, with the function that it came from.

    Args:
        error: the exception, with its traceback.
        t: simulated time of the last instant reached, s.
    """
    frames = [*walk_tb(error.__traceback__)]
    names = [str(frame.f_globals.get("__name__", "")) for frame, _ in frames]
    own = [f for f, name in zip(frames, names, strict=True) if name.partition(".")[0] not in LIBRARIES]
    frame, line = (own or frames)[-1]
    code = frame.f_code
    return failed(f"'{code.co_qualname}' ({code.co_filename}, line {line})", t, error)


def date(error: SynctrlError, t: float) -> None:
    """Say when a failure happened that was raised where the time was not known.

    Args:
        error: the failure.
        t: simulated time of the last instant reached, s.
    """
    if isinstance(error, SimulationError) and error.time is None:
        error.time, error.args = t, (f"{error}, in the step from t = {t:g} s",)


def report_time(progress: Progress | None, t: float) -> None:
    """Report the time reached to whoever wants to know.

    Raises:
        SimulationError: the function of the user's failed.
    """
    if progress is None:
        return
    try:
        progress(t)
    except SynctrlError:
        raise
    except Exception as error:
        raise failed("the function given as progress", t, error) from error
