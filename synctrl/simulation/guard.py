"""Watches a run and stops it when its numbers no longer mean anything."""

from __future__ import annotations

from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from ..errors import NonFiniteError, OrientationError, SimulationError, SingularJacobianError
from ..tasks.cell import Cell
from ..tasks.pose import MAX_ANGLE, PoseSpace
from ..tasks.redundancy import determinant
from .closed_loop import ClosedLoop
from .integrators import Sample

#: parts of the state, in order
PARTS = ("position", "velocity", "parameter estimate", "integral of the synchronization error")
#: what a guard may find, in the order in which it looks, and as driver.c counts it from 1
CHECKS = ("state", "orientation", "condition", "side", "torque")


class Finding(NamedTuple):
    """What made a guard stop a run.

    Attributes:
        check: which of `CHECKS` failed.
        robot: the first one that failed it; with "orientation" the one that is farthest off.
        value: the number that was too large: an angle, rad, or a condition number.
    """

    check: str
    robot: int = 0
    value: float = 0.0


class Guard:
    """Checks every logged instant for non-finite states, orientation errors near pi and singular Jacobians.

    A square Jacobian is also singular when its determinant has changed sign since the instant before: the arm
    has jumped across a singular configuration in between. A space with damping may be singular.
    """

    def __init__(self, loop: ClosedLoop):
        self._loop = loop
        self._limit = getattr(loop.cell.space, "max_condition", np.inf)
        square = np.array([robot.nv == loop.cell.m for robot in loop.cell.robots])
        self._square, self._at = slice(None) if square.all() else square, np.arange(loop.cell.n)
        self._pose = isinstance(loop.cell.space, PoseSpace)
        self._sides: bytes | None = None
        self._v = np.zeros((loop.cell.n, loop.cell.nv))

    def check(self, sample: Sample) -> None:
        """Stop the run if its numbers at this instant mean nothing.

        Raises:
            NonFiniteError: a part of the state, or a torque, is infinite or not a number.
            OrientationError: an orientation error is so large that its direction is about to be undefined.
            SingularJacobianError: a robot cannot follow its reference because its Jacobian is singular.
        """
        found = self._look(sample)
        if found is not None:
            raise stopped(self._loop, sample.t, sample.y, self._v, found)
        self._v[...] = sample.y[self._v.size : 2 * self._v.size].reshape(self._v.shape)

    def _look(self, sample: Sample) -> Finding | None:
        """The first check that fails, in the order of `CHECKS`."""
        if not isfinite(np.add.reduce(sample.y)) and not np.isfinite(sample.y).all():
            return Finding("state")
        task, tau = sample.signals.task, sample.signals.tau
        if self._pose and (turned := _turned(task.e[:, 3:])) is not None:
            return turned
        if task.J is not None and task.J_inv is not None and self._limit < inf:
            singular = self._singular(task.J, task.J_inv) or self._crossed(task.J)
            if singular is not None:
                return singular
        if not isfinite(np.add.reduce(tau, axis=None)) and (rows := _non_finite_rows(tau)).size:
            return Finding("torque", int(rows[0]))
        return None

    def _singular(self, J: np.ndarray, J_inv: np.ndarray) -> Finding | None:
        """The first robot with too large a condition number, by the Frobenius norm."""
        if _total(J) * _total(J_inv) < self._limit**2:  # then it holds for every robot
            return None
        condition = np.sqrt((J * J).sum((1, 2)) * (J_inv * J_inv).sum((1, 2)))
        i = int(np.argmax(~(condition < self._limit)))
        return None if condition[i] < self._limit else Finding("condition", i, float(condition[i]))

    def _crossed(self, J: np.ndarray) -> Finding | None:
        """The first robot on the other side of a singular configuration than at the instant before."""
        positive = determinant(J[self._square, :, : J.shape[1]]) > 0
        before, self._sides = self._sides, positive.tobytes()
        if before in (None, self._sides):
            return None
        changed = positive != np.frombuffer(before, dtype=bool)
        return Finding("side", int(self._at[self._square][np.argmax(changed)]))


def stopped(loop: ClosedLoop, t: float, y: np.ndarray, v: np.ndarray, found: Finding) -> SimulationError:
    """The error of a run that was stopped, in the words of all engines; why it came to that is not in it.

    Args:
        loop: the closed loop.
        t: when, s.
        y: the state.
        v: joint velocities at the instant before, (n, nv), rad/s.
        found: what stopped it.
    """
    i, value = found.robot, found.value
    if found.check == "state":
        return _run_away(loop, t, y, v)
    if found.check == "torque":
        return _not_finite(loop.cell, t, i, "torque")
    if found.check == "orientation":
        return OrientationError(
            f"the orientation error of {loop.cell.names[i]} is {value:.3g} rad at t = {t:g} s; expected at "
            f"most {MAX_ANGLE:g} rad, because at pi its direction is not defined",
            time=t,
            robot=i,
        )
    seen = "its determinant changed sign since the instant before"
    return SingularJacobianError(
        f"the Jacobian of {loop.cell.names[i]} is singular at t = {t:g} s: "
        + (seen if found.check == "side" else f"its condition number is {_large(value)}"),
        time=t,
        robot=i,
    )


def _run_away(loop: ClosedLoop, t: float, y: np.ndarray, v: np.ndarray) -> NonFiniteError:
    """The error of a state with infinite or undefined numbers."""
    parts = zip(PARTS, loop.split(y), strict=True)
    broken = [(name, bad) for name, part in parts if (bad := _non_finite_rows(part)).size]
    if not broken:
        return NonFiniteError(f"the plant's own state is no longer finite at t = {t:g} s", time=t)
    name, rows = broken[0]
    robots = rows if name != PARTS[3] else np.unique(loop.cell.coupling.edges[rows])
    return _not_finite(loop.cell, t, _fastest(robots, v), name)


def _fastest(robots: np.ndarray, v: np.ndarray) -> int:
    """Of robots that broke down in one step, as coupled ones do, the one that moved fastest before."""
    return int(robots[np.abs(v[robots]).max(axis=1).argmax()])


def _not_finite(cell: Cell, t: float, robot: int, what: str) -> NonFiniteError:
    """The error of a robot whose numbers ran away."""
    return NonFiniteError(
        f"the {what} of {cell.names[robot]} is no longer finite at t = {t:g} s", time=t, robot=robot
    )


def _large(condition: float) -> str:
    """A condition number in words; above 1e12 it is made of rounding errors."""
    return f"{condition:.3g}" if condition < 1e12 else "infinite"


def _turned(e: np.ndarray) -> Finding | None:
    """The robot whose orientation error, (n, 3), is the largest, if that is too large."""
    angle = np.nan_to_num(np.linalg.norm(e, axis=1), nan=0.0)
    i = int(np.argmax(angle))
    return Finding("orientation", i, float(angle[i])) if angle[i] > MAX_ANGLE else None


def _total(A: np.ndarray) -> float:
    """Sum of the squares of all entries."""
    entries = A.ravel()
    return float(entries.dot(entries))


def _non_finite_rows(part: np.ndarray) -> np.ndarray:
    return np.flatnonzero(~np.isfinite(part).all(axis=1))
