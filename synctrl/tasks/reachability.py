"""Can the robots reach what is asked of them? Checked before anything runs."""

from __future__ import annotations

import numpy as np

from ..errors import UnreachableError
from ..robots.robot import Robot
from .cell import Cell
from .spaces import CartesianSpace

SAMPLES = 60
RESTARTS = 20
TOLERANCE = 1e-6


def check_reachable(cell: Cell, times: np.ndarray) -> None:
    """Follow every desired path by inverse kinematics.

    Raises:
        UnreachableError: a desired position that the tip does not come within a micrometre of, from the path
            before it or from twenty other configurations. The message names the robot and the time.
    """
    if not isinstance(cell.space, CartesianSpace):
        return
    times = np.unique(times[np.linspace(0, len(times) - 1, SAMPLES).astype(int)])
    for name, member, q in zip(cell.names, cell.members, cell.q0, strict=True):
        robot = member.robot
        q = q[: robot.nv]
        for t, target in zip(times, member.trajectory(times).x, strict=True):
            found = inverse_kinematics(robot, target, q, cell.space.rows)
            if found is None:
                raise _unreachable(name, robot, t, target, cell.space.axes)
            q = found


def inverse_kinematics(
    robot: Robot, target: np.ndarray, q: np.ndarray, rows: list[int] | None = None
) -> np.ndarray | None:
    """Joint positions, (nv,), that bring the tip to a target, or None if none were found.

    Damped least squares from q, and then from other configurations drawn with a fixed seed.

    Args:
        robot: the robot.
        target: desired coordinates of the tip in the world, (len(rows),), m.
        q: joint positions to start from, (nv,).
        rows: which of x, y, z are prescribed; by default all.
    """
    rows = [0, 1, 2] if rows is None else rows
    rng = np.random.default_rng(0)
    for _ in range(1 + RESTARTS):
        found = _descend(robot, target, q, rows)
        if found is not None:
            return found
        q = rng.uniform(-np.pi, np.pi, robot.nv)
    return None


def _descend(robot: Robot, target: np.ndarray, q: np.ndarray, rows: list[int]) -> np.ndarray | None:
    """Levenberg-Marquardt: the damping shrinks with every step that helps, and grows otherwise."""
    still, damping = np.zeros(robot.nv), 1e-6
    error, J = _miss(robot, target, q, still, rows)
    for _ in range(60):
        if np.abs(error).max() < TOLERANCE:
            return q
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(rows)), error)
        new_error, new_J = _miss(robot, target, q + step, still, rows)
        if np.linalg.norm(new_error) < np.linalg.norm(error):
            q, error, J, damping = q + step, new_error, new_J, max(damping / 10, 1e-12)
        else:
            damping *= 10
    return None


def _miss(
    robot: Robot, target: np.ndarray, q: np.ndarray, still: np.ndarray, rows: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    pose, J, _ = robot.tip_kinematics(q, still)
    return target - pose.translation[rows], J[rows].copy()


def _unreachable(name: str, robot: Robot, t: float, target: np.ndarray, axes: str) -> UnreachableError:
    position = ", ".join(f"{axis} = {value:.4g} m" for axis, value in zip(axes, target, strict=True))
    return UnreachableError(
        f"{name} ('{robot.name}') cannot reach its desired position at t = {t:g} s: {position}; "
        "expected a path inside the workspace of its tip"
    )
