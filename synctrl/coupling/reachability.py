"""Can the robots reach what is asked of them? Checked before anything runs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Protocol

import numpy as np

from ..checks import finite_array, instance
from ..errors import InputError, SimulationError, UnreachableError
from ..robots.robot import Robot
from ..tasks.spaces import CartesianSpace
from .cell import Cell

SAMPLES = 60
RESTARTS = 20
TOLERANCE = 1e-6


class Missing(Protocol):
    """A space that says how far a robot misses a target."""

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Names of the m coordinates."""

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error e, (m,), of one robot against a target, (m,), and the J, (m, nv), with e' = -J v."""


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
        found = inverse_kinematics(robot, target, q, cell.space)  # type: ignore[arg-type]
        if found is None:
            raise _unreachable(name, robot, t, target, cell)
        q = found


def inverse_kinematics(
    robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing | None = None
) -> np.ndarray | None:
    """Joint positions, (nv,), that bring the tip to a target, or None if none were found.

    Damped least squares from q, and then from other configurations drawn with a fixed seed. A redundant arm
    stays close to the configuration it started from. Joint limits are not regarded.

    Args:
        robot: the robot.
        target: task coordinates in the world, (m,): a position, m, or a position and a rotation vector.
        q: joint positions to start from, (nv,).
        space: what the coordinates mean, one that offers `miss`; by default the position along x, y, z.

    Raises:
        InputError: no robot, no such space, or numbers of another size or not finite.
    """
    space = CartesianSpace() if space is None else space
    instance("robot", robot, Robot, "a Robot, for example from load_robot")
    if isinstance(space, type) or not hasattr(space, "miss"):
        raise InputError(
            f"expected a CartesianSpace, a PoseSpace or another with `miss`, found {space!r}", subject="space"
        )
    target, q = finite_array("target", target, (_dimension(space, robot),)), finite_array("q", q, (robot.nv,))
    rng = np.random.default_rng(0)
    for _ in range(1 + RESTARTS):
        found = _descend(space, robot, target, q)
        if found is not None:
            return found.copy()
        q = rng.uniform(-np.pi, np.pi, robot.nv)
    return None


def reach(robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing | None = None) -> np.ndarray:
    """`inverse_kinematics` that does not return empty-handed.

    Raises:
        UnreachableError: no joint positions were found.
    """
    found = inverse_kinematics(robot, target, q, space)
    if found is None:
        place = ", ".join(f"{value:.4g}" for value in target)
        raise UnreachableError(f"'{robot.name}' cannot reach ({place}); expected a place in reach of its tip")
    return found


def _dimension(space: Missing, robot: Robot) -> int:
    """Number of coordinates of a space."""
    return len(space.labels((robot,)))


def _descend(space: Missing, robot: Robot, target: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """Levenberg-Marquardt: the damping shrinks with every step that helps, and grows otherwise."""
    damping = 1e-6
    error, J = space.miss(robot, target, q)
    for _ in range(60):
        if np.abs(error).max() < TOLERANCE:
            return q
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(error)), error)
        new_error, new_J = space.miss(robot, target, q + step)
        if np.linalg.norm(new_error) < np.linalg.norm(error):
            q, error, J, damping = q + step, new_error, new_J, max(damping / 10, 1e-12)
        else:
            damping *= 10
    return None


def _unreachable(name: str, robot: Robot, t: float, target: np.ndarray, cell: Cell) -> UnreachableError:
    wanted = ", ".join(
        f"{label} = {value:.4g} {unit}"
        for label, value, unit in zip(cell.labels, target, cell.units, strict=True)
    )
    return UnreachableError(
        f"{name} ('{robot.name}') cannot reach its desired position at t = {t:g} s: {wanted}; "
        "expected a path inside the workspace of its tip"
    )
