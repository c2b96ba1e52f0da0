"""Where the robots of a cell will be: states along their paths and around them, for the choice of gains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..coupling.cell import Cell, Reference
from ..coupling.starts import joint_motion
from ..errors import InputError, SynctrlError
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
    table = _told(cell, np.linspace(0.0, duration, POINTS))
    at = np.arange(POINTS + AROUND) % POINTS
    on = _on_path(cell, table)
    return _weigh(cell, on.q[at] + _shifts(cell), on.v[at], on.a[at], table, at)


def path(cell: Cell, times: np.ndarray) -> Excursion:
    """States on the desired motions of a cell at ascending times, (K,), s; raises what `excursion` does."""
    table = _told(cell, times)
    return _weigh(cell, *_on_path(cell, table), table, np.arange(len(times)))


def at_start(cell: Cell) -> Excursion:
    """The one state in which a cell starts, with the velocities and accelerations that are desired there."""
    table, q = cell.reference_table(np.zeros(1)), cell.q0[None]
    v, a = joint_motion(cell, cell.q0, table.desired[0])
    return _weigh(cell, q, v[None], a[None], table, np.zeros(1, int))


def _told(cell: Cell, times: np.ndarray) -> Reference:
    """What is desired at the times; who has no motion that late is told which argument says how late."""
    try:
        return cell.reference_table(times)
    except SynctrlError as error:
        error.add_note(f"`duration` says how much of the motions is looked at; here {times[-1]:g} s")
        raise


class _OnPath(NamedTuple):
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


def _on_path(cell: Cell, table: Reference) -> _OnPath:
    """Joint positions of what is desired, and velocities and accelerations there, (T, n, nv)."""
    q = _follow(cell, table.xd)
    motion = np.array([joint_motion(cell, *row) for row in zip(q, table.desired, strict=True)])
    return _OnPath(q, motion[:, 0], motion[:, 1])


def _weigh(
    cell: Cell, q: np.ndarray, v: np.ndarray, a: np.ndarray, table: Reference, at: np.ndarray
) -> Excursion:
    """States with what weighs their errors, of the instants `at` of a table, (K,)."""
    rows = zip(q, v, table.desired[at], table.weights.c[at], strict=True)
    return Excursion(q, v, a, np.array([_weighted(cell, *row) for row in rows]))


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
