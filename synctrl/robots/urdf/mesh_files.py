"""What is looked at in a mesh file before it is shown: whole, finite, and not too much to draw.

Triangles are counted without building any, as often as the file has them drawn. A file may be hostile: what
it says about its own size is not believed.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .collada import count_collada
from .gltf import count_gltf
from .regular import Unusable, read_regular

MAX_MESH_BYTES = 64_000_000
MAX_TRIANGLES = 1_000_000

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


FORMATS = {
    ".stl": _count_stl,
    ".dae": count_collada,
    ".obj": _count_obj,
    ".glb": count_gltf,
    ".gltf": count_gltf,
}
