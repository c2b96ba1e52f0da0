"""Friction and rotors among the parameters that the controller adapts."""

from __future__ import annotations

from types import NoneType
from typing import Self

import numpy as np

from ..checks import boolean, instance, per_joint
from ..errors import InputError
from .friction import Friction
from .parameters import FullParameters, Parameters
from .robot import Robot


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
        robot: the robot.
        friction: true friction of its joints, or None before it is known.
        base: parameters of the rigid bodies.
        armature: whether the rotors are adapted too.
        names: one per parameter.

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
