"""Shapes and colours of a URDF, element by element."""

from __future__ import annotations

from ...errors import near
from .document import Geometry, Pose, Shape, Vector
from .xml import Element, quoted

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
Colors = dict[str, Vector]
"""Red, green, blue, alpha by the name of a material."""


def read_geometry(element: Element, origin: Pose, colors: Colors) -> Geometry:
    """A `<visual>` or `<collision>` at this place in the frame of its link."""
    element.know(("origin", "geometry", "material", "verbose"), ("name",))
    return Geometry(
        shape=_shape(element.required("geometry")),
        origin=origin,
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
    return Shape("mesh", scale, mesh.text("filename"))


def read_colors(root: Element) -> Colors:
    """Colours by the name of their material; those of the robot come before those inside links."""
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    colors: Colors = {}
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


def _color(element: Element, colors: Colors) -> Vector | None:
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
