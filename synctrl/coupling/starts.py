"""Where the robots of a cell start: on their paths and at rest, unless they are told otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import InputError, UnreachableError
from ..tasks.inverse_kinematics import start_in
from .desired import desired_motion, further_rows

#: joint velocities of a robot that starts as fast as its path
ON_PATH = "path"
#: velocity at the start that no step follows: 0.2 rad in a millisecond, rad/s (m/s)
FASTEST = 200.0


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
    v, _ = joint_motion(cell, cell.q0, _first_desired(cell))
    for i in np.flatnonzero(asked):
        fastest = np.abs(v[i]).max()
        if not fastest <= FASTEST:
            found = f"{fastest:.3g}" if np.isfinite(fastest) else "none"
            words = (
                f"expected joint velocities along the path of at most {FASTEST:g} rad/s (m/s), found {found}"
            )
            cause = "it starts near a singularity; start elsewhere, or give numbers"
            raise InputError(f"{words}: {cause}", subject=f"{cell.names[i]}, v0", found=found)
    return np.where(np.array(asked)[:, None], v, v0)


def _first_desired(cell: Any) -> np.ndarray:
    """What is desired where paths begin, (3 or more, n, m): clocks move no robot."""
    rows, at = [], np.zeros(1)
    for i, (name, member) in enumerate(zip(cell.names, cell.members, strict=True)):
        further = further_rows(name, i, cell.space, member.trajectory, at)
        rows.append(np.concatenate((desired_motion(name, i, member.trajectory, at), further))[:, 0])
    return np.stack(rows, axis=1)


def joint_motion(cell: Any, q: np.ndarray, desired: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and accelerations, (n, nv), with which robots at q move as is desired, (3, n, m)."""
    task = cell.task.measure(np.stack((q, np.zeros_like(q))), desired)
    v, _ = cell.task.to_joints(task, *task.rates)
    task = cell.task.measure(np.stack((q, v)), desired)
    return cell.task.to_joints(task, *task.rates)
