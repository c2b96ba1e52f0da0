"""Mesh files of a robot description: only inside its package or folder, and harmless to whoever draws them.

A mesh is not parsed when a robot is loaded. What is checked is that its path, and every path named inside it,
stays in the folder it belongs to, and that it is not cut short.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NoReturn

from ...errors import RobotError
from .xml import Element, quoted

MAX_MESH_BYTES = 200_000_000
FORMATS = (".stl", ".dae", ".obj")

_SEGMENT = re.compile(r"[A-Za-z0-9_+()\- ][A-Za-z0-9_.+()\- ]*", re.ASCII)
_DAE_IMAGES = re.compile(rb"<(?:\w+:)?init_from[^>]*>(.*?)</", re.DOTALL)
_OBJ_LIBRARIES = re.compile(rb"^\s*mtllib\s+(.*?)\s*$", re.MULTILINE)
_MTL_IMAGES = re.compile(rb"^\s*(?:map_\w+|bump|disp|decal|refl|norm)\s+(?:.*\s)?(\S+)\s*$", re.MULTILINE)


def check_filename(mesh: Element) -> str:
    """The file name of a `<mesh>`: `package://name/path` or a path below the description's own folder.

    Raises:
        RobotError: another scheme, an absolute path, `..`, or another format.
    """
    filename = mesh.text("filename")
    path = filename.removeprefix("package://")
    if not is_inside(path):
        mesh.refuse(
            "a mesh 'package://name/path' or a path below this folder, without '..'", quoted(filename)
        )
    if filename.startswith("package://") and "/" not in path:
        mesh.refuse("a mesh file in its package", quoted(filename))
    if Path(path).suffix.lower() not in FORMATS:
        mesh.refuse(f"a mesh in one of the formats {', '.join(FORMATS)}", quoted(filename))
    return filename


def is_inside(path: str) -> bool:
    """Whether a relative path can only lead down: plain segments, none empty, '.' only at the beginning."""
    return all(_SEGMENT.fullmatch(segment) for segment in path.removeprefix("./").split("/"))


def find_mesh(filename: str, folder: Path, package_dirs: Iterable[Path]) -> Path | None:
    """The file a mesh name stands for, or None if there is none.

    Args:
        filename: as `check_filename` has let it through.
        folder: where the description is; plain paths are below it.
        package_dirs: folders that hold packages; the first that has the file is taken.

    Raises:
        RobotError: the file is outside its package or folder (a symbolic link), or names files there.
    """
    for root, path in _candidates(filename, folder, package_dirs):
        file = root / path
        if file.is_file():
            _check_file(file, root)
            return file
    return None


def _candidates(filename: str, folder: Path, package_dirs: Iterable[Path]) -> Iterator[tuple[Path, str]]:
    if not filename.startswith("package://"):
        yield folder, filename
        return
    package, _, path = filename.removeprefix("package://").partition("/")
    for packages in package_dirs:
        yield packages / package, path
    for parent in folder.parents:
        if parent.name == package and (parent / "package.xml").is_file():
            yield parent, path


def _check_file(file: Path, root: Path) -> None:
    """Refuse a mesh that lies, or refers to something, outside `root`."""
    if not file.resolve().is_relative_to(root.resolve()):
        _refuse(file, f"a mesh inside {root}", "a link that leads out of it")
    if file.stat().st_size > MAX_MESH_BYTES:
        _refuse(file, f"a mesh of at most {MAX_MESH_BYTES / 1e6:g} MB", "a larger one")
    try:
        data = file.read_bytes()
    except OSError as error:
        raise RobotError(f"cannot be read: {error.strerror}", file=file) from error
    {".stl": _check_stl, ".dae": _check_dae, ".obj": _check_obj}[file.suffix.lower()](file, data)


def _check_stl(file: Path, data: bytes) -> None:
    """A binary STL has 80 bytes of header, a count, 50 bytes per triangle; a text STL ends with its name."""
    triangles = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) >= 84 + 50 * triangles:
        return
    if data.lstrip().startswith(b"solid") and b"endsolid" in data:
        return
    _refuse(file, "an STL mesh", "one that is cut short or of another format")


def _check_dae(file: Path, data: bytes) -> None:
    if b"\0" in data or b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        _refuse(file, "a mesh in UTF-8 without <!DOCTYPE> and entities", "one with them")
    if b"<COLLADA" not in data or b"</COLLADA>" not in data:
        _refuse(file, "a COLLADA mesh", "one that is cut short or of another format")
    for found in _DAE_IMAGES.findall(data):
        _check_reference(file, _text(found))


def _check_obj(file: Path, data: bytes) -> None:
    for found in _OBJ_LIBRARIES.findall(data):
        _check_reference(file, _text(found))
        library = file.parent / _text(found)
        if library.is_file():
            for image in _MTL_IMAGES.findall(library.read_bytes()):
                _check_reference(library, _text(image))


def _check_reference(file: Path, reference: str) -> None:
    """A file named in a mesh has to lie beside or below it."""
    if not is_inside(reference.strip()) or not _stays(file.parent, reference.strip()):
        _refuse(file, "references to files beside or below it", quoted(reference))


def _stays(folder: Path, reference: str) -> bool:
    return (folder / reference).resolve().is_relative_to(folder.resolve())


def _refuse(file: Path, expected: str, found: str) -> NoReturn:
    raise RobotError(f"expected {expected}, found {found}", file=file)


def _text(data: bytes) -> str:
    return data.decode("utf-8", errors="replace")
