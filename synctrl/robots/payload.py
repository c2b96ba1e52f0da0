"""A body that a robot carries for some time, and the robot with it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from types import NoneType
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..checks import (
    finite_array,
    instance,
    label,
    positive_number,
    rotation_matrix,
    symmetric_matrix,
    window,
)
from ..errors import InputError
from ..renamed import tell
from .documents import weld
from .model import frame_id
from .robot import Robot
from .urdf.document import Document, Joint, Link, Pose


@dataclass(frozen=True, eq=False)
class Payload:
    """A rigid body that a robot carries for start <= t < stop.

    Args:
        robot: index of the robot, counted from 0.
        mass: kg.
        com: centre of mass in the frame, (3,), m.
        inertia: about the centre of mass in the frame's axes, (3, 3), or (3,) for its diagonal, kg·m^2; by
            default that of a uniform ball of the density of water.
        frame: name of the frame that holds it; by default the robot's tip.
        start, stop: when it is picked up and put down, s; by default it is there from the beginning, and is
            not put down.

    Raises:
        InputError: numbers that no body can have, or a window that is empty or starts before 0.
    """

    robot: int
    mass: float
    com: Any = (0.0, 0.0, 0.0)
    inertia: Any = None
    frame: str | None = None
    start: float = 0.0
    stop: float | None = None

    def __post_init__(self) -> None:
        instance("payload, frame", self.frame, (str, NoneType), "the name of a frame")
        object.__setattr__(self, "mass", positive_number("payload, mass", self.mass))
        object.__setattr__(self, "com", finite_array("payload, com", self.com, (3,)))
        object.__setattr__(self, "inertia", self._checked_inertia())
        window("payload", self.start, self.stop)

    def _checked_inertia(self) -> np.ndarray:
        if self.inertia is None:
            radius = np.cbrt(3 * self.mass / (4 * np.pi * 1000.0))
            return 0.4 * self.mass * radius**2 * np.eye(3)
        given = finite_array("payload, inertia", self.inertia)
        full = np.diag(given) if given.shape == (3,) else given
        inertia = symmetric_matrix("payload, inertia", full, 3)
        moments = np.linalg.eigvalsh(inertia)
        if moments[0] <= 0 or moments[2] > (1 + 1e-9) * (moments[0] + moments[1]):
            possible = "positive principal moments in kg·m^2, none larger than the sum of the others"
            raise InputError.expected(possible, moments, "payload, inertia")
        return inertia

    def carried_at(self, t: float) -> bool:
        """Whether the robot has it at time t; at an edge from the right."""
        return self.start <= t and (self.stop is None or t < self.stop)

    def as_dict(self) -> dict[str, Any]:
        """The payload as plain data."""
        return {
            "robot": int(self.robot),
            "mass": float(self.mass),
            "com": self.com.tolist(),
            "inertia": self.inertia.tolist(),
            "frame": self.frame,
            "start": float(self.start),
            "stop": None if self.stop is None else float(self.stop),
        }


def Load(  # noqa: N802
    mass: float, com: Any = (0.0, 0.0, 0.0), inertia: Any = None, frame: str | None = None
) -> Payload:
    """A payload of some robot from the beginning; deprecated, see `Payload`."""
    tell("synctrl.robots.payload.Load", "synctrl.robots.payload.Payload")
    return Payload(0, mass, com, inertia, frame)


def carrying(robot: Robot, load: Payload) -> Robot:
    """The robot with a load fixed to it, whenever that is, and whosever it is.

    Raises:
        FrameNotFound: the robot has no such frame.
        InputError: the frame does not move.
    """
    name = load.frame or robot.tip
    frame = robot.model.frames[frame_id(robot.name, robot.model, name)]
    if frame.parentJoint == 0:
        raise InputError.expected(f"one of robot '{robot.name}' that moves", name, "payload, frame")
    model = pin.Model(robot.model)
    body = pin.Inertia(load.mass, np.array(load.com), np.array(load.inertia))
    model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
    document = _welded(robot.document, name, load)
    origin = robot.origin.then("carrying", mass=load.mass, com=load.com, inertia=load.inertia, frame=name)
    kept = partial(Robot, visual=robot.visual, name=robot.name, report=robot.report, origin=origin)
    return kept(model, robot.tip, document=document)


def holding(robot: Robot, xyz: ArrayLike, rotation: ArrayLike, name: str = "held") -> Robot:
    """The robot controlled at a frame of something that its tip holds: of a tool, or of an object.

    Args:
        robot: the robot.
        xyz, rotation: place and orientation of the frame in the axes of the robot's tip, (3,), m, and (3, 3).
        name: what the frame is called, which the robot has not yet.

    Raises:
        InputError: not of these shapes, no rotation matrix, or a name that is none or taken.
    """
    at = pin.SE3(np.array(rotation_matrix("rotation", rotation)), np.array(finite_array("xyz", xyz, (3,))))
    model = pin.Model(robot.model)
    if model.existFrame(label("name", name)):
        raise InputError.expected(f"a frame that robot '{robot.name}' does not have yet", name, "name")
    tip = model.frames[robot.tip_id]
    model.addFrame(pin.Frame(name, tip.parentJoint, robot.tip_id, tip.placement * at, pin.FrameType.BODY))
    document = robot.document
    if document is not None and robot.tip in {link.name for link in document.links}:
        mount = Joint(f"{name}_mount", "fixed", robot.tip, name, Pose.of(at))
        document = replace(document, links=(*document.links, Link(name)), joints=(*document.joints, mount))
    origin = robot.origin.then("holding", xyz=at.translation, rotation=at.rotation, name=name)
    kept = partial(Robot, visual=robot.visual, name=robot.name, report=robot.report, origin=origin)
    return kept(model, name, document=document)


def _welded(document: Document | None, frame: str, load: Payload) -> Document | None:
    """The same in the document, where it has no shape either; None if the frame is no link of it."""
    links = [] if document is None else [link.name for link in document.links]
    if document is None or frame not in links:
        return None
    name = next(name for k in range(len(links) + 1) if (name := f"payload{k}") not in links)
    loaded = weld(document, frame, load.mass, com=load.com, inertia=load.inertia, name=name)
    *others, body = loaded.links
    return replace(loaded, links=(*others, replace(body, visuals=(), collisions=())))
