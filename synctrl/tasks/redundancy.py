"""From task space to joint space: the inverse of a square Jacobian, a weighted pseudo-inverse, a damped one.

What they share: v_ref is the joint velocity closest to a preferred one, zeta, among those that move the tip
with xref', and a_ref is the exact time derivative of v_ref. So J v_ref = xref' and J s_q = c^-1 r hold as for
a square Jacobian, and with them the proof of convergence. Only the damped inverse gives this up, near
singular configurations.

Arrays have one row per robot; with the leading axis left out they describe a single robot. No formula asks
what its numbers are: with an `Algebra` of symbols the same lines are traced for the compiled engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, non_negative_number, positive_number
from ..errors import InputError
from ..robots.robot import Robot
from .algebra import LAPACK, Algebra, padded

Posture = tuple[np.ndarray, np.ndarray, np.ndarray]
Joints = tuple[np.ndarray, np.ndarray]


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

    def of(self, robots: Sequence[Robot], i: int) -> np.ndarray | None:
        """The posture of one of the robots, (nv,), or None if there is none."""
        return None if self.posture is None else _rows("posture", self.posture, robots, 0.0)[i]

    def own(self, robots: Sequence[Robot], i: int) -> Redundancy:
        """The same for one of the robots alone."""
        weights = None if self.weights is None else _rows("weights", self.weights, robots, 1.0)[i]
        return replace(self, posture=self.of(robots, i), weights=weights)

    def spread(self, robots: Sequence[Robot]) -> Posture:
        """W^-1, posture and its gain, each (n, nv): rows padded with zeros for joints a robot does not have.

        Raises:
            InputError: not one row per robot, a row of the wrong size, or a weight that is not positive.
        """
        weights = _rows("weights", self.weights, robots, 1.0)
        if any((row <= 0).any() for row in weights):
            lowest = min(map(min, weights))
            raise InputError.expected("numbers above 0", lowest, "redundancy, weights")
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
        J_inv: J^-1 or J#, (..., nv, m).
        G: (J W^-1 J^T + lambda^2)^-1, (..., m, m), or None for the plain inverse.
        zeta, zeta_dot: preferred joint velocity and its time derivative, (..., nv), or None.
        damping: lambda, (..., 1), or None where there is none.
        damping_rate: time derivative of lambda^2, (..., 1), or None.
    """

    J_inv: np.ndarray
    G: Any = None
    zeta: Any = None
    zeta_dot: Any = None
    damping: Any = None
    damping_rate: Any = None


