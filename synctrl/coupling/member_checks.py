"""What the members of a cell are made of, checked before anything relies on it.

The true values of parameters say what the torque of a robot is. So they can only be those of this robot, as
it is placed: with parameters of another one the controller would adapt towards a robot that is not there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from ..checks import finite_array, instance, label, offers, per_joint
from ..errors import InputError, RobotWarning, warn
from ..robots.base_parameters import KINDS, parameters_of
from ..robots.friction import Friction
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters, Parameters
from ..robots.robot import Robot
from ..tasks.trajectories import MOTION_PARTS

#: random states at which torques are compared
STATES = 5
#: difference that is allowed, as a share of the largest torque of the joint, and of all joints
OF_JOINT, OF_ROBOT = 1e-6, 1e-10


def check_names(cell: str, names: Sequence[str]) -> None:
    """Refuse names that cannot tell robots apart.

    Args:
        cell: name of the cell.
        names: of its robots.

    Raises:
        InputError: a name that is no text, or two robots of one name.
    """
    for name in (cell, *names):
        label("name", name)
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(
            f"expected another one for each robot, found {twice[0]!r} twice", subject="name", found=twice[0]
        )


def check_labels(cell: Any) -> None:
    """Refuse words of a cell that the figures and files of its runs could not hold.

    Raises:
        InputError: a name or unit that is not a text of one line, or two coordinates of one name.
    """
    for unit in cell.units:
        label("space: unit", unit)
    if len(cell.units) != cell.m:
        raise InputError.expected(f"one for each of {cell.m} coordinates", len(cell.units), "space: units")
    label("coupling: name", cell.coupling.name)
    label("coupling: unit", cell.coupling.unit)
    for axis in cell.labels:
        label("space: name of a coordinate", axis)
    if not all(map(str.strip, cell.labels)) or len({*cell.labels}) < len(cell.labels):
        expected = "expected a word of its own as the name of every coordinate"
        found = ", ".join(map(repr, cell.labels))
        raise InputError(f"{expected}, found {found}", subject="space", found=cell.labels)
    for name, robot, parameters in zip(cell.names, cell.robots, cell.parameters, strict=True):
        for word in (robot.name, *robot.joint_names, *parameters.names):
            label(f"{name}: name of a joint or parameter", word)


def check_trajectory(name: str, trajectory: Any, labels: tuple[str, ...]) -> None:
    """Refuse what is no desired motion of the task's dimension.

    Args:
        name: whose it is.
        trajectory: the desired motion.
        labels: names of the task coordinates, (m,).

    Raises:
        InputError: no trajectory, another dimension, or a motion at t = 0 that is not finite.
    """
    where, m = f"{name}, trajectory", len(labels)
    offers(where, trajectory, ("__call__", "dimension", "breaks"), "a trajectory such as Hold")
    if trajectory.dimension != m:
        raise InputError.expected(f"{m} coordinates ({', '.join(labels)})", trajectory.dimension, where)
    motion = trajectory(np.zeros(1))
    if not isinstance(motion, tuple) or len(motion) != 3:
        raise InputError.expected("position, velocity and acceleration", motion, where)
    for part, value in zip(MOTION_PARTS, motion, strict=True):
        finite_array(f"{where}, {part} at t = 0 s", value, (1, m))


def check_friction(name: str, friction: Any, robot: Robot) -> None:
    """Refuse what is no friction of the robot's joints.

    Raises:
        InputError: no Friction, or coefficients for another number of joints.
    """
    instance(f"{name}, friction", friction, Friction, "a Friction, or 'urdf'")
    for part in ("viscous", "coulomb"):
        per_joint(f"{name}, friction, {part}", getattr(friction, part), robot.nv)


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
            where = f"{name}, {error.subject}"
            raise InputError(error.problem, subject=where, found=error.found) from None
    parameters = _with_friction(name, friction, given)
    where = f"{name}, parameters"
    offers(where, parameters, ("names", "theta", "regressor"), "parameters, for example FullParameters")
    _check_sizes(where, parameters, robot)
    _check_truth(where, parameters, robot, friction)
    _check_map(where, parameters, robot)
    return parameters


def first_estimates(name: str, parameters: Parameters, given: Any) -> np.ndarray:
    """Estimates at t = 0, (P,), of a robot; zeros where none are given.

    Raises:
        InputError: not one finite number for each of the parameters, whose names the message has.
    """
    size = len(parameters.theta)
    estimates = finite_array(f"{name}, theta_hat0", np.zeros(size) if given is None else given)
    if estimates.shape != (size,):
        raise InputError.expected(
            f"shape ({size},), a number for each of what is adapted ({parameters.names[0]} to "
            f"{parameters.names[-1]}, true values in Member.theta)",
            estimates.shape,
            f"{name}, theta_hat0",
        )
    return estimates


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
    if not friction.equals(given.friction):
        raise InputError(
            f"FrictionParameters say {given.friction}, but the member's friction is {friction}; "
            "expected the true friction stated once, as Member(friction=...)",
            subject=f"{name}, parameters",
        )
    if given.friction is not friction:
        once = "give it to the member alone, FrictionParameters(robot) takes it from there"
        warn(f"{name}: its friction is stated twice; {once}", DeprecationWarning)
    return given


def _check_sizes(where: str, parameters: Any, robot: Robot) -> None:
    theta = finite_array(f"{where}, theta", parameters.theta, (None,))
    expected, still = (robot.nv, len(theta)), np.zeros(robot.nv)
    if len(parameters.names) != len(theta):
        raise InputError.expected(f"a name for each of {len(theta)} values", len(parameters.names), where)
    try:
        found = np.shape(parameters.regressor(still, still, still, still))
    except ValueError as error:
        raise InputError(f"they belong to another robot: {error}", subject=where) from error
    if found != expected:
        raise InputError.expected(f"a regressor of shape {expected} for '{robot.name}'", found, where)


def _check_truth(where: str, parameters: Any, robot: Robot, friction: Friction) -> None:
    """Y theta is the torque of this robot; a kind of its own may leave friction and rotors out."""
    states = _states(robot.nv)
    found = np.array([parameters.regressor(q, v, v, a) @ parameters.theta for q, v, a in states])
    if not np.isfinite(found).all():
        raise InputError("expected a finite regressor, found one that is not", subject=where)
    off = min((_difference(found, torque) for torque in _torques(robot, friction, states)), key=max)
    if off[0] > 1:
        raise InputError(
            f"Y theta differs from the torque of robot '{robot.name}', as it is placed, "
            f"by {off[1]:.3g} N·m; expected parameters made for this robot, with its true values",
            subject=where,
        )


def _check_map(where: str, parameters: Any, robot: Robot) -> None:
    """Ready maps have to be made for this robot also where another one has the same torque."""
    rigid = parameters.base if isinstance(parameters, FrictionParameters) else parameters
    if not isinstance(rigid, (FullParameters, LinearParameters)) or rigid.robot is robot:
        return
    for q, v, a in _states(robot.nv):
        here, there = (made.regressor(q, v, 0.5 * v, a) for made in (robot, rigid.robot))
        if here.shape != there.shape or np.abs(here - there).max() > 1e-9 * np.abs(here).max():
            raise InputError(
                f"made for robot '{rigid.robot.name}', whose regressor is another one; "
                f"expected parameters made for robot '{robot.name}', as it is placed",
                subject=where,
            )


@cache
def _states(nv: int) -> np.ndarray:
    """q, v and a, (STATES, 3, nv): the same ones every time."""
    states = np.random.default_rng(0).uniform(-2, 2, (STATES, 3, nv))
    states.flags.writeable = False
    return states


def _torques(robot: Robot, friction: Friction, states: np.ndarray) -> Iterator[np.ndarray]:
    """Torques, (STATES, nv), of the rigid bodies, with and without each kind of friction and rotors."""
    _, v, a = states.swapaxes(0, 1)
    rotors = robot.armature * a
    rigid = np.array([robot.inverse_dynamics(*state) for state in states]) - rotors
    coulomb = friction.coulomb * np.tanh(v / friction.smoothing)
    parts = [part for part in (friction.viscous * v, coulomb, rotors) if part.any()]
    for shares in product((0, 1), repeat=len(parts)):
        yield rigid + sum(s * part for s, part in zip(shares, parts, strict=True))


def _difference(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """The largest difference, in multiples of what is allowed, and in N·m."""
    sizes = np.abs(expected).max(axis=0)
    off = np.abs(found - expected).max(axis=0)
    allowed = np.maximum(OF_JOINT * sizes, OF_ROBOT * sizes.max())
    return float((off / np.maximum(allowed, np.finfo(float).tiny)).max()), float(off.max())


def warn_of_unasked_friction(cell: Any) -> None:
    """Say which robots have friction that nobody has asked for, and that does not act.

    Warns:
        RobotWarning: a description states friction, and its member says neither that it acts nor another one.
    """
    stated = {
        name: member.robot.urdf_friction
        for name, member in zip(cell.names, cell.members, strict=True)
        if member.friction_from == "nobody"
    }
    rubbing = [name for name, friction in stated.items() if friction.viscous.any() or friction.coulomb.any()]
    if rubbing:
        warn(
            f"{cell.name}: the descriptions of {', '.join(rubbing)} state friction, which does not act; give "
            "Member(..., friction='urdf') to let it, or friction=Friction() to leave it out",
            RobotWarning,
        )
