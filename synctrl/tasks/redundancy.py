"""From task space to joint space: the inverse of a square Jacobian, a weighted pseudo-inverse, a damped one.

Each is made for the robots of a cell and works on all of them at once. What they share: v_ref is the joint
velocity closest to a preferred one, zeta, among those that move the tip with xref', and a_ref is the exact
time derivative of v_ref. So J v_ref = xref' and J s_q = c^-1 r hold as for a square Jacobian, and with them
the proof of convergence. Only the damped inverse gives this up, near singular configurations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, non_negative_number, positive_number
from ..errors import InputError
from ..robots.robot import Robot
from .padding import padded

#: signs of the cofactors of a matrix with two rows
_CHECKERED = np.array([[1.0, -1.0], [-1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Redundancy:
    """What an arm does with the joints that its task leaves free.

    The pseudo-inverse is J# = W^-1 J^T (J W^-1 J^T)^-1, and the preferred joint velocity
    zeta = gain (posture - q) acts in the null space of J: v_ref = J# xref' + (1 - J# J) zeta. Robots with as
    many joints as task coordinates have no null space: nothing here has an effect on them, unless singular
    configurations are damped. Then W decides where that begins and how much of it each joint takes, and near
    them, where 1 - J# J is not zero, the posture acts too. Damping that acts in task space
    (`k_r_space="task"`) leaves motion in the null space undamped: prefer joint space.

    Args:
        posture: preferred joint positions, (nv,) for every robot, or a list with one (nv,) per robot, rad; by
            default none: the joint velocity is then the smallest one in the sense of W.
        gain: how fast the posture is approached, 1/s.
        weights: diagonal of W, above 0, (nv,) for every robot, or a list with one (nv,) per robot: a joint
            with a larger weight moves less. By default 1.

    Raises:
        InputError: not finite, or of the wrong sign.
    """

    posture: Any = None
    gain: float = 1.0
    weights: Any = None

    def __post_init__(self) -> None:
        non_negative_number("redundancy, gain", self.gain)

    def spread(self, robots: Sequence[Robot]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """W^-1, posture and its gain, each (n, nv): rows padded with zeros for joints a robot does not have.

        Raises:
            InputError: not one row per robot, a row of the wrong size, or a weight that is not positive.
        """
        weights = _rows("weights", self.weights, robots, 1.0)
        if any((row <= 0).any() for row in weights):
            raise InputError(f"redundancy, weights: expected numbers above 0, found {min(map(min, weights))}")
        gain = 0.0 if self.posture is None else self.gain
        posture = _rows("posture", self.posture, robots, 0.0)
        gains = [np.full(robot.nv, gain) for robot in robots]
        return padded([1 / row for row in weights]), padded(posture), padded(gains)


@dataclass(frozen=True)
class Damping:
    """Damped least squares near singular configurations.

    With s the smallest singular value of J W^-1/2, J# = W^-1 J^T (J W^-1 J^T + lambda^2)^-1 where
    lambda = largest (1 - s^2 / threshold^2) for s below the threshold, and 0 above it. There the reference
    velocity is only followed in part, and the proof of convergence does not hold.

    Args:
        threshold: of the smallest singular value, m per rad (metres and radians mix in a full pose).
        largest: lambda at the singular configuration itself, same unit.

    Raises:
        InputError: not positive.
    """

    threshold: float = 0.05
    largest: float = 0.05

    def __post_init__(self) -> None:
        positive_number("damping, threshold", self.threshold)
        positive_number("damping, largest", self.largest)


class Inversion(NamedTuple):
    """What one evaluation knows about the way from task space to joint space.

    Attributes:
        J_inv: J^-1 or J#, (n, nv, m).
        G: (J W^-1 J^T + lambda^2)^-1, (n, m, m), or None for the plain inverse.
        zeta, zeta_dot: preferred joint velocity and its time derivative, (n, nv).
        damping: lambda, (n,), or None where there is none.
        damping_rate: time derivative of lambda^2, (n,).
    """

    J_inv: np.ndarray
    G: Any = None
    zeta: Any = None
    zeta_dot: Any = None
    damping: np.ndarray | None = None
    damping_rate: Any = None


class Inverted(Protocol):
    """What a way to joint space needs to know of an instant; a `Measurement` does."""

    J: Any
    J_inv: Any
    J_dot: Any
    inversion: Any


class InverseMap(Protocol):
    """A way from task space to joint space."""

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        """Everything about this instant that does not depend on the reference."""

    def to_joints(
        self, task: Inverted, xref_dot: np.ndarray, xref_ddot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """v_ref and a_ref = d/dt v_ref, (n, nv), from the reference in task space, (n, m)."""


class Inverse:
    """J^-1, for robots with as many joints as task coordinates.

    v_ref = J^-1 xref', a_ref = J^-1 (xref'' - J' v_ref).
    """

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        return Inversion(inverse(J))

    def to_joints(
        self, task: Inverted, xref_dot: np.ndarray, xref_ddot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        J_inv = task.J_inv
        v_ref = np.matvec(J_inv, xref_dot)
        return v_ref, np.matvec(J_inv, xref_ddot - np.matvec(task.J_dot, v_ref))


class Pseudoinverse:
    """J# = W^-1 J^T G with G = (J W^-1 J^T)^-1, and a posture task in its null space.

    With mu = G (xref' - J zeta):

        v_ref = zeta + W^-1 J^T mu                               = J# xref' + (1 - J# J) zeta
        h     = zeta' + W^-1 J'^T mu
        a_ref = h + J# (xref'' - J' v_ref - J h)

    Args:
        W_inv: diagonal of W^-1, (n, nv), zero for joints that a robot does not have.
        posture: preferred joint positions, (n, nv), rad.
        gain: (n, nv), 1/s.
    """

    def __init__(self, W_inv: np.ndarray, posture: np.ndarray, gain: np.ndarray):
        self.W_inv, self.posture, self.gain = W_inv, posture, gain

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        W_inv_JT = self.W_inv[:, :, None] * np.swapaxes(J, 1, 2)
        G = inverse(J @ W_inv_JT)
        return Inversion(W_inv_JT @ G, G, *self._preferred(q, v))

    def to_joints(
        self, task: Inverted, xref_dot: np.ndarray, xref_ddot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        J, J_dot, inversion = task.J, task.J_dot, task.inversion
        J_inv, G, zeta, zeta_dot = inversion[:4]
        gap = xref_dot - np.matvec(J, zeta)
        mu = np.matvec(G, gap)
        v_ref = zeta + np.matvec(J_inv, gap)
        h = zeta_dot + self.W_inv * np.vecmat(mu, J_dot)
        needed = xref_ddot - np.matvec(J_dot, v_ref) - np.matvec(J, h)
        return v_ref, h + np.matvec(J_inv, needed - self._damping_force(inversion, mu))

    def _preferred(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """zeta = gain (posture - q) and its time derivative."""
        return self.gain * (self.posture - q), -self.gain * v

    def _damping_force(self, inversion: Inversion, mu: np.ndarray) -> np.ndarray | float:
        return 0.0


class DampedInverse(Pseudoinverse):
    """The pseudo-inverse with damping near singular configurations, G = (J W^-1 J^T + lambda^2)^-1.

    The formulas of `Pseudoinverse` hold with this G, and a_ref stays the exact derivative of v_ref when
    (lambda^2)' mu is subtracted from the acceleration needed. What is lost: J v_ref = xref' - lambda^2 mu.

    Args:
        damping: threshold and size.
    """

    def __init__(self, W_inv: np.ndarray, posture: np.ndarray, gain: np.ndarray, damping: Damping):
        super().__init__(W_inv, posture, gain)
        self._threshold, self._largest = damping.threshold**2, damping.largest

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        W_inv_JT = self.W_inv[:, :, None] * np.swapaxes(J, 1, 2)
        A = J @ W_inv_JT
        square, direction = _smallest(A)
        depth = np.maximum(1 - square / self._threshold, 0.0)
        damping = self._largest * depth
        square_dot = 2 * (np.vecmat(direction, J_dot) * np.vecmat(direction, J) * self.W_inv).sum(-1)
        rate = -2 * self._largest * damping * square_dot / self._threshold
        G = inverse(A + (damping**2)[:, None, None] * np.eye(A.shape[-1]))
        return Inversion(W_inv_JT @ G, G, *self._preferred(q, v), damping, rate)

    def _damping_force(self, inversion: Inversion, mu: np.ndarray) -> np.ndarray:
        return inversion.damping_rate[:, None] * mu


def inverse_map(
    robots: Sequence[Robot], m: int, redundancy: Redundancy, damping: Damping | None
) -> InverseMap:
    """The way from m task coordinates to the joints of these robots."""
    if damping is not None:
        return DampedInverse(*redundancy.spread(robots), damping)
    if all(robot.nv == m for robot in robots):
        return Inverse()
    return Pseudoinverse(*redundancy.spread(robots))


def inverse(A: np.ndarray) -> np.ndarray:
    """A^-1 row by row; nothing finite where there is none, so that the run's guard can name the robot."""
    if A.shape[-1] == 2:
        with np.errstate(divide="ignore", invalid="ignore"):
            minors = A[:, :1, :1] * A[:, 1:, 1:] - A[:, :1, 1:] * A[:, 1:, :1]
            return _CHECKERED * A[:, ::-1, ::-1].mT / minors
    try:
        return np.linalg.inv(A)
    except np.linalg.LinAlgError:
        regular = np.linalg.det(A) != 0
        result = np.full_like(A, np.nan)
        result[regular] = np.linalg.inv(A[regular])
        return result


def determinant(A: np.ndarray) -> np.ndarray:
    """det(A) row by row, (n,), of square matrices."""
    if A.shape[-1] == 2:
        return A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]
    return np.linalg.det(A)


def _smallest(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest eigenvalue, (n,), and its eigenvector, (n, m), of symmetric matrices."""
    if not np.isfinite(A).all():
        return np.full(len(A), np.nan), np.full(A.shape[:2], np.nan)
    values, vectors = np.linalg.eigh(A)
    return values[:, 0], vectors[:, :, 0]


def _rows(name: str, value: ArrayLike | None, robots: Sequence[Robot], default: float) -> list[np.ndarray]:
    """One (nv,) per robot, from one for all or a list of them."""
    if value is None:
        return [np.full(robot.nv, default) for robot in robots]
    if not isinstance(value, (Sequence, np.ndarray)) or isinstance(value, str) or np.ndim(value[0]) > 1:
        raise InputError(
            f"redundancy, {name}: expected one row of numbers, or a list of rows, found {value!r}"
        )
    rows: Any = value if np.ndim(value[0]) else [value] * len(robots)
    if len(rows) != len(robots):
        raise InputError(f"redundancy, {name}: expected {len(robots)} rows, one per robot, found {len(rows)}")
    return [
        finite_array(f"redundancy, {name} of '{robot.name}'", row, (robot.nv,))
        for robot, row in zip(robots, rows, strict=True)
    ]
