"""Robots in cell files: where they come from, what is done to them, what is adapted, and their friction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..robots.base_parameters import parameters_of
from ..robots.catalog import load_robot
from ..robots.friction import Friction
from ..robots.parameters import (
    FrictionParameters,
    LinearParameters,
    Parameters,
    planar_two_link_parameters,
)
from ..robots.payload import Payload, carrying, holding
from ..robots.robot import Robot
from .kinds import kind, one_of, table_or
from .values import (
    ANGLE,
    ANGLES,
    ANY_NUMBERS,
    FILE,
    INERTIA,
    NUMBER,
    NUMBERS,
    ROTATION,
    SOURCE,
    TEXT,
    TRUTH,
    VECTOR,
    by_name,
    choice,
    list_of,
    scalar,
)

Change = Callable[[Robot], Robot]


class Base(NamedTuple):
    """Where a robot stands.

    Args:
        xyz: displacement in the world, (3,), m.
        rpy: rotation about the fixed world axes x, y, z in that order, (3,), rad.
        name: what legends call the robot; by default the name that it has in the cell.
    """

    xyz: Any = (0.0, 0.0, 0.0)
    rpy: Any = (0.0, 0.0, 0.0)
    name: str | None = None


def inertial(mass: float, com: Any, inertia: Any) -> dict[str, Any]:
    """Inertia of a link in the place of what its file says.

    Args:
        mass: kg.
        com: centre of mass in the link's axes, (3,), m.
        inertia: about the centre of mass, (3, 3), kg·m^2.
    """
    return {"mass": mass, "com": com, "inertia": inertia}


def tool(xyz: ArrayLike, rotation: ArrayLike | None = None, name: str = "tool") -> Change:
    """The robot is controlled at a frame of something that its tip holds, which weighs nothing.

    Args:
        xyz: place of the frame in the axes of the robot's tip, (3,), m.
        rotation: its orientation there, a matrix or three angles about x, y, z in that order, rad.
        name: of the frame.
    """
    return lambda robot: holding(robot, xyz, np.eye(3) if rotation is None else rotation, name)


def load(mass: float, com: Any = (0.0, 0.0, 0.0), inertia: Any = None, frame: str | None = None) -> Change:
    """The robot has a body fixed to it, which counts among what it is.

    Args:
        mass: kg.
        com: centre of mass in the frame, (3,), m.
        inertia: about the centre of mass, (3, 3), or (3,) for its diagonal, kg·m^2; by default that of a
            uniform ball of the density of water.
        frame: that holds it; by default the robot's tip.
    """
    return lambda robot: carrying(robot, Payload(0, mass, com, inertia, frame))


def tip(tip: str) -> Change:
    """The robot is controlled at another frame of its description.

    Args:
        tip: name of the frame.
    """
    return lambda robot: robot.with_tip(tip)


def bodies(pi: ArrayLike) -> Change:
    """The robot has other inertial parameters.

    Args:
        pi: ten for each body, in Pinocchio's order, (10 bodies,).
    """
    return lambda robot: robot.with_parameters(pi)


def rotors(armature: ArrayLike) -> Change:
    """The robot has rotors that turn with its joints.

    Args:
        armature: rotor inertia times the square of the gear ratio, one number or one per joint, kg·m^2.
    """
    return lambda robot: robot.with_armature(armature)


def weightless() -> Change:
    """The robot is where there is no gravity."""
    return lambda robot: robot.weightless()


def moved(xyz: Any = (0.0, 0.0, 0.0), rpy: Any = (0.0, 0.0, 0.0), name: str | None = None) -> Change:
    """The base is moved once more.

    Args:
        xyz: displacement in the world, (3,), m.
        rpy: rotation about the fixed world axes x, y, z in that order, (3,), rad.
        name: of the robot from then on.
    """
    return lambda robot: robot.placed(xyz, rpy, name)


BASE = kind("", None, Base, xyz=VECTOR, rpy=ANGLES, name=TEXT)
INERTIAL = kind("", None, inertial, mass=NUMBER, com=VECTOR, inertia=INERTIA)
CHANGES = {
    "holding": kind("tool", None, tool, xyz=VECTOR, rotation=ROTATION, name=TEXT),
    "carrying": kind("load", None, load, mass=NUMBER, com=VECTOR, inertia=INERTIA, frame=TEXT),
    "with_tip": kind("tip", None, tip, tip=TEXT),
    "with_parameters": kind("bodies", None, bodies, pi=VECTOR),
    "with_armature": kind("rotors", None, rotors, armature=NUMBERS),
    "weightless": kind("weightless", None, weightless),
    "placed": kind("moved", None, moved, xyz=VECTOR, rpy=ANGLES, name=TEXT),
}


def arm(
    robot: str | Path,
    tip: str | None = None,
    locked: Mapping[str, float] | None = None,
    packages: Sequence[Path] = (),
    inertials: Mapping[str, Any] | None = None,
    strict: bool = False,
    xacro: Mapping[str, Any] | None = None,
    gravity: bool = True,
    base: Base | None = None,
    changes: Sequence[Change] = (),
    load: Callable[..., Robot] = load_robot,
) -> Robot:
    """A robot, its place, and what it holds.

    Args:
        robot: a name of the catalogue, such as "ur5"; a URDF, xacro or MJCF file below the folder of this
            file; or "robot_descriptions:" and a name of that package, which is downloaded.
        tip: frame to control in Cartesian space; by default the catalogue's, or the end of the longest arm.
        locked: positions of joints that are held, by name, rad or m.
        packages: folders in which a file's packages are looked for.
        inertials: mass, com and inertia of links, by name, in the place of what the file says.
        strict: whether everything that would be a warning is an error.
        xacro: values of the arguments of a xacro file.
        gravity: false for a robot without weight.
        base: where it stands; by default at the origin.
        changes: what it holds and what else is done to it, in that order.
        load: what loads it.
    """
    given = {"locked": locked, "inertials": inertials, "xacro_args": xacro}
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    options |= {"package_dirs": list(packages)} if packages else {}
    made = load(robot, tip, **options, **({"strict": True} if strict else {}))
    made = made if gravity else made.weightless()
    made = made if base is None else made.placed(*base)
    for change in changes:
        made = change(made)
    return made


ARM_KEYS: dict[str, Any] = {
    "robot": SOURCE,
    "tip": TEXT,
    "locked": by_name(ANGLE),
    "packages": list_of(FILE),
    "inertials": by_name(INERTIAL.model),
    "strict": TRUTH,
    "xacro": by_name(scalar()),
    "gravity": TRUTH,
    "base": BASE.model,
    "changes": list_of(one_of(*CHANGES.values())),
}
ARM = kind("", None, arm, **ARM_KEYS)

# -- what is adapted ---------------------------------------------------------------------------------------

Adapted = Callable[[Robot], Parameters | str]


def full() -> Adapted:
    """All inertial parameters of all bodies, ten each."""
    return lambda robot: "full"


def base() -> Adapted:
    """The fewest parameters that give the same torques."""
    return lambda robot: "base"


def linear(matrix: ArrayLike, theta: ArrayLike, names: Sequence[str]) -> Adapted:
    """A few parameters that determine the inertial ones linearly.

    Args:
        matrix: inertial parameters of these, (10 bodies, P).
        theta: true values, (P,).
        names: one name per parameter.
    """
    return lambda robot: LinearParameters(robot, matrix, theta, names)


def planar(masses: ArrayLike = (1.0, 1.0), lengths: ArrayLike = (0.3, 0.3)) -> Adapted:
    """The three parameters of a planar arm of two uniform rods, eq. (50).

    Args:
        masses: of both rods, kg.
        lengths: of both rods, m.
    """
    return lambda robot: planar_two_link_parameters(robot, masses, lengths)


def rubbing(base: Adapted | None = None, armature: bool = False) -> Adapted:
    """Friction coefficients beside the parameters of the bodies.

    Args:
        base: parameters of the bodies; by default all of them.
        armature: whether the rotors are adapted too.
    """

    def made(robot: Robot) -> Parameters:
        given = "full" if base is None else base(robot)
        rigid = parameters_of(given, robot) if isinstance(given, str) else given
        return FrictionParameters(robot, base=rigid, armature=armature)

    return made


_RIGID = (
    kind("full", None, full),
    kind("base", None, base),
    kind("linear", None, linear, matrix=ANY_NUMBERS, theta=VECTOR, names=list_of(TEXT)),
    kind("planar-two-link", None, planar, masses=VECTOR, lengths=VECTOR),
)
RUBBING = kind("friction", None, rubbing, base=one_of(*_RIGID), armature=TRUTH)
ADAPTED = (*_RIGID, RUBBING)
PARAMETERS = one_of(*ADAPTED)

FRICTION = kind("", Friction, viscous=NUMBERS, coulomb=NUMBERS, smoothing=NUMBER)
RUBS = table_or(FRICTION, choice("none", "urdf"))
KINDS = (BASE, INERTIAL, *CHANGES.values(), ARM, *ADAPTED, FRICTION)
