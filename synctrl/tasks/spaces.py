"""The space in which robots are told what to do: joint positions, or the position of their tips.

A space is bound to the robots of a cell. It then measures their task coordinates and maps what the law wants
there to joint space. All arrays have one row per robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..checks import choice, instance, positive_number
from ..errors import InputError
from ..robots.robot import Robot
from .redundancy import Damping, InverseMap, Inversion, Redundancy, inverse_map
from .tips import Tips
from .validity import Invalid, determinant_sides, too_singular

AXES = "xyz"
Joints = tuple[np.ndarray, np.ndarray]


@dataclass(slots=True)
class Measurement:
    """Task coordinates of all robots and their desired motion, such that e' = xd' - x'.

    Attributes:
        motion: x and x', (2, n, m).
        error: e and e', (2, n, m).
        rates: xd' and xd'', (2, n, m).
        J, J_inv, J_dot: (n, m, nv), (n, nv, m) and (n, m, nv), or None in joint space. J_inv is J^-1, or a
            right inverse of a redundant arm's J.
        inversion: how J_inv was found.
    """

    motion: np.ndarray
    error: np.ndarray
    rates: np.ndarray
    J: np.ndarray | None = None
    J_inv: np.ndarray | None = None
    J_dot: np.ndarray | None = None
    inversion: Inversion | None = None

    x = property(lambda self: self.motion[0])
    x_dot = property(lambda self: self.motion[1])
    e = property(lambda self: self.error[0])
    e_dot = property(lambda self: self.error[1])
    xd_dot = property(lambda self: self.rates[0])
    xd_ddot = property(lambda self: self.rates[1])


class BoundSpace(Protocol):
    """A space bound to the robots of a cell."""

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        """Where the robots are and where they should be.

        Args:
            motion: joint positions and velocities, (2, n, nv).
            desired: xd, xd' and xd'', (3, n, m).
        """

    def to_joints(self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> Joints:
        """v_ref and a_ref, (n, nv), of a reference velocity and acceleration in task space, (n, m)."""

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        """Joint torques, (n, nv), of forces in task space, (n, m)."""


class Space(Protocol):
    """A kind of task coordinates: what a space of one's own gives.

    The coordinates have different names, each a word of one line. Beside what is below, a space may offer any
    of the following, and is asked for it where it does; what it does not offer is not looked at.

    - `units`: unit of each of the m coordinates, where they differ.
    - `invalid(task) -> Invalid | None`: what makes a `Measurement` mean nothing; the run then ends with an
      error that names time and robot.
    - `sides(task, robots) -> (n,)`: on which side of a singular configuration robots are; a run ends where
      one of them has changed within a step. None where it may.
    - `miss(robot, target, q) -> error, Jacobian`: by how much a robot at q misses a target, (m,), and J,
      (m, nv), with e' = -J v. With it a run begins only if joint positions exist for what is desired.
    - `start(robot, x) -> q`: joint positions, (nv,), of a robot that begins at x, (m,), and has no `q0`.
    - `displacement(start, end)`: the way from one position to another, (..., m), if its velocities are no
      derivatives of its coordinates.
    """

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Names of the m coordinates."""

    @property
    def unit(self) -> str:
        """Unit of the coordinates."""

    def bind(self, robots: Sequence[Robot]) -> BoundSpace:
        """This space for certain robots."""


def units_of(space: Space, m: int) -> tuple[str, ...]:
    """Unit of each of the m coordinates of a space."""
    return tuple(getattr(space, "units", (space.unit,) * m))


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

    def start(self, robot: Robot, x: np.ndarray) -> np.ndarray:
        """Joint positions at x, which are x itself."""
        return x

    def __repr__(self) -> str:
        return "JointSpace()"


