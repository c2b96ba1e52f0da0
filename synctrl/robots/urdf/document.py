"""A URDF as plain frozen data: what this package reads, checks, changes and writes.

A `Document` holds links, joints and shapes and no more. Everything else in a file (transmissions, simulator
plugins, textures, sensors) is left behind when it is read, so what is checked is all there is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pinocchio as pin

from ...errors import RobotError
from .report import Note
from .xml import quoted

Vector = tuple[float, ...]

ZERO: Vector = (0.0, 0.0, 0.0)
#: of a moment of inertia, in the order of a URDF
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
NO_INERTIA: Vector = (0.0,) * 6
MOVING_TYPES = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True)
class Pose:
    """Placement in a parent frame: `xyz` in m, `rpy` in rad about the fixed axes x, y, z in that order."""

    xyz: Vector = ZERO
    rpy: Vector = ZERO

    @property
    def se3(self) -> pin.SE3:
        """The rigid transformation."""
        return pin.SE3(pin.rpy.rpyToMatrix(*self.rpy), np.array(self.xyz))

    @classmethod
    def of(cls, placement: pin.SE3) -> Self:
        """The pose that writes a rigid transformation, to rounding at every orientation.

        Near a pitch of 90 deg roll and yaw are ill-conditioned one by one; roll is therefore taken from what
        yaw leaves of the rotation, so that the product is right whatever yaw was.
        """
        R = placement.rotation
        pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
        yaw = math.atan2(R[1, 0], R[0, 0])
        s, c = math.sin(yaw), math.cos(yaw)
        roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
        return cls(tuple(map(float, placement.translation)), (roll, pitch, yaw))


@dataclass(frozen=True)
class Inertial:
    """Mass in kg, centre of mass and inertia axes, and (ixx, ixy, ixz, iyy, iyz, izz) in kg·m^2 about it."""

    mass: float
    inertia: Vector
    origin: Pose = Pose()
    line: int = 0

    @property
    def matrix(self) -> np.ndarray:
        """Inertia about the centre of mass in the axes of `origin`, (3, 3)."""
        ixx, ixy, ixz, iyy, iyz, izz = self.inertia
        return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])

    @property
    def in_link_axes(self) -> Inertial:
        """The same with its inertia in the axes of the link, so that `origin` is not turned."""
        if self.origin.rpy == ZERO:
            return self
        R = self.origin.se3.rotation
        I = R @ self.matrix @ R.T
        return replace(self, inertia=upper_triangle(I), origin=Pose(self.origin.xyz))

    def parameters(self, placement: pin.SE3) -> np.ndarray:
        """The ten inertial parameters in a frame in which the link has this placement, Pinocchio's order."""
        place = placement * self.origin.se3
        c, R = place.translation, place.rotation
        I = R @ self.matrix @ R.T + self.mass * (c @ c * np.eye(3) - np.outer(c, c))
        return np.array([self.mass, *(self.mass * c), *I[np.tril_indices(3)]])


def link_name(name: str) -> str:
    """What a link of this name is called: "universe" is Pinocchio's name of the world."""
    return f"{name} (link)" if name == "universe" else name


def upper_triangle(inertia: np.ndarray) -> Vector:
    """(ixx, ixy, ixz, iyy, iyz, izz) of a symmetric matrix, (3, 3): the order of a URDF."""
    return tuple(map(float, inertia[np.triu_indices(3)]))


@dataclass(frozen=True)
class Shape:
    """A geometric primitive or a mesh.

    `size` is (x, y, z) of a box, (radius, length) of a cylinder or capsule, (radius,) of a sphere, all in m,
    and the scale (x, y, z) of a mesh. A mesh has a `filename`, as the description names it, and the `file`
    that was found, None if it is not shown.
    """

    kind: str
    size: Vector
    filename: str | None = None
    file: Path | None = None

    @property
    def hidden(self) -> bool:
        """Whether it is a mesh that cannot be shown."""
        return self.kind == "mesh" and self.file is None


@dataclass(frozen=True)
class Geometry:
    """A shape on a link, for display or collision.

    `color` is red, green, blue, alpha from 0 to 1; `texture` names a picture whose mean is not known yet.
    """

    shape: Shape
    origin: Pose = Pose()
    color: Vector | None = None
    line: int = 0
    texture: str | None = None


@dataclass(frozen=True)
class Link:
    """A link. `line` is where it stands in its file, 0 if in none."""

    name: str
    inertial: Inertial | None = None
    visuals: tuple[Geometry, ...] = ()
    collisions: tuple[Geometry, ...] = ()
    line: int = 0

    @property
    def title(self) -> str:
        """What messages call it."""
        return f"link {quoted(self.name)}"


