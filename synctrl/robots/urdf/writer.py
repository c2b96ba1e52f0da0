"""Documents as URDF text, every number with all its digits."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from xml.sax.saxutils import quoteattr

from .document import INERTIA, Document, Geometry, Joint, Limit, Link, Pose, Shape, Vector

_LARGEST = sys.float_info.max


def to_xml(document: Document) -> str:
    """The document as URDF."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoteattr(document.name)}>", ""]
    materials = _materials(document)
    for link in document.links:
        lines += [*_link_lines(link, materials), ""]
    for joint in document.joints:
        lines += [*_joint_lines(joint), ""]
    return "\n".join([*lines, "</robot>", ""])


def dynamics_xml(document: Document) -> str:
    """The document without its shapes: what an engine needs of it."""
    links = tuple(replace(link, visuals=(), collisions=()) for link in document.links)
    return to_xml(replace(document, links=links))


def _tag(tag: str, /, **attributes: str | float | Vector) -> str:
    words = [f"{key}={quoteattr(_written(value))}" for key, value in attributes.items()]
    return " ".join([tag, *words])


def _written(value: str | float | Vector) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return " ".join(map(_written, value))
    return repr(max(-_LARGEST, min(float(value), _LARGEST)))


def _origin_lines(origin: Pose, indent: str) -> list[str]:
    return [] if origin == Pose() else [f"{indent}<{_tag('origin', xyz=origin.xyz, rpy=origin.rpy)}/>"]


def _materials(document: Document) -> dict[Vector, str]:
    """One name per colour: two materials of one name would be taken for the same."""
    colors = (g.color for link in document.links for g in link.visuals if g.color is not None)
    return {color: f"color{k}" for k, color in enumerate(dict.fromkeys(colors))}


def _link_lines(link: Link, materials: dict[Vector, str]) -> list[str]:
    lines = [f"  <{_tag('link', name=link.name)}>"]
    if link.inertial is not None:
        inertia = dict(zip(INERTIA, link.inertial.inertia, strict=True))
        lines += ["    <inertial>", *_origin_lines(link.inertial.origin, "      ")]
        lines += [f"      <{_tag('mass', value=link.inertial.mass)}/>"]
        lines += [f"      <{_tag('inertia', **inertia)}/>", "    </inertial>"]
    for kind, geometries in (("visual", link.visuals), ("collision", link.collisions)):
        for geometry in geometries:
            lines += _geometry_lines(kind, geometry, materials)
    return [*lines, "  </link>"]


def _geometry_lines(kind: str, geometry: Geometry, materials: dict[Vector, str]) -> list[str]:
    lines = [f"    <{kind}>", *_origin_lines(geometry.origin, "      ")]
    lines += [f"      <geometry><{_shape_tag(geometry.shape)}/></geometry>"]
    if kind == "visual" and geometry.color is not None:
        material = _tag("material", name=materials[geometry.color])
        lines += [f"      <{material}><{_tag('color', rgba=geometry.color)}/></material>"]
    return [*lines, f"    </{kind}>"]


def _shape_tag(shape: Shape) -> str:
    if shape.kind == "box":
        return _tag("box", size=shape.size)
    if shape.kind == "sphere":
        return _tag("sphere", radius=shape.size[0])
    if shape.kind == "mesh":
        return _tag("mesh", filename=shape.filename or "", scale=shape.size)
    return _tag(shape.kind, radius=shape.size[0], length=shape.size[1])


def _joint_lines(joint: Joint) -> list[str]:
    lines = [f"  <{_tag('joint', name=joint.name, type=joint.type)}>"]
    lines += [f"    <{_tag('parent', link=joint.parent)}/>", f"    <{_tag('child', link=joint.child)}/>"]
    lines += _origin_lines(joint.origin, "    ")
    if joint.moves:
        lines += [f"    <{_tag('axis', xyz=joint.axis)}/>", f"    <{_tag('limit', **_bounds(joint))}/>"]
    if joint.damping or joint.friction:
        lines += [f"    <{_tag('dynamics', damping=joint.damping, friction=joint.friction)}/>"]
    return [*lines, "  </joint>"]


def _bounds(joint: Joint) -> dict[str, float]:
    """Limits as numbers; the largest means none, for which a file has no word that all readers take."""
    limit = joint.limit or Limit()
    bounds = {"effort": limit.effort, "velocity": limit.velocity}
    if joint.type != "continuous":
        bounds["lower"] = -math.inf if limit.lower is None else limit.lower
        bounds["upper"] = math.inf if limit.upper is None else limit.upper
    return bounds
