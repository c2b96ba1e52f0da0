"""From the text of a URDF to a `Document`: every value checked where it stands, before anything is built."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from ...errors import near
from .document import INERTIA, MOVING_TYPES, ZERO, Document, Inertial, Joint, Limit, Link, Pose, Vector
from .pictures import Colors, read_colors, read_geometry
from .xml import Element, parse_xml, quoted, read_bytes, shown_tag

JOINT_TYPES = (*MOVING_TYPES, "fixed")
JOINT_PARTS = (
    *("parent", "child", "origin", "axis", "limit", "dynamics", "mimic"),
    *("calibration", "safety_controller"),
)
EXTENSIONS = ("gazebo", "transmission", "ros2_control", "sensor")
LINK_EXTENSIONS = ("contact", "surface", "gravity", "kinematic", "self_filter", "collision_checking")
"""Elements of other programs, which say nothing about the mechanism."""

_NO_AXIS = 1e-6
_UNIT_AXIS = 1e-3


def read_document(file: Path) -> Document:
    """A URDF file as a document whose every value is finite and of the right kind.

    How the values fit together is not looked at here, see `check_tree` and `check_bodies`.

    Raises:
        RobotError: with file, line, link or joint, what was found and what is expected.
    """
    return read_text(file, read_bytes(file))


def read_text(file: Path, data: bytes) -> Document:
    """`read_document` for the content `data` of `file`."""
    root = parse_xml(str(file), data)
    if root.tag != "robot":
        root.refuse("a URDF with the root element <robot>", f"<{shown_tag(root.tag)}>")
    _refuse_xacro(root)
    root.know(("link", "joint", "material", *EXTENSIONS), ("name", "version"))
    colors = read_colors(root)
    return Document(
        name=root.name(),
        links=tuple(_link(element, colors) for element in root.all("link")),
        joints=tuple(_joint(element) for element in root.all("joint")),
        file=file,
    )


def _refuse_xacro(root: Element) -> None:
    for child in root.children:
        if child.tag.startswith("xacro:"):
            child.refuse("a plain URDF", "a xacro macro; expand the file with xacro first")


# -- links -------------------------------------------------------------------------------------------------


def _link(element: Element, colors: Colors) -> Link:
    element.know(("inertial", "visual", "collision", *LINK_EXTENSIONS), ("name", "type"))
    inertial = element.optional("inertial")
    return Link(
        name=element.name(),
        inertial=None if inertial is None else _inertial(inertial),
        visuals=tuple(read_geometry(visual, _origin(visual), colors) for visual in element.all("visual")),
        collisions=tuple(read_geometry(shape, _origin(shape), {}) for shape in element.all("collision")),
        line=element.line,
    )


def _inertial(element: Element) -> Inertial:
    element.know(("origin", "mass", "inertia"))
    mass, inertia = element.required("mass"), element.required("inertia")
    mass.know((), ("value",))
    inertia.know((), INERTIA)
    return Inertial(
        mass=mass.number("value"),
        inertia=tuple(inertia.number(key) for key in INERTIA),
        origin=_origin(element),
        line=element.line,
    )


def _origin(element: Element) -> Pose:
    origin = element.optional("origin")
    if origin is None:
        return Pose()
    origin.know((), ("xyz", "rpy"))
    return Pose(origin.numbers("xyz", 3, ZERO), origin.numbers("rpy", 3, ZERO))


# -- joints ------------------------------------------------------------------------------------------------


def _joint(element: Element) -> Joint:
    element.know(JOINT_PARTS, ("name", "type", "dont_collapse"))
    kind = element.text("type")
    if kind not in JOINT_TYPES:
        found = f"{quoted(kind)}{near(kind[:60], JOINT_TYPES)}"
        element.refuse(f"a joint type of {', '.join(JOINT_TYPES)}", found)
    joint = Joint(
        name=element.name(),
        type=kind,
        parent=_end(element, "parent"),
        child=_end(element, "child"),
        origin=_origin(element),
        line=element.line,
    )
    return joint if kind == "fixed" else _moving(element, joint)


def _end(element: Element, role: str) -> str:
    end = element.required(role)
    end.know((), ("link",))
    return end.name("link")


def _moving(element: Element, joint: Joint) -> Joint:
    """The joint with what only moving joints have; a fixed joint's axis and limits mean nothing."""
    damping, friction = _dynamics(element)
    mimic = element.optional("mimic")
    return replace(
        joint,
        axis=_axis(element),
        limit=_limit(element, joint.type),
        damping=damping,
        friction=friction,
        mimics=None if mimic is None else mimic.name("joint"),
    )


def _axis(element: Element) -> Vector:
    axis = element.optional("axis")
    if axis is None:
        return (1.0, 0.0, 0.0)
    axis.know((), ("xyz",))
    xyz = axis.numbers("xyz", 3)
    length = math.hypot(*xyz)
    if length < _NO_AXIS:
        axis.refuse("an axis with a direction", " ".join(f"{x:g}" for x in xyz))
    if abs(length - 1) > _UNIT_AXIS:
        axis.warn(f"the axis has length {length:g}; its direction is taken")
    return xyz if length == 1 else tuple(x / length for x in xyz)


def _limit(element: Element, kind: str) -> Limit | None:
    """Limits of a moving joint; a continuous one has no range, and may have none at all."""
    if kind == "continuous":
        limit = element.optional("limit")
        return None if limit is None else Limit(limit.positive("effort"), limit.positive("velocity"))
    limit = element.required("limit")
    limit.know((), ("lower", "upper", "effort", "velocity"))
    lower, upper = limit.number("lower"), limit.number("upper")
    if lower >= upper:
        limit.refuse("lower below upper", f"{lower:g} and {upper:g}")
    return Limit(limit.positive("effort"), limit.positive("velocity"), lower, upper)


def _dynamics(element: Element) -> tuple[float, float]:
    dynamics = element.optional("dynamics")
    if dynamics is None:
        return 0.0, 0.0
    for key in ("damping", "friction"):
        if dynamics.number(key, 0.0) < 0:
            dynamics.refuse(f"{key} of at least 0", f"{dynamics.number(key):g}")
    return dynamics.number("damping", 0.0), dynamics.number("friction", 0.0)
