"""What is desired at some instants, asked of functions that users wrote: whatever fails in them is named."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..tasks.asked import asked, finite_weights, not_finite
from ..tasks.trajectories import MOTION_PARTS, Motion, Trajectory

if TYPE_CHECKING:
    from .coupling import Coupling
    from .weights import Weights


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

    motion = asked(call, times, f"the desired motion of {name}", robot)
    for part, value in zip(MOTION_PARTS, motion, strict=True):
        if not np.isfinite(value).all():
            k = int(np.argwhere(~np.isfinite(value))[0][0])
            found = f"its {part} is {np.asarray(value)[k].tolist()}"
            raise not_finite(f"the desired motion of {name}", found, float(times[k]), robot, "motion")
    return motion


def desired_weights(coupling: Coupling, times: np.ndarray, m: int) -> Weights:
    """Weights of a coupling at some times, (T,), for a task of dimension m; see `finite_weights`."""
    if coupling.is_constant:
        return coupling.weights(times, m)
    return finite_weights(lambda at: coupling.weights(at, m), times)