@dataclass(frozen=True)
class Limit:
    """Limits of a joint: torque in N·m (or N), speed in rad/s (or m/s), and the range in rad (or m).

    Torque and speed are infinite, and the ends of the range None, where there is no limit.
    """

    effort: float = math.inf
    velocity: float = math.inf
    lower: float | None = None
    upper: float | None = None

    @property
    def rest(self) -> float:
        """The position in the range that is nearest to 0."""
        lower = -math.inf if self.lower is None else self.lower
        return max(lower, min(0.0, math.inf if self.upper is None else self.upper))


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another: its position is `multiplier` times that of `joint`, plus `offset`."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A joint.

    `axis` is of unit length; `armature` is the inertia of a rotor that turns along, in kg·m^2 (or kg);
    `remarks` are what there is to say about it if it moves.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Pose = Pose()
    axis: Vector = (1.0, 0.0, 0.0)
    limit: Limit | None = None
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    mimic: Mimic | None = None
    line: int = 0
    remarks: tuple[Note, ...] = ()

    @property
    def title(self) -> str:
        """What messages call it."""
        return f"joint {quoted(self.name)}"

    @property
    def moves(self) -> bool:
        """Whether the joint has a degree of freedom."""
        return self.type in MOVING_TYPES

    @property
    def unit(self) -> str:
        """Unit of its position."""
        return "m" if self.type == "prismatic" else "rad"

    def fixed(self, position: float) -> Joint:
        """This joint held at a position, in rad or m: a fixed joint."""
        axis = np.array(self.axis)
        motion = (
            pin.SE3(np.eye(3), position * axis)
            if self.type == "prismatic"
            else pin.SE3(pin.exp3(position * axis), np.zeros(3))
        )
        origin = self.origin if position == 0 else Pose.of(self.origin.se3 * motion)
        return Joint(self.name, "fixed", self.parent, self.child, origin, self.axis, line=self.line)


@dataclass(frozen=True)
class Document:
    """A robot as a URDF describes it. `file` is where it was read from, `called` what messages say."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    file: Path | None = None
    called: str = ""

    @property
    def source(self) -> str:
        """What messages call it."""
        return self._place or f"robot {quoted(self.name)}"

    @property
    def _place(self) -> str:
        return self.called or str(self.file or "")

    @property
    def moving_joints(self) -> tuple[Joint, ...]:
        """The joints with a degree of freedom, in the order of the document."""
        return tuple(joint for joint in self.joints if joint.moves)

    @property
    def hidden(self) -> tuple[Shape, ...]:
        """Meshes that should be seen, and cannot be shown."""
        shapes = (visual.shape for link in self.links for visual in link.visuals)
        return tuple(shape for shape in shapes if shape.hidden)

    @property
    def root(self) -> str:
        """Name of the link that is nobody's child."""
        children = {joint.child for joint in self.joints}
        return next(link.name for link in self.links if link.name not in children)

    def placed(self, pose: Pose) -> Self:
        """The document with its base moved: a new root link, and the old one fixed to it."""
        taken = {link.name for link in self.links} | {joint.name for joint in self.joints}
        name = next(name for k in range(len(taken) + 1) if (name := f"place{k}") not in taken)
        joint = Joint(f"{name}_mount", "fixed", name, self.root, pose)
        return replace(self, links=(Link(name), *self.links), joints=(joint, *self.joints))

    def renamed(self, names: Mapping[str, str]) -> Self:
        """The document with other names for some joints."""
        joints = (replace(joint, name=names.get(joint.name, joint.name)) for joint in self.joints)
        return replace(self, joints=tuple(joints))

    def error(
        self,
        problem: str,
        item: Link | Joint | None = None,
        *,
        part: str = "",
        line: int = 0,
        found: str | float | None = None,
    ) -> RobotError:
        """The error to be raised where something in the document is wrong.

        Args:
            problem: what is expected, and what was found.
            item: the link or joint at fault; None if it is the document as a whole.
            part: what of the item it is about, for example "inertial".
            line: where that part stands; by default the line of the item.
            found: what was found.
        """
        robot = None if self._place else self.source
        place = item and ", ".join(word for word in (item.title, part) if word)
        subject = ": ".join(word for word in (robot, place) if word)
        line = line or (item.line if item else 0)
        return RobotError(problem, subject=subject or None, found=found, file=self._place or None, line=line)
