"""What the controller may adapt: theta, and the regressor Y with Y theta = M a_ref + C v_ref + g.

Every kind of parameters belongs to one robot, as it is placed, and offers the same three things: `names`,
`theta` (the true values) and `regressor(q, v, v_ref, a_ref)`. A cell holds them against the robot of their
member: Y theta has to be its torque. Friction and rotors may be among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import NoneType
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import boolean, finite_array, instance, per_joint
from ..errors import InputError
from .friction import Friction
from .robot import Robot


class Parameters(Protocol):
    """The parameters of one robot that a controller adapts."""

    @property
    def names(self) -> tuple[str, ...]:
        """One name per parameter."""

    @property
    def theta(self) -> np.ndarray:
        """True values, (P,)."""

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """Y, (nv, P)."""


class FullParameters:
    """All inertial parameters of all moving bodies, ten each, in Pinocchio's order."""

    def __init__(self, robot: Robot):
        instance("robot", robot, Robot, "a Robot, for example from load_robot")
        self.robot = robot
        self.names = robot.inertial_parameter_names
        self.theta = robot.inertial_parameters

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """Y, (nv, 10 bodies)."""
        return self.robot.regressor(q, v, v_ref, a_ref)


class LinearParameters:
    """A few parameters that determine the inertial ones linearly: pi = B theta, so Y_theta = Y B.

    The map must describe the robot's motion truthfully: Y B theta is compared with inverse dynamics at random
    states when the map is made.

    Args:
        robot: the robot.
        matrix: B, (10 bodies, P).
        theta: true values, (P,).
        names: one name per parameter.

    Raises:
        InputError: sizes do not fit, or Y B theta is not the robot's torque.
    """

    def __init__(self, robot: Robot, matrix: ArrayLike, theta: ArrayLike, names: Sequence[str]):
        instance("robot", robot, Robot, "a Robot, for example from load_robot")
        self.robot = robot
        self.theta = finite_array("theta", theta, (None,))
        self.matrix = finite_array("matrix", matrix, (10 * robot.body_count, self.theta.size))
        self.names = tuple(names)
        if len(self.names) != self.theta.size:
            raise InputError.expected(f"{self.theta.size} names", len(self.names), "names")
        _check_torque(robot, self)

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """Y B, (nv, P)."""
        return self.robot.regressor(q, v, v_ref, a_ref) @ self.matrix


def planar_two_link_parameters(
    robot: Robot, masses: ArrayLike = (1.0, 1.0), lengths: ArrayLike = (0.3, 0.3)
) -> LinearParameters:
    """Theta of eq. (50) for a planar arm of two uniform rods, mapped to Pinocchio's parameters.

    theta_1 is I_zz of body 1 about joint 1, theta_2 is I_zz of body 2 about joint 2, and theta_3 / l_1 is the
    first moment m c_x of body 2.

    Args:
        robot: arm with two joints about z and the second at distance l_1 along x of the first.
        masses: m_1, m_2, kg.
        lengths: l_1, l_2, m.
    """
    matrix = np.zeros((20, 3))
    matrix[9, 0] = 1.0
    matrix[19, 1] = 1.0
    matrix[11, 2] = 1.0 / finite_array("lengths", lengths, (2,))[0]
    return LinearParameters(robot, matrix, theta_50(masses, lengths), ("theta_1", "theta_2", "theta_3"))


def theta_50(masses: ArrayLike, lengths: ArrayLike) -> np.ndarray:
    """Eq. (50): the three parameters of a planar arm of two uniform rods, (3,), kg·m^2."""
    m1, m2 = finite_array("masses", masses, (2,))
    l1, l2 = finite_array("lengths", lengths, (2,))
    return np.array([m1 * l1**2 / 3 + m2 * l1**2, m2 * l2**2 / 3, m2 * l1 * l2 / 2])


def _check_torque(robot: Robot, parameters: LinearParameters) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, v, a = rng.uniform(-2, 2, (3, robot.nv))
        expected = robot.inverse_dynamics(q, v, a) - robot.armature * a  # rotors are no rigid bodies
        error = np.abs(parameters.regressor(q, v, v, a) @ parameters.theta - expected).max()
        if error > 1e-9 * (1 + np.abs(expected).max()):
            raise InputError(
                f"Y B theta differs from the torque of robot '{robot.name}' by {error:.3g} N·m; "
                "expected a map and true values that describe its dynamics",
                subject="matrix",
            )


# -- friction and rotors -----------------------------------------------------------------------------------


