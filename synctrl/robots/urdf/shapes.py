"""What a URDF says to be drawn: shapes and colours. They are only pictures, and never cost the robot.

A shape that cannot be read is left out, with a note of why; so is a colour.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...errors import RobotError, near
from .document import Geometry, Shape, Vector
from .meshes import check_filename
from .origins import read_origin
from .xml import Element, quoted

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")


def read_shapes(link: Element, tag: str, colors: dict[str, Vector]) -> tuple[Geometry, ...]:
    """The shapes of a link that can be read; `tag` is "visual" or "collision"."""
    return tuple(_readable(link, tag, colors))


def _readable(link: Element, tag: str, colors: dict[str, Vector]) -> Iterator[Geometry]:
    for element in link.all(tag):
        try:
            yield _geometry(element, colors)
        except RobotError as error:
            element.notes.absorb(error)


def _geometry(element: Element, colors: dict[str, Vector]) -> Geometry:
    element.know(("origin", "geometry", "material", "verbose"), ("name",))
    return Geometry(
        shape=_shape(element.required("geometry")),
        origin=read_origin(element),
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


# -- colours -----------------------------------------------------------------------------------------------


def read_colors(root: Element) -> dict[str, Vector]:
    """Colours by the name of their material; those of the robot come before those inside links."""
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    colors: dict[str, Vector] = {}
    for material in [m for parent in (root, *visuals) for m in parent.all("material")]:
        material.know(("color", "texture"), ("name",))
        rgba = _stated(material)
        if rgba is not None:
            colors.setdefault(material.attributes.get("name", ""), rgba)
    return colors


def _stated(material: Element) -> Vector | None:
    """The colour that a material states, if it is one."""
    color = material.first("color")
    if color is None:
        return None
    try:
        return _rgba(color)
    except RobotError as error:
        material.notes.absorb(error)
        return None


def _rgba(color: Element) -> Vector:
    color.know((), ("rgba",))
    rgba = color.numbers("rgba", 4)
    if min(rgba) < 0 or max(rgba) > 1:
        color.refuse("rgba of 4 numbers from 0 to 1", " ".join(f"{c:g}" for c in rgba))
    return rgba


def _color(element: Element, colors: dict[str, Vector]) -> Vector | None:
    material = element.first("material")
    if material is None or material.optional("texture") is not None:
        return None
    if material.first("color") is not None:
        return _stated(material)
    name = material.attributes.get("name", "")
    if name not in colors:
        material.note("left out", f"no colour is known for material {quoted(name)}{near(name[:60], colors)}")
    return colors.get(name)
