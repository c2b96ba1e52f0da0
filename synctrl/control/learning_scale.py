"""How far parameters may be from what is known of them: the sizes that rates of adaptation follow."""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from ..errors import InputError
from ..robots.base_parameters import BaseParameters
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters, Parameters
from ..robots.pseudo_inertia import pullback
from ..robots.robot import Robot

#: friction and rotors, as a share of the torque of gravity and of the inertia
SHARE = 0.1


@singledispatch
def learning_scale(parameters: Parameters, robot: Robot, q: np.ndarray) -> np.ndarray:
    """The square of how far each parameter may be from what is known of it, (P,).

    Args:
        parameters: what is adapted.
        robot: as heavy as it may be.
        q: joint positions along its path, (K, nv).

    Raises:
        InputError: parameters of another kind than this package's.
    """
    expected, found = (
        "FullParameters, BaseParameters, LinearParameters or FrictionParameters",
        type(parameters),
    )
    raise InputError.expected(expected, found.__name__, "parameters", shown=found.__name__)


@learning_scale.register
def _(parameters: FullParameters, robot: Robot, q: np.ndarray) -> np.ndarray:
    return pullback(robot.inertial_parameters)


@learning_scale.register
def _(parameters: LinearParameters, robot: Robot, q: np.ndarray) -> np.ndarray:
    """theta may be as far as the first of the inertial parameters that it changes allows."""
    return 1 / ((parameters.matrix**2).T @ (1 / pullback(robot.inertial_parameters)))


@learning_scale.register
def _(parameters: BaseParameters, robot: Robot, q: np.ndarray) -> np.ndarray:
    """theta_base = K pi."""
    return parameters.grouping.K**2 @ pullback(robot.inertial_parameters)


@learning_scale.register
def _(parameters: FrictionParameters, robot: Robot, q: np.ndarray) -> np.ndarray:
    """At 1 rad/s, friction of each kind may take a share of the largest torque of gravity."""
    torque = np.abs([robot.gravity(row) for row in q]).max(axis=0)
    inertia = np.mean([np.diag(robot.mass_matrix(row)) for row in q], axis=0)
    friction = (SHARE * np.maximum(torque, inertia)) ** 2
    rotors = [(SHARE * inertia) ** 2] if parameters.armature else []
    return np.concatenate([learning_scale(parameters.base, robot, q), friction, friction, *rotors])