class FrictionParameters:
    """Parameters of the rigid bodies, and per joint a viscous, a Coulomb and, on request, a rotor's one.

    Y theta = Y_b theta_b + F_v v_ref + F_c tanh(v / smoothing) + I_a a_ref, with diagonal F_v, F_c and I_a.

    The proof keeps: M contains I_a, the plant is M v' + C v + g + F_v v + F_c tanh(v / smoothing) = tau,
    so that for s = v_ref - v

        M s' + C s = Y theta - F_v s - tau.

    The viscous column is taken at v_ref because v = v_ref - s then leaves -F_v s, which adds -s^T F_v s <= 0
    to V'. The Coulomb column is taken at v: it cancels the plant's, and nothing of it is left in V'. A rotor
    turns with its joint alone, so that I_a is constant and has no share in C. V' is then what it is without
    friction, less s^T F_v s; V itself has the errors of the friction coefficients among the others.

    The true friction is that of the member (`Member.friction`); it is stated there, and nowhere else.

    Args:
        robot: the robot.
        friction: true friction of its joints; by default that of the member to which the parameters are
            given, and until then nobody knows it. If it is given here as well it has to be the same.
        base: parameters of the rigid bodies; by default all of them.
        armature: whether the rotors are adapted too.

    Attributes:
        names: one per parameter. The arguments are attributes too; `friction` is None before it is known.

    Raises:
        InputError: coefficients that do not fit the robot, or parameters of another kind that have friction.
    """

    def __init__(
        self,
        robot: Robot,
        friction: Friction | None = None,
        base: Parameters | None = None,
        armature: bool = False,
    ):
        instance("robot", robot, Robot, "a Robot, for example from load_robot")
        instance("friction", friction, (Friction, NoneType), "a Friction, or none")
        if isinstance(base, FrictionParameters):
            raise InputError(
                "expected parameters of the rigid bodies, found some with friction", subject="base"
            )
        self.base = FullParameters(robot) if base is None else base
        self.robot, self.friction, self.armature = robot, friction, boolean("armature", armature)
        kinds = ("viscous", "coulomb", *(("armature",) if armature else ()))
        self.names = (
            *self.base.names,
            *(f"{joint}.{kind}" for kind in kinds for joint in robot.joint_names),
        )
        self._theta = None if friction is None else self._true_values(friction)

    def with_friction(self, friction: Friction) -> Self:
        """These parameters with the true friction of the joints."""
        return type(self)(self.robot, friction, self.base, self.armature)

    @property
    def theta(self) -> np.ndarray:
        """True values, (P,).

        Raises:
            InputError: the friction is not known yet.
        """
        if self._theta is None:
            raise _unknown()
        return self._theta

    @property
    def smoothing(self) -> float:
        """Velocity at which the Coulomb column reaches tanh(1), rad/s.

        Raises:
            InputError: the friction is not known yet.
        """
        if self.friction is None:
            raise _unknown()
        return self.friction.smoothing

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """[Y_b, diag(v_ref), diag(tanh(v / smoothing)), diag(a_ref)], (nv, P)."""
        Y_b = self.base.regressor(q, v, v_ref, a_ref)
        return with_friction_columns(Y_b, v, v_ref, a_ref, self.smoothing, self.armature)

    def _true_values(self, friction: Friction) -> np.ndarray:
        names = "viscous", "coulomb"
        parts = [per_joint(f"friction, {name}", getattr(friction, name), self.robot.nv) for name in names]
        return np.concatenate([self.base.theta, *parts, *([self.robot.armature] if self.armature else [])])


def friction_diagonals(
    v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray, smoothing: float | np.ndarray, armature: bool
) -> tuple[np.ndarray, ...]:
    """Diagonals of the columns beside those of the rigid bodies: v_ref, tanh(v / smoothing) and a_ref.

    Plain array arithmetic: the same line is traced with symbols.

    Args:
        v, v_ref, a_ref: (..., nv).
        smoothing: velocity at which Coulomb friction reaches tanh(1) of its value, rad/s.
        armature: whether there are columns of the rotors, the last of the three.
    """
    return (v_ref, np.tanh(v / smoothing), a_ref)[: 3 if armature else 2]


def with_friction_columns(
    Y_b: np.ndarray,
    v: np.ndarray,
    v_ref: np.ndarray,
    a_ref: np.ndarray,
    smoothing: float | np.ndarray,
    armature: bool,
) -> np.ndarray:
    """[Y_b, diag(v_ref), diag(tanh(v / smoothing)), diag(a_ref)], (..., nv, P), of Y_b, (..., nv, P_b)."""
    one = np.eye(v.shape[-1])
    diagonals = friction_diagonals(v, v_ref, a_ref, smoothing, armature)
    return np.concatenate([Y_b, *(d[..., None] * one for d in diagonals)], axis=-1)


def _unknown() -> InputError:
    return InputError(
        "expected the true friction of the joints, found none; give these parameters to a member "
        "that has it, whose `theta` are then the true values",
        subject="friction",
    )


def count_bodies(subject: str, parameters: Parameters) -> int:
    """How many bodies parameters describe, all ten numbers of each.

    Args:
        subject: what messages call them.
        parameters: what is adapted.

    Raises:
        InputError: they are not those of bodies.
    """
    base = parameters.base if type(parameters) is FrictionParameters else parameters
    if type(base) is not FullParameters:
        raise InputError(
            "expected all inertial parameters of the bodies (parameters='full'), found "
            f"{type(base).__name__} with {', '.join(base.names[:3])}",
            subject=subject,
            found=type(base).__name__,
        )
    return base.robot.body_count
