"""What is looked at in a mesh file before it is shown: whole, finite, and not too much to draw.

Triangles are counted without building any, as often as the file has them drawn. A file may be hostile: what
it says about its own size is not believed.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from .packages import Unusable, read_regular

MAX_MESH_BYTES = 64_000_000
MAX_TRIANGLES = 1_000_000
_PART = 200
"""What one part costs, however small it is, in triangles."""

_LFS = b"version https://git-lfs.github.com/spec/"
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])  # of a binary STL
_HEADER = 84
_NUMBER = rb"[-+]?(?:nan|inf)"
_STL_NOT_FINITE = re.compile(rb"vertex[^\n]*\s" + _NUMBER)
_OBJ_NOT_FINITE = re.compile(rb"^[ \t]*v[ \t][^\n]*" + _NUMBER, re.MULTILINE)
_OBJ_FACE = re.compile(rb"^[ \t]*f[ \t]([^\n]*)", re.MULTILINE)


def check_mesh(file: Path) -> bytes:
    """The content of a mesh file that can be shown.

    Raises:
        Unusable: it is missing, no regular file, of another format, too large, cut short, empty, a Git-LFS
            pointer, or has corners that are not finite.
    """
    suffix = file.suffix.lower()
    if suffix not in FORMATS:
        raise Unusable(f"expected one of the formats {', '.join(FORMATS)}")
    data = read_regular(file, MAX_MESH_BYTES)
    if suffix == ".dae":
        data = data.lstrip()  # some have empty lines before what has to come first
    if data.startswith(_LFS):
        raise Unusable("it is a Git-LFS pointer; fetch the mesh with: git lfs pull")
    triangles = FORMATS[suffix](data)
    if not triangles:
        raise Unusable("it holds no triangles")
    if triangles > MAX_TRIANGLES:
        raise Unusable(f"expected at most {MAX_TRIANGLES} triangles, found {triangles}")
    return data


def _count_stl(data: bytes) -> int:
    """A binary STL has 80 bytes of header, a count, 50 bytes per triangle; a text STL ends with its name."""
    count = int.from_bytes(data[80:_HEADER], "little")
    if len(data) == _HEADER + _TRIANGLE.itemsize * count:
        _require_finite(np.frombuffer(data, _TRIANGLE, count, _HEADER)["corners"])
        return count
    text = data.lower()
    if not text.lstrip().startswith(b"solid") or b"endsolid" not in text:
        raise Unusable("expected an STL mesh, found one that is cut short or of another format")
    _require_none(_STL_NOT_FINITE, data)
    return text.count(b"endfacet")


def _count_obj(data: bytes) -> int:
    """Faces of an OBJ are polygons, and become fans of triangles."""
    _require_none(_OBJ_NOT_FINITE, data)
    return sum(max(len(face[1].split()) - 2, 0) for face in _OBJ_FACE.finditer(data))


def _require_finite(corners: np.ndarray) -> None:
    if not np.isfinite(corners).all():
        raise Unusable("it has corners that are not finite")


def _require_none(pattern: re.Pattern[bytes], data: bytes) -> None:
    small = data.lower()
    if (b"nan" in small or b"inf" in small) and pattern.search(small):
        raise Unusable("it has corners that are not finite")


# -- COLLADA: nodes within nodes may draw a shape many times -----------------------------------------------


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


# -- glTF and GLB ------------------------------------------------------------------------------------------

_MAGIC, _JSON, _BINARY = b"glTF", b"JSON", b"BIN\0"
_FLOAT, _TRIANGLES = 5126, 4
_MAX_NUMBERS = 50_000_000
"""Of all accessors: one without a buffer costs its file nothing, and whoever reads it much."""
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")

_JsonObject = dict[str, Any]


def count_gltf(data: bytes) -> int:
    """The triangles that are drawn, or somewhat more.

    Raises:
        Unusable: another format, cut short, compressed, with corners that are not finite, or with nodes that
            have two parents or contain themselves.
    """
    try:
        header, binary = _parts(data)
        compressed = set(_COMPRESSED) & set(header.get("extensionsRequired", ()))
        if compressed:
            raise Unusable(f"it needs {compressed.pop()}, which is not read here")
        _check_tree(header.get("nodes", []))
        _check_accessors(header, binary)
        return sum(_triangles_of(header, node["mesh"]) for node in header.get("nodes", []) if "mesh" in node)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        raise Unusable("expected a glTF mesh, found one that is cut short or of another format") from error


def _parts(data: bytes) -> tuple[_JsonObject, bytes]:
    """What a file says, and the numbers that a GLB carries with it."""
    if not data.startswith(_MAGIC):
        return json.loads(data), b""
    chunks = {}
    start, end = 12, int.from_bytes(data[8:12], "little")
    if end > len(data):
        raise Unusable("expected a GLB mesh, found one that is cut short")
    while start < end:
        size = int.from_bytes(data[start : start + 4], "little")
        chunks[data[start + 4 : start + 8]] = data[start + 8 : start + 8 + size]
        start += 8 + size
    return json.loads(chunks[_JSON]), chunks.get(_BINARY, b"")


def _check_tree(nodes: list[_JsonObject]) -> None:
    """Every node has one parent at most, and is below one that has none."""
    parents = Counter(child for node in nodes for child in node.get("children", ()))
    if any(count > 1 for count in parents.values()):
        raise Unusable("it has a node with two parents")
    reached = [k for k in range(len(nodes)) if not parents[k]]
    for k in reached:  # grows meanwhile
        reached += nodes[k].get("children", ())
    if len(reached) != len(nodes):
        raise Unusable("it has nodes that contain themselves")


def _check_accessors(header: _JsonObject, binary: bytes) -> None:
    accessors = header["accessors"]
    if sum(accessor["count"] for accessor in accessors) > _MAX_NUMBERS:
        raise Unusable("it asks for more numbers than any mesh has")
    primitives = [primitive for mesh in header["meshes"] for primitive in mesh["primitives"]]
    for position in {primitive["attributes"]["POSITION"] for primitive in primitives}:
        _require_finite(_positions(header, accessors[position], binary))


def _positions(header: _JsonObject, accessor: _JsonObject, binary: bytes) -> np.ndarray:
    """The corners in an accessor, (k, 3); none if they are not in the binary part of a GLB."""
    view = header["bufferViews"][accessor["bufferView"]] if "bufferView" in accessor else None
    if view is None or "uri" in header["buffers"][view["buffer"]] or accessor["componentType"] != _FLOAT:
        return np.empty((0, 3))
    offset = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    strides = (view.get("byteStride", 12), 4)
    return np.ndarray((accessor["count"], 3), "<f4", binary, offset, strides)


def _triangles_of(header: _JsonObject, mesh: int) -> int:
    found = 0
    for primitive in header["meshes"][mesh]["primitives"]:
        corners = header["accessors"][primitive.get("indices", primitive["attributes"]["POSITION"])]["count"]
        found += max(corners // 3 if primitive.get("mode", _TRIANGLES) == _TRIANGLES else corners, _PART)
    return found


FORMATS = {
    ".stl": _count_stl,
    ".dae": count_collada,
    ".obj": _count_obj,
    ".glb": count_gltf,
    ".gltf": count_gltf,
}
