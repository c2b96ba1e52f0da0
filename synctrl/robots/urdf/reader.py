"""From the text of a URDF to a `Document`: every value checked where it stands, before anything is built."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from ...errors import near
from .document import (
    INERTIA,
    MOVING_TYPES,
    ZERO,
    Document,
    Geometry,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    Shape,
    Vector,
)
from .meshes import check_filename
from .xml import Element, parse_xml, quoted, read_bytes, shown_tag

JOINT_TYPES = (*MOVING_TYPES, "fixed")
JOINT_PARTS = (
    *("parent", "child", "origin", "axis", "limit", "dynamics", "mimic"),
    *("calibration", "safety_controller"),
)
SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
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
    colors = _colors(root)
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


def _link(element: Element, colors: dict[str, Vector]) -> Link:
    element.know(("inertial", "visual", "collision", *LINK_EXTENSIONS), ("name", "type"))
    inertial = element.optional("inertial")
    return Link(
        name=element.name(),
        inertial=None if inertial is None else _inertial(inertial),
        visuals=tuple(_geometry(visual, colors) for visual in element.all("visual")),
        collisions=tuple(_geometry(collision, {}) for collision in element.all("collision")),
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


# -- shapes ------------------------------------------------------------------------------------------------


def _geometry(element: Element, colors: dict[str, Vector]) -> Geometry:
    element.know(("origin", "geometry", "material", "verbose"), ("name",))
    return Geometry(
        shape=_shape(element.required("geometry")),
        origin=_origin(element),
        color=_color(element, colors) if element.tag == "visual" else None,
        line=element.line,
    )


def _shape(geometry: Element) -> Shape:
    geometry.know(SHAPES, ("name",))
    shapes = [child for child in geometry.children if child.tag in SHAPES]
    if len(shapes) != 1:
        geometry.refuse(f"one shape of {', '.join(SHAPES)}", str(len(shapes)))
    shape = shapes[0]
    if shape.tag == "mesh":
        return _mesh(shape)
    if shape.tag == "box":
        shape.know((), ("size",))
        size = shape.numbers("size", 3)
        if min(size) <= 0:
            shape.refuse("a size above 0 in each direction", " ".join(f"{s:g}" for s in size))
        return Shape("box", size)
    measures = ("radius",) if shape.tag == "sphere" else ("radius", "length")
    shape.know((), measures)
    return Shape(shape.tag, tuple(shape.positive(measure) for measure in measures))


def _mesh(mesh: Element) -> Shape:
    mesh.know((), ("filename", "scale"))
    scale = mesh.numbers("scale", 3, (1.0, 1.0, 1.0))
    if 0 in scale:
        mesh.refuse("a scale other than 0 in each direction", " ".join(f"{s:g}" for s in scale))
    return Shape("mesh", scale, check_filename(mesh))


def _colors(root: Element) -> dict[str, Vector]:
    """Colours by the name of their material; those of the robot come before those inside links."""
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    colors: dict[str, Vector] = {}
    for material in [m for parent in (root, *visuals) for m in parent.all("material")]:
        material.know(("color", "texture"), ("name",))
        color = material.optional("color")
        if color is not None:
            colors.setdefault(material.attributes.get("name", ""), _rgba(color))
    return colors


def _rgba(color: Element) -> Vector:
    color.know((), ("rgba",))
    rgba = color.numbers("rgba", 4)
    if min(rgba) < 0 or max(rgba) > 1:
        color.refuse("rgba of 4 numbers from 0 to 1", " ".join(f"{c:g}" for c in rgba))
    return rgba


def _color(element: Element, colors: dict[str, Vector]) -> Vector | None:
    material = element.optional("material")
    if material is None or material.optional("texture") is not None:
        return None
    color = material.optional("color")
    if color is not None:
        return _rgba(color)
    name = material.attributes.get("name", "")
    if name not in colors:
        material.warn(f"no colour is known for material {quoted(name)}{near(name[:60], colors)}")
    return colors.get(name)


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
