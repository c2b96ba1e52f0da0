"""What a URDF says to be drawn: shapes and colours. They are only pictures, and never cost the robot.

A shape that cannot be read is left out, with a note of why; so is a colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ...errors import RobotError, near
from .document import Geometry, Shape, Vector
from .origins import read_origin
from .xml import Element, quoted

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")


def read_shapes(link: Element, tag: str, materials: dict[str, Material]) -> tuple[Geometry, ...]:
    """The shapes of a link that can be read; `tag` is "visual" or "collision"."""
    return tuple(_readable(link, tag, materials))


def _readable(link: Element, tag: str, materials: dict[str, Material]) -> Iterator[Geometry]:
    for element in link.all(tag):
        try:
            yield _geometry(element, materials)
        except RobotError as error:
            element.notes.absorb(error)


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
