"""Counting the triangles that a COLLADA file has drawn: nodes within nodes may draw a shape many times."""

from __future__ import annotations

from xml.etree import ElementTree

from .regular import Unusable

_PART = 200
"""What one part costs, however small it is, in triangles."""


def count_collada(data: bytes) -> int:
    """The triangles that are drawn, or somewhat more.

    Raises:
        Unusable: not COLLADA in UTF-8, with entities, cut short, with numbers that are not finite, or with
            nodes that contain themselves.
    """
    root = _parse(data)
    if not root.tag.endswith("COLLADA"):
        raise Unusable("expected a COLLADA mesh, found another format")
    for array in _all(root, "float_array"):
        if any(letter in (array.text or "") for letter in "nN"):  # of NaN and INF
            raise Unusable("it has numbers that are not finite")
    return _Scene(root).count()


def _parse(data: bytes) -> ElementTree.Element:
    if b"\0" in data or b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise Unusable("expected a mesh in UTF-8 without <!DOCTYPE> and entities")
    try:
        return ElementTree.fromstring(data)
    except (SyntaxError, ValueError, LookupError, RecursionError) as error:
        raise Unusable("expected a COLLADA mesh, found one that is cut short or of another format") from error


def _all(element: ElementTree.Element, tag: str) -> list[ElementTree.Element]:
    """What lies anywhere below an element and has this tag, in whatever namespace."""
    return [child for child in element.iter() if child.tag.rpartition("}")[2] == tag]


class _Scene:
    """Shapes and nodes of a COLLADA file by what refers to them."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.root = root
        self.shapes = {f"#{g.get('id')}": _triangles(g) for g in _all(root, "geometry")}
        self.nodes = {f"#{n.get('id')}": n for n in _all(root, "node") if n.get("id")}
        self.counts: dict[ElementTree.Element, int | None] = {}

    def count(self) -> int:
        """Triangles of all nodes that stand in a scene."""
        return sum(self._node(scene) for scene in _all(self.root, "visual_scene"))

    def _node(self, node: ElementTree.Element) -> int:
        """Triangles of a node, with those of the nodes in it; each node is counted once."""
        if node not in self.counts:
            self.counts[node] = None  # being counted
            self.counts[node] = sum(map(self._child, node))
        found = self.counts[node]
        if found is None:
            raise Unusable("it has nodes that contain themselves")
        return found

    def _child(self, child: ElementTree.Element) -> int:
        match child.tag.rpartition("}")[2]:
            case "node":
                return self._node(child)
            case "instance_node" if child.get("url") in self.nodes:
                return self._node(self.nodes[child.get("url", "")])
            case "instance_geometry" | "instance_controller":
                return max(self.shapes.get(child.get("url", ""), 0), _PART)
        return 0


def _triangles(geometry: ElementTree.Element) -> int:
    """A third of the corners where they are said to be triangles, else as many as there are corners."""
    triangles = sum(_corners(part) // 3 for part in _all(geometry, "triangles"))
    others = ("polylist", "polygons", "trifans", "tristrips")
    return triangles + sum(_corners(part) for tag in others for part in _all(geometry, tag))


def _corners(part: ElementTree.Element) -> int:
    offsets = [int(offset) for i in _all(part, "input") if (offset := i.get("offset", "0")).isdecimal()]
    texts = [p.text or "" for p in _all(part, "p")]
    indices = sum(1 + text.count(" ") + text.count("\n") + text.count("\t") for text in texts)
    return indices // (max(offsets, default=0) + 1)