class BoundJointSpace:
    """x = q; every map is the identity."""

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        return Measurement(motion, desired[:2] - motion, desired[1:])

    def to_joints(self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> Joints:
        return xref_dot, xref_ddot

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return force


class TipSpace:
    """What position and pose of the tip have in common: how joint motion follows from task motion.

    Args:
        m: number of task coordinates.
        max_condition: a Jacobian with a larger condition number counts as singular.
        singularity: "stop" ends a run at a singular Jacobian with an error. "damped", or a `Damping`, goes
            on with damped least squares; the result's `info["damping"]` then says when and how much.
        redundancy: what arms do with joints that the task leaves free.

    Raises:
        InputError: another word, or a limit that is not positive.
    """

    def __init__(
        self, m: int, max_condition: float, singularity: str | Damping, redundancy: Redundancy | None
    ):
        self.m = m
        self.redundancy = Redundancy() if redundancy is None else redundancy
        instance("redundancy", self.redundancy, Redundancy, "a Redundancy")
        self.damping = _damping(singularity)
        limit = positive_number("max_condition", max_condition)
        self.max_condition = limit if self.damping is None else np.inf

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error e, (m,), of one robot against a target, (m,), and the J, (m, nv), with e' = -J v."""
        raise NotImplementedError

    def invalid(self, task: Measurement) -> Invalid | None:
        """The first robot whose Jacobian is singular; none with damping."""
        if task.J is None or task.J_inv is None or self.max_condition == np.inf:
            return None
        return too_singular(task.J, task.J_inv, self.max_condition)

    def sides(self, task: Measurement, robots: Sequence[Robot]) -> np.ndarray | None:
        """Signs of the determinants of square Jacobians, (n,), and 0 for others; None with damping."""
        if task.J is None or self.max_condition == np.inf:
            return None
        return determinant_sides(task.J, np.array([robot.nv == self.m for robot in robots]))

    def inverse_map(self, robots: Sequence[Robot]) -> InverseMap:
        """The way to the joints of these robots.

        Raises:
            InputError: a robot with fewer joints than there are task coordinates.
        """
        for robot in robots:
            if robot.nv < self.m:
                raise InputError(
                    f"{self!r}: expected robots with at least {self.m} joints, "
                    f"found robot '{robot.name}' with {robot.nv}"
                )
        return inverse_map(robots, self.m, self.redundancy, self.damping)


class CartesianSpace(TipSpace):
    """Position of the tip along some axes of the world.

    Args:
        axes: which axes, for example "xy" or "xyz".
        max_condition: a Jacobian with a larger condition number counts as singular.
        singularity: "stop" ends a run at a singular Jacobian with an error. "damped", or a `Damping`, goes
            on with damped least squares; the result's `info["damping"]` then says when and how much.
        redundancy: what arms with more joints than axes do with the rest.

    Raises:
        InputError: axes other than x, y, z, a limit that is not positive, or an unknown word.
    """

    unit = "m"

    def __init__(
        self,
        axes: str = "xyz",
        max_condition: float = 1e4,
        singularity: str | Damping = "stop",
        redundancy: Redundancy | None = None,
    ):
        if not isinstance(axes, str) or not axes or set(axes) - set(AXES) or len(set(axes)) != len(axes):
            raise InputError(f"axes: expected different letters out of x, y, z, found {axes!r}")
        super().__init__(len(axes), max_condition, singularity, redundancy)
        self.axes = axes
        self.rows = [AXES.index(a) for a in axes]

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """The axes."""
        return tuple(self.axes)

    def bind(self, robots: Sequence[Robot]) -> BoundCartesianSpace:
        """Cartesian space of these robots.

        Raises:
            InputError: a robot has fewer joints than there are axes, or a redundancy that does not fit.
        """
        return BoundCartesianSpace(Tips(robots), self.inverse_map(robots), self.rows)

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        return target - pose.translation[self.rows], J[self.rows]

    def __repr__(self) -> str:
        return f"CartesianSpace('{self.axes}')"


class BoundTipSpace:
    """Task coordinates that move with x' = J v; an inverse of J leads from the task to the joints."""

    def __init__(self, tips: Tips, inverse: InverseMap):
        self._tips, self._inverse = tips, inverse
        self.to_joints = inverse.to_joints

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return np.vecmat(force, task.J)  # type: ignore[arg-type]


class BoundCartesianSpace(BoundTipSpace):
    """Tip positions along some axes."""

    def __init__(self, tips: Tips, inverse: InverseMap, rows: list[int]):
        super().__init__(tips, inverse)
        first, last = rows[0], rows[-1]
        self._rows = slice(first, last + 1) if rows == list(range(first, last + 1)) else rows

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        q, v = motion
        rows = self._rows
        moved, J, J_dot = self._tips.positions(q, v)
        moved, J, J_dot = moved[:, :, rows], J[:, rows], J_dot[:, rows]
        inversion = self._inverse.invert(J, J_dot, q, v)
        error, rates = desired[:2] - moved, desired[1:]
        return Measurement(moved, error, rates, J, inversion.J_inv, J_dot, inversion)


def _damping(singularity: str | Damping) -> Damping | None:
    if isinstance(singularity, Damping):
        return singularity
    return Damping() if choice("singularity", singularity, ("stop", "damped")) == "damped" else None
