"""Watches a run and stops it when its numbers no longer mean anything."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np

from ..errors import NonFiniteError, OrientationError, SingularJacobianError
from ..tasks.cell import Cell
from ..tasks.pose import MAX_ANGLE, PoseSpace
from ..tasks.redundancy import determinant
from .closed_loop import ClosedLoop
from .integrators import Sample

#: parts of the state, in order
PARTS = ("position", "velocity", "parameter estimate", "integral of the synchronization error")

HINT = "the gains may be too high for the step, or the closed loop unstable"


class Guard:
    """Checks every logged instant for non-finite states, singular Jacobians and orientation errors near pi.

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
        self._jacobians: tuple[np.ndarray, np.ndarray] | None = None
        self._v = np.zeros((loop.cell.n, loop.cell.nv))

    def check(self, sample: Sample) -> None:
        """Stop the run if its numbers at this instant mean nothing.

        Raises:
            NonFiniteError: a part of the state is infinite or not a number.
            SingularJacobianError: a robot cannot follow its reference because its Jacobian is singular.
            OrientationError: an orientation error is so large that its direction is about to be undefined.
        """
        if not isfinite(np.add.reduce(sample.y)) and not np.isfinite(sample.y).all():
            raise run_away(self._loop, sample.t, sample.y, self._v, self._conditions())
        self._v[...] = sample.y[self._v.size : 2 * self._v.size].reshape(self._v.shape)
        task = sample.signals.task
        if self._pose:
            self._check_orientations(sample.t, task.e[:, 3:])
        if task.J is not None and task.J_inv is not None and self._limit < inf:
            self._check_jacobians(sample.t, task.J, task.J_inv)
        tau = sample.signals.tau
        if not isfinite(np.add.reduce(tau, axis=None)) and (rows := _non_finite_rows(tau)).size:
            raise not_finite(self._loop.cell, sample.t, fastest(rows, self._v), "torque")

    def _check_jacobians(self, t: float, J: np.ndarray, J_inv: np.ndarray) -> None:
        self._jacobians = J, J_inv
        if not _total(J) * _total(J_inv) < self._limit**2:  # else it holds for every robot
            condition = self._conditions()
            i = int(np.argmax(~(condition < self._limit)))
            if not condition[i] < self._limit:
                raise singular(self._loop.cell, t, i, f"its condition number is {condition[i]:.3g}")
        positive = determinant(J[self._square, :, : J.shape[1]]) > 0
        sides = positive.tobytes()
        if self._sides not in (None, sides):
            changed = positive != np.frombuffer(self._sides, dtype=bool)
            i = int(self._at[self._square][np.argmax(changed)])
            raise singular(self._loop.cell, t, i, "its determinant changed sign since the instant before")
        self._sides = sides

    def _conditions(self) -> np.ndarray:
        """Condition numbers of the Jacobians seen last, (n,), by the Frobenius norm."""
        if self._jacobians is None:
            return np.ones(self._loop.cell.n)
        J, J_inv = self._jacobians
        return np.sqrt((J * J).sum((1, 2)) * (J_inv * J_inv).sum((1, 2)))

    def _check_orientations(self, t: float, e: np.ndarray) -> None:
        angle = np.linalg.norm(e, axis=1)
        if (angle > MAX_ANGLE).any():
            i = int(np.argmax(angle))
            raise OrientationError(
                f"the orientation error of {self._loop.cell.names[i]} is {angle[i]:.3g} rad at t = {t:g} s; "
                f"expected at most {MAX_ANGLE:g} rad, because at pi its direction is not defined: start "
                "closer to the desired orientation, or turn more slowly",
                time=t,
                robot=i,
            )


def run_away(
    loop: ClosedLoop, t: float, y: np.ndarray, v: np.ndarray, conditions: np.ndarray | None = None
) -> NonFiniteError:
    """The error of a state with infinite or undefined numbers.

    Args:
        loop: the closed loop.
        t: when, s.
        y: the state.
        v: joint velocities at the instant before, (n, nv), rad/s.
        conditions: condition numbers of the Jacobians there, (n,), if they are known.
    """
    parts = zip(PARTS, loop.split(y), strict=True)
    broken = [(name, bad) for name, part in parts if (bad := _non_finite_rows(part)).size]
    if not broken:
        return NonFiniteError(f"the plant's own state is no longer finite at t = {t:g} s", time=t)
    name, rows = broken[0]
    i = fastest(rows if name != PARTS[3] else np.unique(loop.cell.coupling.edges[rows]), v)
    hint = HINT
    if conditions is not None and conditions[i] > 100:
        hint = f"its Jacobian was nearly singular before, with condition number {conditions[i]:.3g}"
    return not_finite(loop.cell, t, i, name, hint)


def fastest(robots: np.ndarray, v: np.ndarray) -> int:
    """Of robots that broke down in one step, as coupled ones do, the one that began: it moved fastest.

    Args:
        robots: their indices.
        v: joint velocities at the last instant at which all were finite, (n, nv), rad/s.
    """
    return int(robots[np.abs(v[robots]).max(axis=1).argmax()])


def not_finite(cell: Cell, t: float, robot: int, what: str, hint: str = HINT) -> NonFiniteError:
    """The error of a robot whose numbers ran away."""
    return NonFiniteError(
        f"the {what} of {cell.names[robot]} is no longer finite at t = {t:g} s; {hint}", time=t, robot=robot
    )


def singular(cell: Cell, t: float, robot: int, cause: str) -> SingularJacobianError:
    """The error of a robot that met a singular configuration."""
    return SingularJacobianError(
        f"the Jacobian of {cell.names[robot]} is singular at t = {t:g} s: {cause}; "
        "move the path away from the border of the workspace, or start in another configuration",
        time=t,
        robot=robot,
    )


def _total(A: np.ndarray) -> float:
    """Sum of the squares of all entries."""
    entries = A.ravel()
    return float(entries.dot(entries))


def _non_finite_rows(part: np.ndarray) -> np.ndarray:
    return np.flatnonzero(~np.isfinite(part).all(axis=1))
