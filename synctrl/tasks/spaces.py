"""The space in which robots are told what to do: joint positions, or the position of their tips.

A space is bound to the robots of a cell. It then measures their task coordinates and maps what the law wants
there to joint space. All arrays have one row per robot; with that axis left out they describe a single robot.
No formula asks what its numbers are: the compiled engine traces the same lines, bound to tips of symbols.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice, instance, positive_number
from ..errors import InputError
from ..robots.robot import Robot
from .algebra import LAPACK, Algebra
from .measurement import Kinematics, Tips
from .measurement import Measurement as Measurement
from .redundancy import Damping, Inverse, Joints, Posture, Redundancy, inverse_map

AXES = "xyz"


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
            desired: xd, xd' and xd'', (3, n, m); behind them what the space has as `further`.
        """

    def to_joints(self, task: Measurement, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> Joints:
        """v_ref and a_ref, (n, nv), of a reference velocity and acceleration in task space, (n, m)."""

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        """Joint torques, (n, nv), of forces in task space, (n, m)."""


class Space(Protocol):
    """A kind of task coordinates: what a space of one's own gives.

    The coordinates have different names, each a word of one line. Beside what is below, a space may offer any
    of the following, and is asked for it where it does; what it does not offer is not looked at.

    - `units`: unit of each of the m coordinates, where they differ; or, where they depend on the robots, a
      method that gives them for these, as `labels` does.
    - `miss(robot, target, q) -> error, Jacobian`: by how much a robot at q misses a target, (m,), and J,
      (m, nv), with e' = -J v. With it a run begins only if joint positions exist for what is desired.
    - `start(robot, x) -> q`: joint positions, (nv,), of a robot that begins at x, (m,), and has no `q0`.
    - `further(trajectory, times)`: three more rows of what is desired, (3, T, m), that `measure` has to know
      of a desired motion at some times, (T,), for example of a point that slides on what is carried.
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


def units_of(space: Space, robots: Sequence[Robot]) -> tuple[str, ...]:
    """Unit of each of the m coordinates that a space has for these robots."""
    units = getattr(space, "units", None)
    if units is None:
        return (space.unit,) * len(space.labels(robots))
    return tuple(units(robots) if callable(units) else units)


class JointSpace:
    """Joint positions: x = q, in which the paper's law holds letter for letter."""

    unit = "rad"

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Names of the joints, if all robots call them the same; else `joint 1`, `joint 2`, ..."""
        names = {robot.joint_names for robot in robots}
        return names.pop() if len(names) == 1 else tuple(f"joint {k}" for k in range(1, robots[0].nv + 1))

    def units(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Units of the joints; `rad or m` where one robot turns and another one slides."""
        of = (robot.joint_units for robot in robots)
        return tuple(" or ".join(dict.fromkeys(units)) for units in zip(*of, strict=False))

    def bind(self, robots: Sequence[Robot]) -> BoundJointSpace:
        """Joint space of these robots.

        Raises:
            InputError: the robots have different numbers of joints.
        """
        counts = {robot.nv for robot in robots}
        if len(counts) != 1:
            found = ", ".join(f"'{robot.name}': {robot.nv}" for robot in robots)
            raise InputError(
                f"expected robots with the same number of joints, found {found}; "
                "synchronize such robots in Cartesian space",
                subject="joint space",
                found=found,
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


class BoundTipSpace(ABC):
    """Task coordinates that move with x' = J v; an inverse of J leads from the task to the joints.

    Args:
        space: which coordinates.
        tips: where the tips are, in numbers or in symbols.
        inverse: the way to the joints.
        square: which robots have as many joints as there are task coordinates, (..., 1).
    """

    def __init__(self, space: Any, tips: Kinematics, inverse: Inverse, square: np.ndarray):
        self._space, self._tips, self._inverse, self._square = space, tips, inverse, square
        self.limits, self.to_joints = space.limits, inverse.to_joints

    @abstractmethod
    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement: ...

    def to_torque(self, task: Measurement, force: np.ndarray) -> np.ndarray:
        return np.matvec(task.J.mT, force)  # type: ignore[union-attr]

    def watched(self, task: Measurement) -> np.ndarray:
        """What the guard compares with the limits, (..., number of limits)."""
        return np.concatenate([getattr(task, name) for name in self.limits], axis=-1)

    def sides(self, task: Measurement) -> np.ndarray:
        """Determinants of square Jacobians, (..., 1); 0 for others, and where they may be singular."""
        if "condition" not in self.limits or not self._square.any():
            return 0.0 * self._square
        J: np.ndarray = task.J  # type: ignore[assignment]
        return self._square * self._inverse.algebra.determinant(J[..., : J.shape[-2]])


class BoundCartesianSpace(BoundTipSpace):
    """Tip positions along some axes."""

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        rows = self._space.cut
        moved, J, J_dot = self._tips.positions(*motion)
        moved, J, J_dot = moved[..., rows], J[..., rows, :], J_dot[..., rows, :]
        inversion = self._inverse.invert(J, J_dot, *motion)
        return Measurement(moved, desired[:2] - moved, desired[1:], J, inversion.J_inv, J_dot, inversion)


class TipSpace(ABC):
    """What position and pose of the tip have in common: how joint motion follows from task motion.

    Args:
        m: number of task coordinates.
        max_condition, singularity, redundancy: see `CartesianSpace`.

    Raises:
        InputError: another word, or a limit that is not positive.
    """

    #: what measures these coordinates
    bound: type[BoundTipSpace]

    def __init__(
        self, m: int, max_condition: float, singularity: str | Damping, redundancy: Redundancy | None
    ):
        self.m = m
        self.redundancy = Redundancy() if redundancy is None else redundancy
        instance("redundancy", self.redundancy, Redundancy, "a Redundancy")
        self.damping = singularity if isinstance(singularity, Damping) else None
        if self.damping is None and choice("singularity", singularity, ("stop", "damped")) == "damped":
            self.damping = Damping()
        limit = positive_number("max_condition", max_condition)
        self.max_condition = limit if self.damping is None else np.inf

    @property
    def limits(self) -> Mapping[str, float]:
        """Names and limits of what the guard of a run watches of a `Measurement`."""
        return {"condition": self.max_condition} if self.damping is None else {}

    def bind(self, robots: Sequence[Robot]) -> BoundTipSpace:
        """This space for certain robots.

        Raises:
            InputError: a robot has fewer joints than there are task coordinates, or a redundancy that does
                not fit.
        """
        for robot in robots:
            if robot.nv < self.m:
                expected = f"expected robots with at least {self.m} joints"
                raise InputError(
                    f"{expected}, found '{robot.name}' with {robot.nv}", subject=repr(self), found=robot.nv
                )
        return self.over(Tips(robots), [[robot.nv] for robot in robots], self.redundancy.spread(robots))

    def over(
        self, tips: Kinematics, joints: ArrayLike, posture: Posture, algebra: Algebra = LAPACK
    ) -> BoundTipSpace:
        """This space over any tips, be they of numbers or of symbols.

        Args:
            tips: where the tips are.
            joints: how many joints the robots have, (..., 1).
            posture: see `Redundancy.spread`.
            algebra: of all these.
        """
        square = np.equal(joints, self.m)
        inverse = inverse_map(bool(square.all()), self.damping, posture, algebra)
        return self.bound(self, tips, inverse, square)

    @abstractmethod
    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error e, (m,), of one robot against a target, (m,), and the J, (m, nv), with e' = -J v."""


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
    bound = BoundCartesianSpace

    def __init__(
        self,
        axes: str = "xyz",
        max_condition: float = 1e4,
        singularity: str | Damping = "stop",
        redundancy: Redundancy | None = None,
    ):
        if not isinstance(axes, str) or not axes or set(axes) - set(AXES) or len(set(axes)) != len(axes):
            raise InputError.expected("different letters out of x, y, z", axes, "axes")
        super().__init__(len(axes), max_condition, singularity, redundancy)
        self.axes = axes
        self.rows = [AXES.index(a) for a in axes]
        first, last = self.rows[0], self.rows[-1]
        self.cut = slice(first, last + 1) if self.rows == [*range(first, last + 1)] else self.rows

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """The axes."""
        return tuple(self.axes)

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        return self.missed(target, pose.translation, pose.rotation, J)

    def missed(
        self, target: np.ndarray, position: np.ndarray, R: np.ndarray, J: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`miss` of tips that are at a position, (..., 3), turned by R, with a Jacobian, (..., 6, nv)."""
        return target - position[..., self.rows], J[..., self.rows, :]

    def __repr__(self) -> str:
        return f"CartesianSpace('{self.axes}')"
