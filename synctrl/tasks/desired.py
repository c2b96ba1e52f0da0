"""What is desired at some instants, asked of functions that users wrote: whatever fails in them is named."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import NonFiniteError, SynctrlError, failed
from .trajectories import Motion, Trajectory

if TYPE_CHECKING:
    from .coupling import Coupling
    from .weights import Weights

PARTS = ("position", "velocity", "acceleration")


def desired_motion(name: str, robot: int, trajectory: Trajectory, times: np.ndarray) -> Motion:
    """Desired motion of a robot at some times, (T,).

    Args:
        name: of the robot.
        robot: its index, counted from 0.
        trajectory: its desired motion.
        times: (T,), s.

    Raises:
        SynctrlError: what the trajectory itself raises of this kind.
        SimulationError: it raises anything else; with robot and time.
        NonFiniteError: it is infinite or not a number; with robot and time.
    """

    def call(at: np.ndarray) -> Motion:
        x, x_dot, x_ddot = trajectory(at)
        return Motion(x, x_dot, x_ddot)

    motion = _asked(call, times, f"the desired motion of {name}", robot)
    for part, value in zip(PARTS, motion, strict=True):
        if not np.isfinite(value).all():
            k = int(np.argwhere(~np.isfinite(value))[0][0])
            raise NonFiniteError(
                f"the desired motion of {name} is not finite at t = {times[k]:g} s: its {part} is "
                f"{np.asarray(value)[k].tolist()}; expected finite numbers at all times of the run",
                time=float(times[k]),
                robot=robot,
                cause="motion",
            )
    return motion


def desired_weights(coupling: Coupling, times: np.ndarray, m: int) -> Weights:
    """Weights of a coupling at some times, (T,), for a task of dimension m; see `finite_weights`."""
    if coupling.is_constant:
        return coupling.weights(times, m)
    return finite_weights(lambda at: coupling.weights(at, m), times)


def finite_weights(call: Callable[[np.ndarray], Weights], times: np.ndarray) -> Weights:
    """Weights at some times, (T,), known to be numbers.

    Args:
        call: times -> weights.
        times: (T,), s.

    Raises:
        SynctrlError: what the weights raise of this kind.
        SimulationError: they raise anything else; with the time.
        NonFiniteError: they are infinite or not numbers; with robot and time.
    """
    weights = _asked(call, times, "the weights of the coupling", None)
    for name, value in zip(("c", "c'", "c''"), weights, strict=False):
        if not np.isfinite(value).all():
            k, i = (int(index) for index in np.argwhere(~np.isfinite(value))[0][:2])
            raise NonFiniteError(
                f"{name} of the robot at index {i} is not finite at t = {times[k]:g} s: "
                f"{value[k, i].tolist()}; expected finite numbers at all times of the run",
                time=float(times[k]),
                robot=i,
                cause="weights",
            )
    return weights


def _asked(call: Callable[[np.ndarray], Any], times: np.ndarray, what: str, robot: int | None) -> Any:
    try:
        return call(times)
    except SynctrlError:
        raise
    except Exception as error:
        raise failed(what, _first_failure(call, times), error, robot) from error


def _first_failure(call: Callable[[np.ndarray], Any], times: np.ndarray) -> float:
    """The first of the times at which a call fails; the first of all if it only fails for many at once."""
    for t in np.unique(times):
        try:
            call(np.array([t]))
        except Exception:
            return float(t)
    return float(times.min())
