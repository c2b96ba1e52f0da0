"""The space in which robots are told what to do: joint positions, or the position of their tips.

A space is bound to the robots of a cell. It then measures their task coordinates and maps what the law wants
there to joint space. All arrays have one row per robot; with that axis left out they describe a single robot.
No formula asks what its numbers are: the compiled engine traces the same lines, bound to tips of symbols.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice, instance, positive_number
from ..errors import InputError
from ..robots.robot import Robot
from .redundancy import Damping, InverseMap, Inversion, Redundancy, inverse_map
from .tips import Kinematics, Tips
from .validity import WATCHED

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
    """A space bound to the robots of a cell.

    Beside what is below it may offer any of the following, and is asked for it where it does.

    - `limits: Mapping[str, float]` and `watched(task) -> (n, len(limits))`: names and limits of numbers that
      make a `Measurement` mean nothing once they reach their limits, and these numbers; a run then ends with
      an error that names time and robot.
    - `sides(task) -> (n, 1)`: numbers of which the sign says on which side of a singular configuration robots
      are; a run ends where one has changed within a step. 0 where there are no sides.
    """

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

    @property
    def limits(self) -> Mapping[str, float]:
        """Names and limits of what the guard of a run watches, see `BoundSpace`."""
        return {"condition": self.max_condition} if self.damping is None else {}

    def bind(self, robots: Sequence[Robot]) -> BoundTipSpace:
        """This space for certain robots.

        Raises:
            InputError: a robot has fewer joints than there are task coordinates, or a redundancy that does
                not fit.
        """
        return self.over(Tips(robots), self.inverse_map(robots), [[robot.nv == self.m] for robot in robots])

    def over(self, tips: Kinematics, inverse: InverseMap, square: ArrayLike) -> BoundTipSpace:
        """This space over any tips, be they of numbers or of symbols.

        Args:
            tips: where the tips are.
            inverse: the way to the joints.
            square: which robots have as many joints as there are task coordinates, (..., 1).
        """
        raise NotImplementedError

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error e, (m,), of one robot against a target, (m,), and the J, (m, nv), with e' = -J v."""
        raise NotImplementedError

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
        square = all(robot.nv == self.m for robot in robots)
        return inverse_map(square, self.damping, self.redundancy.spread(robots))


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

    def over(self, tips: Kinematics, inverse: InverseMap, square: ArrayLike) -> BoundCartesianSpace:
        return BoundCartesianSpace(tips, inverse, square, self.limits, self.rows)

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        return target - pose.translation[self.rows], J[self.rows]

    def __repr__(self) -> str:
        return f"CartesianSpace('{self.axes}')"


class BoundTipSpace:
    """Task coordinates that move with x' = J v; an inverse of J leads from the task to the joints.

    Args:
        tips, inverse, square: see `TipSpace.over`.
        limits: of what is watched, by the names in `WATCHED`.
    """

    def __init__(self, tips: Kinematics, inverse: InverseMap, square: ArrayLike, limits: Mapping[str, float]):
        self._tips, self._inverse, self._square, self.limits = tips, inverse, np.array(square), limits
        self.to_joints = inverse.to_joints

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        raise NotImplementedError

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return np.matvec(task.J.mT, force)  # type: ignore[union-attr]

    def watched(self, task: Measurement) -> np.ndarray:
        """What the guard compares with the limits, (..., number of limits)."""
        return np.concatenate([WATCHED[name](task) for name in self.limits], axis=-1)

    def sides(self, task: Measurement) -> np.ndarray:
        """Determinants of square Jacobians, (..., 1); 0 for others, and where they may be singular."""
        if "condition" not in self.limits or not self._square.any():
            return 0.0 * self._square
        J: np.ndarray = task.J  # type: ignore[assignment]
        return self._square * self._inverse.algebra.determinant(J[..., : J.shape[-2]])


class BoundCartesianSpace(BoundTipSpace):
    """Tip positions along some axes."""

    def __init__(
        self,
        tips: Kinematics,
        inverse: InverseMap,
        square: ArrayLike,
        limits: Mapping[str, float],
        rows: list[int],
    ):
        super().__init__(tips, inverse, square, limits)
        first, last = rows[0], rows[-1]
        self._rows = slice(first, last + 1) if rows == list(range(first, last + 1)) else rows

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        moved, J, J_dot = self._tips.positions(*motion)
        moved, J, J_dot = moved[..., self._rows], J[..., self._rows, :], J_dot[..., self._rows, :]
        inversion = self._inverse.invert(J, J_dot, *motion)
        return Measurement(moved, desired[:2] - moved, desired[1:], J, inversion.J_inv, J_dot, inversion)


def _damping(singularity: str | Damping) -> Damping | None:
    if isinstance(singularity, Damping):
        return singularity
    return Damping() if choice("singularity", singularity, ("stop", "damped")) == "damped" else None
