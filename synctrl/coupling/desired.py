"""What is desired at some instants, asked of functions that users wrote: whatever fails in them is named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..errors import NonFiniteError, SynctrlError, failed
from ..tasks.trajectories import MOTION_PARTS, Motion, Trajectory
from .weights import DERIVATIVES, Weights

Found = TypeVar("Found")


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

    what = f"the desired motion of {name}"
    motion = _asked(call, times, what, robot)
    for part, value in zip(MOTION_PARTS, motion, strict=True):
        _check_finite(what, f"its {part}", value, times, robot, "motion")
    return motion


def desired_weights(weights: Callable[[np.ndarray], Weights], times: np.ndarray) -> Weights:
    """Weights of a coupling at some times, (T,).

    Args:
        weights: times -> weights.
        times: (T,), s.

    Raises:
        SynctrlError: what the weights raise of this kind.
        SimulationError: they raise anything else; with the time.
        NonFiniteError: they are infinite or not numbers; with robot and time.
    """
    found = _asked(weights, times, "the weights of the coupling", None)
    for name, value in zip(DERIVATIVES, found, strict=False):
        wrong = ~np.isfinite(value).all(axis=(0, 2, 3))
        for i in np.flatnonzero(wrong)[:1].tolist():
            _check_finite(f"{name} of the robot at index {i}", "it", value[:, i], times, i, "weights")
    return found


def _asked(call: Callable[[np.ndarray], Found], times: np.ndarray, what: str, robot: int | None) -> Found:
    """What a function of the user's gives at some times, (T,), s; `what` names it in messages."""
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


def _check_finite(what: str, part: str, value: np.ndarray, times: np.ndarray, robot: int, cause: str) -> None:
    """Refuse numbers, (T, ...), that are not finite at one of the times."""
    wrong = ~np.isfinite(value)
    if wrong.any():
        k = int(np.argwhere(wrong)[0][0])
        raise NonFiniteError(
            f"{what} is not finite at t = {times[k]:g} s: {part} is {np.asarray(value)[k].tolist()}; "
            "expected finite numbers at all times of the run",
            time=float(times[k]),
            robot=robot,
            cause=cause,
        )
