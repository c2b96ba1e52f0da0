"""Counting the triangles that a glTF or GLB file has drawn."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import numpy as np

from .regular import Unusable

_MAGIC, _JSON, _BINARY = b"glTF", b"JSON", b"BIN\0"
_FLOAT, _TRIANGLES = 5126, 4
_PART = 200
"""What one part costs, however small it is, in triangles."""
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
        return sum(_triangles(header, node["mesh"]) for node in header.get("nodes", []) if "mesh" in node)
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
        if not np.isfinite(_positions(header, accessors[position], binary)).all():
            raise Unusable("it has corners that are not finite")


def _positions(header: _JsonObject, accessor: _JsonObject, binary: bytes) -> np.ndarray:
    """The corners in an accessor, (k, 3); none if they are not in the binary part of a GLB."""
    view = header["bufferViews"][accessor["bufferView"]] if "bufferView" in accessor else None
    if view is None or "uri" in header["buffers"][view["buffer"]] or accessor["componentType"] != _FLOAT:
        return np.empty((0, 3))
    offset = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    strides = (view.get("byteStride", 12), 4)
    return np.ndarray((accessor["count"], 3), "<f4", binary, offset, strides)


def _triangles(header: _JsonObject, mesh: int) -> int:
    found = 0
    for primitive in header["meshes"][mesh]["primitives"]:
        corners = header["accessors"][primitive.get("indices", primitive["attributes"]["POSITION"])]["count"]
        found += max(corners // 3 if primitive.get("mode", _TRIANGLES) == _TRIANGLES else corners, _PART)
    return found
