"""From the text of a URDF to a `Document`: every value checked where it stands, before anything is built.

Elements of other programs are left alone, unless they add to the mechanism: without them it would be another.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from ...errors import near
from ...renamed import tell
from .document import (
    INERTIA,
    MOVING_TYPES,
    NO_INERTIA,
    Document,
    Inertial,
    Joint,
    Link,
    Mimic,
    Vector,
    link_name,
)
from .parts import Material, read_limit, read_materials, read_origin, read_shapes
from .report import Notes
from .xml import Element, parse_xml, quoted, read_bytes, shown_tag

JOINT_TYPES = (*MOVING_TYPES, "fixed")
JOINT_PARTS = (
    *("parent", "child", "origin", "axis", "limit", "dynamics", "mimic"),
    *("calibration", "safety_controller"),
)

_NO_AXIS = 1e-6
_UNIT_AXIS = 1e-3


def read_text(file: Path, data: bytes, notes: Notes | None = None, called: str = "") -> Document:
    """The content of a URDF file as a document whose every value is finite and of the right kind.

    How the values fit together is not looked at here, see `check_tree` and `check_bodies`. `notes` takes what
    is left out and assumed; `called` is what messages say in the place of the file's name.

    Raises:
        RobotError: with line, link or joint, what was found and what is expected.
    """
    root = parse_xml(called or str(file), data, notes)
    if root.tag != "robot":
        root.refuse("a URDF with the root element <robot>", f"<{shown_tag(root.tag)}>")
    refuse_xacro(root)
    refuse_loops(root)
    root.know(("link", "joint", "material", *EXTENSIONS), ("name", "version"))
    materials = read_materials(root)
    return Document(
        name=_robot_name(root, file),
        links=tuple(_link(element, materials) for element in root.all("link")),
        joints=tuple(_joint(element) for element in root.all("joint")),
        file=file,
        called=called,
    )


def read_document(file: Path) -> Document:
    """A URDF file as a document, as in version 0.1; `load_robot` and `read_urdf` take its place."""
    tell(f"{__name__}.read_document", f"{__name__}.read_text(file, file.read_bytes())")
    return read_text(file, read_bytes(file))


def _robot_name(root: Element, file: Path) -> str:
    if root.attributes.get("name", "").strip():
        return root.name()
    root.note("assumed", f"the robot has no name; it is called as its file, {quoted(file.stem)}")
    return file.stem


# -- links -------------------------------------------------------------------------------------------------


def _link(element: Element, materials: dict[str, Material]) -> Link:
    element.know(("inertial", "visual", "collision", *LINK_EXTENSIONS), ("name", "type"))
    inertial = element.optional("inertial")
    return Link(
        name=link_name(element.name()),
        inertial=None if inertial is None else _inertial(inertial),
        visuals=read_shapes(element, "visual", materials),
        collisions=read_shapes(element, "collision", {}),
        line=element.line,
    )


def _inertial(element: Element) -> Inertial | None:
    element.know(("origin", "mass", "inertia"))
    mass, inertia = element.optional("mass"), element.optional("inertia")
    if mass is None:
        element.note("left out", "an <inertial> without a <mass>")
        return None
    mass.know((), ("value",))
    if inertia is None:
        element.note("assumed", "without an <inertia> the mass is taken as that of a point")
        moments = NO_INERTIA
    else:
        inertia.know((), INERTIA)
        moments = tuple(inertia.number(key) for key in INERTIA)
    return Inertial(
        mass=mass.number("value"),
        inertia=moments,
        origin=read_origin(element),
        line=element.line,
    )


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
        origin=read_origin(element),
        line=element.line,
    )
    return joint if kind == "fixed" else _moving(element, joint)


def _end(element: Element, role: str) -> str:
    end = element.required(role)
    end.know((), ("link",))
    return link_name(end.name("link"))


def _moving(element: Element, joint: Joint) -> Joint:
    """The joint with what only moving joints have; a fixed joint's axis and limits mean nothing."""
    damping, friction = _dynamics(element)
    limit, remarks = read_limit(element, joint.type)
    return replace(
        joint,
        axis=_axis(element),
        limit=limit,
        remarks=remarks,
        damping=damping,
        friction=friction,
        mimic=_mimic(element),
    )


