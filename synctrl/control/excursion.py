"""Where the robots of a cell will be: states along their paths and around them, for the choice of gains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..coupling.cell import Cell
from ..errors import InputError
from ..tasks.inverse_kinematics import reach

#: instants of the path, states around it, and how far these are from it, rad (or m)
POINTS, AROUND, APART = 21, 60, 0.3


class Excursion(NamedTuple):
    """States of all robots, K of them: the first on their paths, the others around these.

    Attributes:
        q, v, a: joint positions, and velocities and accelerations of the path, (K, n, nv).
        weighted: weights times Jacobians, (K, n, m, nv).
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    weighted: np.ndarray


def excursion(cell: Cell, duration: float) -> Excursion:
    """States along the desired motions of a cell and around them.

    Args:
        cell: the robots and their task.
        duration: what of the motions is looked at, s.

    Raises:
        InputError: a space that does not say which joint positions are on a path.
        UnreachableError: there are none.
    """
    times = np.linspace(0.0, duration, POINTS)
    table = cell.reference_table(times)
    q = _follow(cell, table.xd)
    at = np.arange(POINTS + AROUND) % POINTS
    motion = np.array([_joint_motion(cell, *row) for row in zip(q, table.desired, strict=True)])[at]
    near = q[at] + _shifts(cell)
    rows = zip(near, motion[:, 0], table.desired[at], table.weights.c[at], strict=True)
    return Excursion(near, motion[:, 0], motion[:, 1], np.array([_weighted(cell, *row) for row in rows]))


def _follow(cell: Cell, xd: np.ndarray) -> np.ndarray:
    """Joint positions at xd, (K, n, m), each close to those before it, (K, n, nv)."""
    q = np.zeros((len(xd), cell.n, cell.nv))
    for i, robot in enumerate(cell.robots):
        at = cell.q0[i, : robot.nv]
        for k, x in enumerate(xd[:, i]):
            q[k, i, : robot.nv] = at = _place(cell, i, x, at)
    return q


def _place(cell: Cell, i: int, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Joint positions at x, (m,), of one robot, close to q, (nv,)."""
    if hasattr(cell.space, "miss"):
        return reach(cell.robots[i], x, q, cell.space)  # type: ignore[arg-type]
    if hasattr(cell.space, "start"):
        return np.asarray(cell.space.start(cell.robots[i], x), dtype=float)
    raise InputError.expected("one with `miss` or `start`", cell.space, "space")


def _joint_motion(cell: Cell, q: np.ndarray, desired: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and accelerations, (n, nv), with which robots at q move as is desired, (3, n, m)."""
    task = cell.task.measure(np.stack((q, np.zeros_like(q))), desired)
    v, _ = cell.task.to_joints(task, *task.rates)
    task = cell.task.measure(np.stack((q, v)), desired)
    return cell.task.to_joints(task, *task.rates)


def _shifts(cell: Cell) -> np.ndarray:
    """How far the states are from the path, (K, n, nv): the first not at all."""
    shifts = np.zeros((POINTS + AROUND, cell.n, cell.nv))
    rng = np.random.default_rng(0)
    for i, robot in enumerate(cell.robots):
        shifts[POINTS:, i, : robot.nv] = rng.uniform(-APART, APART, (AROUND, robot.nv))
    return shifts


def _weighted(cell: Cell, q: np.ndarray, v: np.ndarray, desired: np.ndarray, c: np.ndarray) -> np.ndarray:
    """c J, (n, m, nv)."""
    J = cell.task.measure(np.stack((q, v)), desired).J
    return c if J is None else c @ J
