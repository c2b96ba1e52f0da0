"""What a member adapts, held against the robot it is said to describe.

The true values of parameters say what the robot's torque is. So they can only be those of this robot, as it
is placed: with parameters of another one the controller would adapt towards a robot that is not there.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from ..checks import finite_array
from ..errors import InputError, warn
from ..robots.base_parameters import KINDS, parameters_of
from ..robots.friction import Friction
from ..robots.friction_parameters import FrictionParameters
from ..robots.parameters import FullParameters, LinearParameters, Parameters
from ..robots.robot import Robot

#: random states at which torques are compared
STATES = 5
#: difference that is allowed, as a share of the largest torque of the joint, and of all joints
OF_JOINT, OF_ROBOT = 1e-6, 1e-10


def member_parameters(name: str, robot: Robot, friction: Friction, given: Any) -> Parameters:
    """The parameters of one member of a cell.

    Args:
        name: whose they are.
        robot: its robot, as it is placed.
        friction: true friction of its joints.
        given: parameters, or their name, or None for all inertial ones.

    Raises:
        InputError: an unknown name, no parameters, or parameters whose true values do not give the torque of
            this robot with, or without, its friction and rotors.
    """
    if given is None or isinstance(given, str):
        try:
            return parameters_of("full" if given is None else given, robot)
        except InputError as error:
            unknown = InputError(f"{name}, {error}")
            unknown.subject = f"{name}, {error.subject}"
            raise unknown from None
    parameters = _with_friction(name, friction, given)
    parts = ("names", "theta", "regressor")
    if isinstance(parameters, type) or not all(hasattr(parameters, part) for part in parts):
        raise InputError(
            f"expected, for example, FullParameters, found {given!r}", subject=f"{name}, parameters"
        )
    _check_sizes(name, parameters, robot)
    _check_truth(name, parameters, robot, friction)
    _check_map(name, parameters, robot)
    return parameters


def with_urdf_friction(robot: Robot, given: Any) -> Any:
    """Parameters with friction, and rotors if there are any, in the place of none or of a known name."""
    if not (given is None or (isinstance(given, str) and given in KINDS)):
        return given
    base = parameters_of("full" if given is None else given, robot)
    return FrictionParameters(robot, base=base, armature=bool(robot.armature.any()))


def _with_friction(name: str, friction: Friction, given: Any) -> Any:
    """Friction among the parameters is that of the member: the truth is stated once."""
    if not isinstance(given, FrictionParameters):
        return given
    if given.friction is None:
        try:
            return given.with_friction(friction)
        except InputError as error:
            raise InputError(f"{error}", subject=f"{name}, parameters") from None
    if given.friction is not friction:
        _check_agreement(name, friction, given.friction)
    return given


def _check_agreement(name: str, friction: Friction, stated: Friction) -> None:
    if not friction.equals(stated):
        raise InputError(
            f"FrictionParameters say {stated}, but the member's friction is {friction}; "
            "expected the true friction stated once, as Member(friction=...)",
            subject=f"{name}, parameters",
        )
    warn(
        f"{name}: its friction is stated twice; give it to the member alone, FrictionParameters(robot) takes "
        "it from there",
        DeprecationWarning,
    )


def _check_sizes(name: str, parameters: Any, robot: Robot) -> None:
    theta = finite_array(f"{name}, parameters, theta", parameters.theta, (None,))
    expected, still = (robot.nv, len(theta)), np.zeros(robot.nv)
    if len(parameters.names) != len(theta):
        raise InputError(
            f"expected a name for each of {len(theta)} values, found {len(parameters.names)}",
            subject=f"{name}, parameters",
        )
    try:
        found = np.shape(parameters.regressor(still, still, still, still))
    except ValueError as error:
        raise InputError(f"they belong to another robot: {error}", subject=f"{name}, parameters") from error
    if found != expected:
        raise InputError(
            f"expected a regressor of shape {expected} for '{robot.name}', found {found}",
            subject=f"{name}, parameters",
        )


def _check_truth(name: str, parameters: Any, robot: Robot, friction: Friction) -> None:
    """Y theta is the torque of this robot; a kind of its own may leave friction and rotors out."""
    states = _states(robot)
    found = np.array([parameters.regressor(q, v, v, a) @ parameters.theta for q, v, a in states])
    if not np.isfinite(found).all():
        raise InputError("expected a finite regressor, found one that is not", subject=f"{name}, parameters")
    off = min((_difference(found, torque) for torque in _torques(robot, friction, states)), key=max)
    if off[0] > 1:
        raise InputError(
            f"Y theta differs from the torque of robot '{robot.name}', as it is placed, "
            f"by {off[1]:.3g} N·m; expected parameters made for this robot, with its true values",
            subject=f"{name}, parameters",
        )


def _check_map(name: str, parameters: Any, robot: Robot) -> None:
    """Ready maps have to be made for this robot also where another one has the same torque."""
    rigid = parameters.base if isinstance(parameters, FrictionParameters) else parameters
    if not isinstance(rigid, (FullParameters, LinearParameters)) or rigid.robot is robot:
        return
    for q, v, a in _states(robot):
        here, there = (made.regressor(q, v, 0.5 * v, a) for made in (robot, rigid.robot))
        if here.shape != there.shape or np.abs(here - there).max() > 1e-9 * np.abs(here).max():
            raise InputError(
                f"made for robot '{rigid.robot.name}', whose regressor is another one; "
                f"expected parameters made for robot '{robot.name}', as it is placed",
                subject=f"{name}, parameters",
            )


def _states(robot: Robot) -> np.ndarray:
    """q, v and a, (STATES, 3, nv): the same ones every time."""
    return np.random.default_rng(0).uniform(-2, 2, (STATES, 3, robot.nv))


def _torques(robot: Robot, friction: Friction, states: np.ndarray) -> Iterator[np.ndarray]:
    """Torques, (STATES, nv), of the rigid bodies, with and without each kind of friction and rotors."""
    _, v, a = states.swapaxes(0, 1)
    rotors = robot.armature * a
    rigid = np.array([robot.inverse_dynamics(*state) for state in states]) - rotors
    coulomb = friction.coulomb * np.tanh(v / friction.smoothing)
    parts = friction.viscous * v, coulomb, rotors
    for shares in product((0, 1), repeat=3):
        yield rigid + sum(s * part for s, part in zip(shares, parts, strict=True))


def _difference(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """The largest difference, in multiples of what is allowed, and in N·m."""
    sizes = np.abs(expected).max(axis=0)
    off = np.abs(found - expected).max(axis=0)
    allowed = np.maximum(OF_JOINT * sizes, OF_ROBOT * sizes.max())
    return float((off / np.maximum(allowed, np.finfo(float).tiny)).max()), float(off.max())
