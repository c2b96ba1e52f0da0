"""Where the robots of a cell start: on their paths and at rest, unless they are told otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import InputError, UnreachableError
from ..tasks.inverse_kinematics import start_in

#: joint velocities of a robot that starts as fast as its path
ON_PATH = "path"


def start_positions(cell: Any, i: int) -> tuple[str, ArrayLike]:
    """Where q0 of a robot comes from, and q0.

    Raises:
        InputError: nobody says where to start.
        UnreachableError: no joint positions for the start of its path.
    """
    member, robot = cell.members[i], cell.robots[i]
    if member.q0 is not None:
        return "given", member.q0
    x = member.trajectory(0.0).x
    if hasattr(cell.space, "start"):
        return "path", cell.space.start(robot, x)
    if hasattr(cell.space, "miss"):
        preferred = getattr(cell.space, "redundancy", None)
        posture = None if preferred is None else preferred.of(cell.robots, i)
        try:
            return "inverse kinematics", start_in(robot, x, cell.space, posture)
        except UnreachableError as error:
            raise UnreachableError(f"{error}", subject=f"{cell.names[i]}, trajectory") from None
    raise InputError("expected joint positions to start from, found none", subject=f"{cell.names[i]}, q0")


def start_velocities(name: str, given: ArrayLike | str | None, nv: int) -> np.ndarray:
    """v0 of a robot as it is given, (nv,); zeros where it is to be found on the path.

    Raises:
        InputError: no joint velocities.
    """
    if given is None or (isinstance(given, str) and given == ON_PATH):
        return np.zeros(nv)
    if isinstance(given, str):
        raise InputError.expected(f"joint velocities or '{ON_PATH}'", given, f"{name}, v0")
    return finite_array(f"{name}, v0", given, (nv,))


def on_paths(cell: Any, v0: np.ndarray) -> np.ndarray:
    """v0 of all robots, (n, nv), in which those that are to start as fast as their paths do so.

    Raises:
        InputError: a robot that cannot move along its path from where it starts.
    """
    asked = [isinstance(member.v0, str) for member in cell.members]
    if not any(asked):
        return v0
    v, _ = joint_motion(cell, cell.q0, cell.reference_table(np.zeros(1)).desired[0])
    for i in np.flatnonzero(asked):
        if not np.isfinite(v[i]).all():
            words = "joint velocities along the path; from where it starts there are none"
            raise InputError.expected(words, v[i], f"{cell.names[i]}, v0")
    return np.where(np.array(asked)[:, None], v, v0)


def joint_motion(cell: Any, q: np.ndarray, desired: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and accelerations, (n, nv), with which robots at q move as is desired, (3, n, m)."""
    task = cell.task.measure(np.stack((q, np.zeros_like(q))), desired)
    v, _ = cell.task.to_joints(task, *task.rates)
    task = cell.task.measure(np.stack((q, v)), desired)
    return cell.task.to_joints(task, *task.rates)
