"""What links and joints of a URDF have in them: places, limits, and shapes with their colours.

Places make the mechanism, and are read strictly. Limits and pictures do not change it, so they never cost the
robot: what is no bound, such as the effort of 0 that exporters write where they know none, is taken as none,
and said if the joint moves; a shape or colour that cannot be read is left out, with a note of why.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...errors import RobotError, near
from .document import ZERO, Geometry, Limit, Pose, Shape, Vector
from .report import Note
from .xml import Element, quoted

FARTHEST = 1e6
"""In m, or rad: double precision places what is farther away to no better than 1e-10, and no arm is there."""
_UNIT = 1e-3


def read_origin(element: Element) -> Pose:
    """The placement that the `<origin>` of an element states; the identity without one.

    Raises:
        RobotError: numbers that are none, places beyond measure, or two orientations in one.
    """
    origin = element.optional("origin")
    if origin is None:
        return Pose()
    origin.know((), ("xyz", "rpy", "quat_xyzw"))
    xyz = _near(origin, "xyz", "m")
    if "quat_xyzw" not in origin.attributes:
        return Pose(xyz, _near(origin, "rpy", "rad"))
    if "rpy" in origin.attributes:
        origin.refuse("rpy or quat_xyzw", "both")
    return Pose(xyz, _turned(origin))


def _near(origin: Element, key: str, unit: str) -> Vector:
    """Three numbers that are so small that no digits are lost."""
    found = origin.numbers(key, 3, ZERO)
    if max(map(abs, found)) > FARTHEST:
        origin.refuse(f"{key} of at most {FARTHEST:g} {unit}", " ".join(f"{x:g}" for x in found))
    return found


def _turned(origin: Element) -> Vector:
    """Roll, pitch and yaw of a quaternion."""
    quaternion = origin.numbers("quat_xyzw", 4)
    length = math.hypot(*quaternion)
    if length < _UNIT:
        origin.refuse("a quaternion of length 1", f"one of length {length:g}")
    if abs(length - 1) > _UNIT:
        origin.note("assumed", f"the quaternion has length {length:g}; its direction is taken")
    rotation = pin.Quaternion(*np.roll(np.array(quaternion) / length, 1)).matrix()
    return Pose.of(pin.SE3(rotation, np.zeros(3))).rpy


# -- limits ------------------------------------------------------------------------------------------------

LIMITS = ("lower", "upper", "effort", "velocity")


def read_limit(joint: Element, kind: str) -> tuple[Limit, tuple[Note, ...]]:
    """The limits of a moving joint, and what there is to say about them if it moves.

    Args:
        joint: the `<joint>`.
        kind: its type. A continuous joint has no range, and may have no `<limit>` at all.

    """
    limit = joint.first("limit")
    if limit is None:
        said = [] if kind == "continuous" else ["no <limit>: neither range nor torque nor speed is bounded"]
        return Limit(), _notes(joint, said)
    limit.know((), LIMITS)
    effort, velocity = limit.bound("effort"), limit.bound("velocity")
    said = [_unbounded(key, value) for key, value in (("effort", effort), ("velocity", velocity))]
    lower, upper, of_range = (None, None, "") if kind == "continuous" else _range(limit)
    notes = _notes(limit, [text for text in (of_range, *said) if text])
    return Limit(_bound(effort), _bound(velocity), lower, upper), notes


def _notes(element: Element, texts: list[str]) -> tuple[Note, ...]:
    return tuple(Note("assumed", element.place, text, element.line) for text in texts)


def _bound(value: float | None) -> float:
    return value if value is not None and value > 0 else math.inf


def _unbounded(key: str, value: float | None) -> str:
    """What is said of an effort or velocity that bounds nothing; empty of a good one."""
    if value is not None and 0 < value < math.inf:
        return ""
    return _no_limit(f"{key} missing" if value is None else key, value)


def _no_limit(key: str, value: float | None) -> str:
    shown = "" if value is None else ", which is no number," if math.isnan(value) else f" {value:g}"
    return f"{key}{shown} is taken as no limit"


def _range(limit: Element) -> tuple[float | None, float | None, str]:
    """Both ends of a range, None where it is open, and what is said about it."""
    lower, upper = limit.bound("lower"), limit.bound("upper")
    if lower is None and upper is None:
        return None, None, "no range is stated, and none is assumed"
    said = ""
    for key, value in (("lower", lower), ("upper", upper)):
        if value is None:
            said = f"no {key} is stated; it is 0, as in every URDF"
        elif not math.isfinite(value):
            said = _no_limit(key, value)
    lower, upper = (end if math.isfinite(end := value or 0.0) else None for value in (lower, upper))
    return lower, upper, said


# -- shapes ------------------------------------------------------------------------------------------------

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")


def read_shapes(link: Element, tag: str, materials: dict[str, Material]) -> tuple[Geometry, ...]:
    """The shapes of a link that can be read; `tag` is "visual" or "collision"."""
    shapes = []
    for element in link.all(tag):
        try:
            shapes.append(_geometry(element, materials))
        except RobotError as error:
            element.notes.absorb(error)
    return tuple(shapes)


def _geometry(element: Element, materials: dict[str, Material]) -> Geometry:
    element.know(("origin", "geometry", "material", "verbose"), ("name",))
    shape, origin = _shape(element.required("geometry")), read_origin(element)
    material = _material(element, materials) if element.tag == "visual" else Material()
    return Geometry(shape, origin, material.color, element.line, material.texture)


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
    return Shape("mesh", scale, mesh.text("filename"))


# -- colours -----------------------------------------------------------------------------------------------


class Material(NamedTuple):
    """Red, green, blue, alpha from 0 to 1, and the file name of a picture; None where there is none."""

    color: Vector | None = None
    texture: str | None = None


def read_materials(root: Element) -> dict[str, Material]:
    """Materials by name; those of the robot come before those inside links."""
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    materials: dict[str, Material] = {}
    for element in [m for parent in (root, *visuals) for m in parent.all("material")]:
        element.know(("color", "texture"), ("name",))
        if (stated := _stated(element)) != Material():
            materials.setdefault(element.attributes.get("name", ""), stated)
    return materials


def _stated(element: Element) -> Material:
    """What a material states itself, as far as it can be read."""
    color, texture = element.first("color"), element.first("texture")
    try:
        return Material(
            None if color is None else _rgba(color),
            None if texture is None else texture.text("filename"),
        )
    except RobotError as error:
        element.notes.absorb(error)
        return Material()


def _rgba(color: Element) -> Vector:
    color.know((), ("rgba",))
    rgba = color.numbers("rgba", 4)
    if min(rgba) < 0 or max(rgba) > 1:
        color.refuse("rgba of 4 numbers from 0 to 1", " ".join(f"{c:g}" for c in rgba))
    return rgba


def _material(element: Element, materials: dict[str, Material]) -> Material:
    """What the material of a visual states, or else the one of its name."""
    stated = element.first("material")
    if stated is None:
        return Material()
    name = stated.attributes.get("name", "")
    if stated.all("color") or stated.all("texture") or not name:
        return _stated(stated)
    if name not in materials:
        stated.note("left out", f"no colour is known for material {quoted(name)}{near(name[:60], materials)}")
    return materials.get(name, Material())
