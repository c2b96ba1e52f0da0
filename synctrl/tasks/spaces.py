"""The space in which robots are told what to do: joint positions, or the position of their tips.

A space is bound to the robots of a cell. It then measures their task coordinates and maps what the law wants
there to joint space. All arrays have one row per robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ..checks import positive_number
from ..errors import InputError
from ..robots.robot import Robot

AXES = "xyz"


class Measurement(NamedTuple):
    """Task coordinates of all robots and their desired motion, such that e' = xd_dot - x_dot.

    x, e, x_dot, xd_dot, xd_ddot are (n, m); J, J_inv and J_dot are (n, m, nv), (n, nv, m) and (n, m, nv), or
    None in joint space.
    """

    x: np.ndarray
    e: np.ndarray
    x_dot: np.ndarray
    xd_dot: np.ndarray
    xd_ddot: np.ndarray
    J: np.ndarray | None = None
    J_inv: np.ndarray | None = None
    J_dot: np.ndarray | None = None


class BoundSpace(Protocol):
    """A space bound to the robots of a cell."""

    def measure(
        self, q: np.ndarray, v: np.ndarray, xd: np.ndarray, xd_dot: np.ndarray, xd_ddot: np.ndarray
    ) -> Measurement:
        """Where the robots are and where they should be."""

    def to_joints(self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> tuple:
        """v_ref and a_ref, (n, nv), of a reference velocity and acceleration in task space, (n, m)."""

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        """Joint torques, (n, nv), of forces in task space, (n, m)."""


class Space(Protocol):
    """A kind of task coordinates."""

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Names of the m coordinates."""

    @property
    def unit(self) -> str:
        """Unit of the coordinates."""

    def bind(self, robots: Sequence[Robot]) -> BoundSpace:
        """This space for certain robots."""


class JointSpace:
    """Joint positions: x = q, in which the paper's law holds letter for letter."""

    unit = "rad"

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """`joint 1`, `joint 2`, ..."""
        return tuple(f"joint {k}" for k in range(1, robots[0].nv + 1))

    def bind(self, robots: Sequence[Robot]) -> BoundJointSpace:
        """Joint space of these robots.

        Raises:
            InputError: the robots have different numbers of joints.
        """
        counts = {robot.nv for robot in robots}
        if len(counts) != 1:
            found = ", ".join(f"'{robot.name}': {robot.nv}" for robot in robots)
            raise InputError(
                f"joint space: expected robots with the same number of joints, found {found}; "
                "synchronize such robots in Cartesian space"
            )
        return BoundJointSpace()

    def __repr__(self) -> str:
        return "JointSpace()"


class BoundJointSpace:
    """x = q; every map is the identity."""

    def measure(
        self, q: np.ndarray, v: np.ndarray, xd: np.ndarray, xd_dot: np.ndarray, xd_ddot: np.ndarray
    ) -> Measurement:
        return Measurement(q, xd - q, v, xd_dot, xd_ddot)

    def to_joints(
        self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        return xref_dot, xref_ddot

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return force


class CartesianSpace:
    """Position of the tip along some axes of the world, for arms with as many joints as axes.

    Args:
        axes: which axes, for example "xy" or "xyz".
        max_condition: a Jacobian with a larger condition number counts as singular.

    Raises:
        InputError: axes other than x, y, z, or a limit that is not positive.
    """

    unit = "m"

    def __init__(self, axes: str = "xyz", max_condition: float = 1e4):
        if not isinstance(axes, str) or not axes or set(axes) - set(AXES) or len(set(axes)) != len(axes):
            raise InputError(f"axes: expected different letters out of x, y, z, found {axes!r}")
        self.axes = axes
        self.max_condition = positive_number("max_condition", max_condition)
        self.rows = [AXES.index(a) for a in axes]

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """The axes."""
        return tuple(self.axes)

    def bind(self, robots: Sequence[Robot]) -> BoundCartesianSpace:
        """Cartesian space of these robots.

        Raises:
            InputError: a robot has more or fewer joints than there are axes.
        """
        for robot in robots:
            if robot.nv != len(self.axes):
                raise InputError(
                    f"Cartesian space of axes '{self.axes}': expected robots with {len(self.axes)} joints, "
                    f"found robot '{robot.name}' with {robot.nv}"
                )
        return BoundCartesianSpace(robots, self.rows)

    def __repr__(self) -> str:
        return f"CartesianSpace('{self.axes}')"


class BoundCartesianSpace:
    """Tip positions: x' = J v, so v_ref = J^-1 xref' and a_ref = J^-1 (xref'' - J' v_ref)."""

    def __init__(self, robots: Sequence[Robot], rows: list[int]):
        n, m = len(robots), len(rows)
        self._robots, self._rows = robots, rows
        self._x = np.empty((n, 3))
        self._J = np.empty((n, 6, m))
        self._J_dot = np.empty((n, 6, m))

    def measure(
        self, q: np.ndarray, v: np.ndarray, xd: np.ndarray, xd_dot: np.ndarray, xd_ddot: np.ndarray
    ) -> Measurement:
        for i, robot in enumerate(self._robots):
            pose, self._J[i], self._J_dot[i] = robot.tip_kinematics(q[i], v[i])
            self._x[i] = pose.translation
        x = self._x.take(self._rows, 1)
        J = self._J.take(self._rows, 1)
        J_dot = self._J_dot.take(self._rows, 1)
        return Measurement(x, xd - x, np.matvec(J, v), xd_dot, xd_ddot, J, _inverse(J), J_dot)

    def to_joints(
        self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        v_ref = np.matvec(task.J_inv, xref_dot)
        a_ref = np.matvec(task.J_inv, xref_ddot - np.matvec(task.J_dot, v_ref))
        return v_ref, a_ref

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return np.vecmat(force, task.J)


def _inverse(J: np.ndarray) -> np.ndarray:
    """J^-1 row by row; not-a-number where there is none, so that the run's guard can name the robot."""
    try:
        return np.linalg.inv(J)
    except np.linalg.LinAlgError:
        regular = np.linalg.det(J) != 0
        inverse = np.full_like(J, np.nan)
        inverse[regular] = np.linalg.inv(J[regular])
        return inverse
