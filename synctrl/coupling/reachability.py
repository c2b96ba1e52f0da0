"""Can the robots reach what is asked of them? Checked before anything runs."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ..errors import SimulationError, UnreachableError
from ..robots.robot import Robot
from ..tasks.inverse_kinematics import RESTARTS as RESTARTS
from ..tasks.inverse_kinematics import TOLERANCE as TOLERANCE
from ..tasks.inverse_kinematics import Missing as Missing
from ..tasks.inverse_kinematics import find_anywhere
from ..tasks.inverse_kinematics import inverse_kinematics as inverse_kinematics
from ..tasks.inverse_kinematics import reach as reach
from .cell import Cell

SAMPLES = 60


def check_reachable(cell: Cell, times: np.ndarray) -> None:
    """Follow every desired path by inverse kinematics, in any space that says how far a target is missed.

    Joint limits are not part of this: a path counts as reachable if joint positions for it exist at all.

    Raises:
        UnreachableError: a desired position or pose that the tip does not come within a micrometre (and a
            microradian) of, from the path before it or from twenty other configurations. The message names
            the robot and the time.
    """
    if not hasattr(cell.space, "miss"):
        return
    times = np.unique(times[np.linspace(0, len(times) - 1, SAMPLES).astype(int)])
    for i in range(cell.n):
        with suppress(SimulationError):  # a motion that fails ends the run, which hands over what it has
            _follow(cell, i, times)


def _follow(cell: Cell, i: int, times: np.ndarray) -> None:
    """Follow the path of one robot."""
    name, robot = cell.names[i], cell.robots[i]
    q = cell.q0[i, : robot.nv]
    for t, target in zip(times, cell.motion(i, times).x, strict=True):
        found = find_anywhere(robot, target, q, cell.space)  # type: ignore[arg-type]
        if found is None:
            raise _unreachable(name, robot, t, target, cell)
        q = found


def _unreachable(name: str, robot: Robot, t: float, target: np.ndarray, cell: Cell) -> UnreachableError:
    wanted = ", ".join(
        f"{label} = {value:.4g} {unit}"
        for label, value, unit in zip(cell.labels, target, cell.units, strict=True)
    )
    return UnreachableError(
        f"{name} ('{robot.name}') cannot reach its desired position at t = {t:g} s: {wanted}; "
        "expected a path inside the workspace of its tip"
    )