class Inverse:
    """J^-1, for robots with as many joints as task coordinates.

    v_ref = J^-1 xref', a_ref = J^-1 (xref'' - J' v_ref).

    Args:
        algebra: of the numbers, or symbols, that it works on.
    """

    def __init__(self, algebra: Algebra = LAPACK):
        self.algebra = algebra

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        """Everything about this instant that does not depend on the reference."""
        return Inversion(self.algebra.inverse(J))

    def to_joints(self, task: Any, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> Joints:
        """v_ref and a_ref = d/dt v_ref, (..., nv), from the reference in task space, (..., m).

        Args:
            task: J, J_inv, J_dot and inversion of this instant, for example a `Measurement`.
            xref_dot, xref_ddot: the reference.
        """
        J_inv = task.J_inv
        v_ref = np.matvec(J_inv, xref_dot)
        return v_ref, np.matvec(J_inv, xref_ddot - np.matvec(task.J_dot, v_ref))


class Pseudoinverse(Inverse):
    """J# = W^-1 J^T G with G = (J W^-1 J^T)^-1, and a posture task in its null space.

    With mu = G (xref' - J zeta):

        v_ref = zeta + W^-1 J^T mu                               = J# xref' + (1 - J# J) zeta
        h     = zeta' + W^-1 J'^T mu
        a_ref = h + J# (xref'' - J' v_ref - J h)

    Args:
        W_inv: diagonal of W^-1, (..., nv), zero for joints that a robot does not have.
        posture: preferred joint positions, (..., nv), rad.
        gain: (..., nv), 1/s.
        algebra: of the numbers.
    """

    def __init__(self, W_inv: np.ndarray, posture: np.ndarray, gain: np.ndarray, algebra: Algebra = LAPACK):
        super().__init__(algebra)
        self.W_inv, self.posture, self.gain = W_inv, posture, gain

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        return self._inversion(J, q, v)

    def to_joints(self, task: Any, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> Joints:
        J, J_dot, inversion = task.J, task.J_dot, task.inversion
        J_inv, G, zeta, zeta_dot = inversion[:4]
        gap = xref_dot - np.matvec(J, zeta)
        mu = np.matvec(G, gap)
        v_ref = zeta + np.matvec(J_inv, gap)
        h = zeta_dot + self.W_inv * np.matvec(J_dot.mT, mu)
        needed = xref_ddot - np.matvec(J_dot, v_ref) - np.matvec(J, h)
        return v_ref, h + np.matvec(J_inv, needed - self._damping_force(inversion, mu))

    def _inversion(self, J: np.ndarray, q: np.ndarray, v: np.ndarray, more: Any = 0.0) -> Inversion:
        """With something added to J W^-1 J^T."""
        W_inv_JT = self.W_inv[..., None] * J.mT
        G = self.algebra.inverse(J @ W_inv_JT + more)
        return Inversion(W_inv_JT @ G, G, self.gain * (self.posture - q), -self.gain * v)

    def _damping_force(self, inversion: Inversion, mu: np.ndarray) -> np.ndarray | float:
        return 0.0


class DampedInverse(Pseudoinverse):
    """The pseudo-inverse with damping near singular configurations, G = (J W^-1 J^T + lambda^2)^-1.

    The formulas of `Pseudoinverse` hold with this G, and a_ref stays the exact derivative of v_ref when
    (lambda^2)' mu is subtracted from the acceleration needed. What is lost: J v_ref = xref' - lambda^2 mu.

    Args:
        damping: threshold and size.
    """

    def __init__(
        self,
        W_inv: np.ndarray,
        posture: np.ndarray,
        gain: np.ndarray,
        damping: Damping,
        algebra: Algebra = LAPACK,
    ):
        super().__init__(W_inv, posture, gain, algebra)
        self._threshold, self._largest = damping.threshold**2, damping.largest

    def invert(self, J: np.ndarray, J_dot: np.ndarray, q: np.ndarray, v: np.ndarray) -> Inversion:
        square, direction = self.algebra.smallest(J @ (self.W_inv[..., None] * J.mT))
        depth = 1 - square / self._threshold
        damping = self._largest * 0.5 * (depth + abs(depth))
        moved = np.matvec(J_dot.mT, direction) * np.matvec(J.mT, direction) * self.W_inv
        rate = -4 * self._largest / self._threshold * damping * moved.sum(-1, keepdims=True)
        more = (damping**2)[..., None] * np.eye(J.shape[-2])
        return self._inversion(J, q, v, more)._replace(damping=damping, damping_rate=rate)

    def _damping_force(self, inversion: Inversion, mu: np.ndarray) -> np.ndarray:
        return inversion.damping_rate * mu


def velocity_lost(J: np.ndarray, v_ref: np.ndarray, xref_dot: np.ndarray) -> np.ndarray:
    """|xref' - J v_ref|, (..., 1): how much of a reference velocity damping leaves out, task unit per s."""
    lost = xref_dot - np.matvec(J, v_ref)
    return np.sqrt((lost * lost).sum(-1, keepdims=True))


def inverse_map(
    square: bool, damping: Damping | None, posture: Posture, algebra: Algebra = LAPACK
) -> Inverse:
    """The way to the joints of robots.

    Args:
        square: whether all have as many joints as there are task coordinates.
        damping: of singular configurations, if any.
        posture: W^-1, posture and its gain, see `Redundancy.spread`.
        algebra: of the numbers.
    """
    if damping is not None:
        return DampedInverse(*posture, damping, algebra)
    return Inverse(algebra) if square else Pseudoinverse(*posture, algebra)


def _rows(name: str, value: ArrayLike | None, robots: Sequence[Robot], default: float) -> list[np.ndarray]:
    """One (nv,) per robot, from one for all or a list of them."""
    if value is None:
        return [np.full(robot.nv, default) for robot in robots]
    where = f"redundancy, {name}"
    given: Any = list(value) if isinstance(value, np.ndarray) and value.ndim else value
    if not isinstance(given, (list, tuple)) or not len(given) or np.ndim(given[0]) > 1:
        raise InputError.expected("one row of numbers, or a list of rows", value, where)
    rows = given if np.ndim(given[0]) else [given] * len(robots)
    if len(rows) != len(robots):
        raise InputError.expected(f"{len(robots)} rows, one per robot", len(rows), where)
    return [
        finite_array(f"{where} of '{robot.name}'", row, (robot.nv,))
        for robot, row in zip(robots, rows, strict=True)
    ]