def _mimic(element: Element) -> Mimic | None:
    mimic = element.optional("mimic")
    if mimic is None:
        return None
    mimic.know((), ("joint", "multiplier", "offset"))
    return Mimic(mimic.name("joint"), mimic.number("multiplier", 1.0), mimic.number("offset", 0.0))


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
        axis.note("assumed", f"the axis has length {length:g}; its direction is taken")
    return xyz if length == 1 else tuple(x / length for x in xyz)


def _dynamics(element: Element) -> tuple[float, float]:
    """Viscous and Coulomb friction: they act only if asked for, so a senseless one is left out."""
    dynamics = element.first("dynamics")
    if dynamics is None:
        return 0.0, 0.0
    return _friction(dynamics, "damping"), _friction(dynamics, "friction")


def _friction(dynamics: Element, key: str) -> float:
    value = dynamics.number(key, 0.0)
    if value < 0:
        dynamics.note("left out", f"{key} of {value:g}, which would drive the joint")
    return max(value, 0.0)


# -- what is in a file besides the robot -------------------------------------------------------------------

EXTENSIONS = ("gazebo", "transmission", "ros2_control", "sensor", "mujoco", "group_state")
LINK_EXTENSIONS = ("contact", "surface", "gravity", "kinematic", "self_filter", "collision_checking")
"""Elements of other programs, which say nothing about the mechanism."""

_DEFINITIONS = ("xacro:property", "xacro:arg")
_EXPANDS = "a plain URDF"
_ADVICE = ": unexpanded xacro; expand the file with xacro first, or load the .xacro file itself"
_TREE, _CLOSING = "a tree of links and joints", ", which closes a loop"
_CLOSES = ("loop_joint", "closed_loop", "loop_closure", "ball_constraint", "linear_bushing_rpy", "equality")


def refuse_xacro(root: Element) -> None:
    """Refuse macros, and expressions in the robot itself, wherever they stand.

    Definitions that no expression uses say nothing.

    Raises:
        RobotError: with the advice to expand the file.
    """
    unused = [child for child in root.children if child.tag in _DEFINITIONS and not child.children]
    for element in root.walk():
        if element.tag.startswith("xacro:") and element not in unused:
            element.refuse(_EXPANDS, f"<{shown_tag(element.tag)}>", _ADVICE)
    robot = (part for child in root.children if child.tag not in EXTENSIONS for part in child.walk())
    for element in (root, *robot):
        for key, value in element.attributes.items():
            if "${" in value or "$(" in value:
                element.refuse(_EXPANDS, f"{quoted(key)} of {quoted(value)}", _ADVICE)


def refuse_loops(root: Element) -> None:
    """Refuse elements of other programs that add a joint or close a loop, which would be cut without a word.

    Raises:
        RobotError: with the element.
    """
    for element in root.walk():
        name = element.tag.rpartition(":")[2]
        if name in _CLOSES or (":" in element.tag and name == "joint"):
            element.refuse(_TREE, f"<{shown_tag(element.tag)}>", _CLOSING)
    carried = {end.attributes.get("link", "") for joint in root.all("joint") for end in joint.all("child")}
    for extension in (child for child in root.children if child.tag in EXTENSIONS):
        for element in extension.walk():
            if element.tag == "joint" and _joins(element, carried):
                element.refuse(_TREE, "a joint for a simulator", _CLOSING)


def _joins(joint: Element, carried: set[str]) -> bool:
    """Whether a joint of a simulator connects two links, other than the world with the base."""
    ends = [part.content.strip() for tag in ("parent", "child") for part in joint.all(tag)]
    return len(ends) == 2 and not ("world" in ends and carried.isdisjoint(ends))
