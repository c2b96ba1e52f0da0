"""Checks of what a member of a cell is made of, before anything relies on it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks import finite_array, instance, label, per_joint
from ..errors import InputError, RobotWarning, warn
from ..robots.friction import Friction
from ..robots.robot import Robot
from ..tasks.trajectories import MOTION_PARTS


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
        raise InputError(f"expected another one for each robot, found {twice[0]!r} twice", subject="name")


def check_labels(cell: Any) -> None:
    """Refuse words of a cell that the figures and files of its runs could not hold.

    Raises:
        InputError: a name or unit that is not a text of one line, or two coordinates of one name.
    """
    for unit in cell.units:
        label("space: unit", unit)
    if len(cell.units) != cell.m:
        raise InputError(
            f"expected one for each of {cell.m} coordinates, found {len(cell.units)}", subject="space: units"
        )
    label("coupling: name", cell.coupling.name)
    label("coupling: unit", cell.coupling.unit)
    for axis in cell.labels:
        label("space: name of a coordinate", axis)
        if not axis.strip():
            raise InputError(
                f"expected a word as the name of every coordinate, found {axis!r}", subject="space"
            )
    if len({*cell.labels}) < len(cell.labels):
        raise InputError(
            f"expected coordinates of different names, found {', '.join(cell.labels)}", subject="space"
        )
    for name, robot, parameters in zip(cell.names, cell.robots, cell.parameters, strict=True):
        for word in (robot.name, *robot.joint_names, *parameters.names):
            label(f"{name}: name of a joint or parameter", word)


def check_space(space: Any) -> None:
    """Refuse what is no space.

    Raises:
        InputError: no object with `labels`, `unit` and `bind`.
    """
    if isinstance(space, type) or not all(hasattr(space, part) for part in ("labels", "unit", "bind")):
        raise InputError(
            f"expected a space, for example CartesianSpace('xy'), found {space!r}", subject="space"
        )


def check_trajectory(name: str, trajectory: Any, labels: tuple[str, ...]) -> None:
    """Refuse what is no desired motion of the task's dimension.

    Args:
        name: whose it is.
        trajectory: the desired motion.
        labels: names of the task coordinates, (m,).

    Raises:
        InputError: no trajectory, another dimension, or a motion at t = 0 that is not finite.
    """
    if not callable(trajectory) or not hasattr(trajectory, "dimension") or not hasattr(trajectory, "breaks"):
        raise InputError(
            f"expected a trajectory such as Hold, found {trajectory!r}", subject=f"{name}, trajectory"
        )
    m = len(labels)
    if trajectory.dimension != m:
        raise InputError(
            f"expected {m} coordinates ({', '.join(labels)}), found {trajectory.dimension}",
            subject=f"{name}, trajectory",
        )
    motion = trajectory(np.zeros(1))
    if not isinstance(motion, tuple) or len(motion) != 3:
        raise InputError(
            f"expected position, velocity and acceleration, found {motion!r}", subject=f"{name}, trajectory"
        )
    for part, value in zip(MOTION_PARTS, motion, strict=True):
        finite_array(f"{name}, trajectory, {part} at t = 0 s", value, (1, m))


def check_friction(name: str, friction: Any, robot: Robot) -> None:
    """Refuse what is no friction of the robot's joints.

    Raises:
        InputError: no Friction, or coefficients for another number of joints.
    """
    instance(f"{name}, friction", friction, Friction, "a Friction, or 'urdf'")
    for part in ("viscous", "coulomb"):
        per_joint(f"{name}, friction, {part}", getattr(friction, part), robot.nv)


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
