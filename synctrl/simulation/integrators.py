"""Solvers: a fixed-step fourth-order method, and SciPy's adaptive ones.

Events are only met at the ends of steps: within a step everything is smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from ..errors import InputError, NonFiniteError, SynctrlError
from ..robots.model import unit_for
from .advance import Control, Step
from .clock import Clock, before
from .closed_loop import ClosedLoop, State
from .guard import user_failure

ADAPTIVE = ("RK45", "RK23", "DOP853", "Radau", "BDF", "LSODA")
#: weights of the four stages, times 6
_SIMPSON = np.array([1.0, 2.0, 2.0, 1.0])
#: steps of an adaptive method from one instant of the clock to the next, after which it is taken to be stuck
MAX_TRIES = 10_000


class RungeKutta:
    """The classical Runge-Kutta method of fourth order, in one step.

    Args:
        loop: the closed loop, for the size of its state.
    """

    def __init__(self, loop: ClosedLoop):
        self._rates = np.zeros((4, loop.size))
        self._k = tuple(map(loop.state, self._rates))
        self._stage, self._spare = loop.state(), loop.state()

    def carry(self, control: Control, step: Step, y: State, rate: State) -> State:
        h, (_, middle, end), stage = step.h, step.stages, self._stage
        k1, k2, k3, k4 = self._k
        k1.flat[...] = rate.flat
        control.rate(step, middle, stage.ahead(y, 0.5 * h, k1.flat), k2)
        control.rate(step, middle, stage.ahead(y, 0.5 * h, k2.flat), k3)
        control.rate(step, end, stage.ahead(y, h, k3.flat), k4)
        after, self._spare = self._spare.ahead(y, h / 6, _SIMPSON.dot(self._rates)), y
        control.arrive(step, after, k4.v)
        return after


class Scipy:
    """One of SciPy's methods with error control, restarted at every jump; its steps are its own.

    An adaptation settles where the clock's steps end; where that moves its state, it is a jump.

    Args:
        loop: the closed loop.
        clock: its instants.
        method: one of `ADAPTIVE`.
        rtol, atol: tolerances.

    Raises:
        InputError: LSODA outside the main thread, of a SciPy that has memory for one problem only.
    """

    def __init__(self, loop: ClosedLoop, clock: Clock, method: str, rtol: float, atol: float):
        import scipy

        _check_thread(method, scipy.__version__)
        self._loop, self._method, self._tolerances = loop, method, {"rtol": rtol, "atol": atol}
        self._jumps = np.append(clock.jumps, clock.end)
        self._solver: Any = None
        self._output: Any = None
        self._moved = False

    def carry(self, control: Control, step: Step, y: State, rate: State) -> State:
        if self._moved or not step.joined:
            self._restart(control, step, y.flat)
        after = self._loop.state(self._at(step.t_next))
        self._moved = self._loop.settle(after)
        return after

    def _restart(self, control: Control, step: Step, y: np.ndarray) -> None:
        import scipy.integrate

        end = float(self._jumps[np.searchsorted(self._jumps, step.t, side="right")])
        rhs, kind = _right_hand_side(control, step, end), getattr(scipy.integrate, self._method)
        self._solver, self._output = kind(rhs, step.t, y.copy(), end, **self._tolerances), None

    def _at(self, t: float) -> np.ndarray:
        """The state at a time that has not been passed yet, or within the last step."""
        solver, tries = self._solver, 0
        while solver.t < t:
            _step(solver)
            self._output, tries = None, tries + 1
            if solver.status == "failed" or tries > MAX_TRIES:
                raise _stuck(self._loop, self._method, solver)
        if solver.t == t:
            return solver.y.copy()
        if self._output is None:
            self._output = solver.dense_output()
        return self._output(t)


def check_method(integrator: str, engine: object, control_period: float | None) -> None:
    """Refuse one of SciPy's methods where only "rk4" goes.

    Raises:
        InputError: another engine than the reference, or sampled control.
    """
    if engine != "pinocchio":
        expected = f"engine={engine!r} has 'rk4' only"
        raise InputError(f"{expected}, found {integrator!r}", subject="integrator", found=integrator)
    if control_period is not None:
        expected = "sampled control needs the integrator 'rk4'"
        raise InputError(f"{expected}, found {integrator!r}", subject="control_period", found=integrator)


def _check_thread(method: str, version: str) -> None:
    """Before version 1.17 SciPy's LSODA kept its state in one place, where runs would spoil each other."""
    old = tuple(map(int, version.split(".")[:2])) < (1, 17)
    if method == "LSODA" and old and current_thread() is not main_thread():
        raise InputError(
            f"LSODA of SciPy {version} solves one problem at a time, so it runs in the main thread only, "
            f"found thread '{current_thread().name}'; use another method, or SciPy 1.17 or newer",
            subject="integrator",
            found=current_thread().name,
        )


def _step(solver: Any) -> None:
    """One step; numbers that an implicit method cannot calculate with are a failure like others."""
    try:
        solver.step()
    except SynctrlError:
        raise
    except ValueError:
        solver.status = "failed"


def _stuck(loop: ClosedLoop, method: str, solver: Any) -> NonFiniteError:
    """The error of a method that cannot go on, with the robot whose state changes fastest."""
    rate = loop.state(solver.fun(solver.t, solver.y))
    v_dot = np.nan_to_num(np.abs(rate.v), nan=np.inf)
    i, joint = (int(k) for k in np.unravel_index(v_dot.argmax(), v_dot.shape))
    unit = unit_for("rad/s²", loop.cell.robots[i].joint_units[joint])
    return NonFiniteError(
        f"{method} got stuck at t = {solver.t:g} s, where {loop.cell.names[i]} accelerates with "
        f"{v_dot[i, joint]:.3g} {unit}",
        time=float(solver.t),
        robot=i,
    )


def _right_hand_side(control: Control, step: Step, end: float) -> Callable[[float, np.ndarray], np.ndarray]:
    """t, y -> y' on a smooth interval that begins with a step, with values from the left at its end."""
    loop = step.loop

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        if not isfinite(t):  # the solver is lost, and nothing is desired then
            return np.full(loop.size, np.nan)
        rate = loop.state(np.zeros(loop.size))
        reference = loop.cell.references(np.array([min(t, before(end))]))[0]
        try:
            control.rate(step, reference, loop.state(y), rate)
        except SynctrlError:
            raise
        except Exception as error:  # solvers have a meaning of their own for some
            raise user_failure(error, t) from error
        return rate.flat

    return rhs
