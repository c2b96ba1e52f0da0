"""What the controller may adapt: theta, and the regressor Y with Y theta = M a_ref + C v_ref + g.

Every kind of parameters belongs to one robot, as it is placed, and offers the same three things: `names`,
`theta` (the true values) and `regressor(q, v, v_ref, a_ref)`. A cell holds them against the robot of their
member: Y theta has to be its torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance
from ..errors import InputError
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
            raise InputError(f"expected {self.theta.size} names, found {len(self.names)}", subject="names")
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
