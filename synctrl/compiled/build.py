"""From generated C to a loaded library, kept in a cache.

The cache is addressed by content: the key is a digest of everything the code depends on, so a second run
compiles nothing, and an entry is never wrong, only missing. An entry that is damaged is built again. Entries
appear under their name only once complete, so two processes may build the same one at the same time.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import platform
import struct
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..errors import CompilationError, MissingDependencyError
from .cache import building_folder, executable_place, open_cache, read_file, remove_leftovers, write_file
from .compiler import FLAGS, SUFFIX, compile_library, compiler, compiler_version
from .process import fault
from .processor import cpu_features

#: rooms of the package that generated code is made from, or compared with
ROOMS = ("robots", "tasks", "coupling", "control", "simulation", "assembly", "compiled")
#: a digest in a file is shorter than this, bytes
DIGEST = 200

Check = Callable[[ctypes.CDLL], None]

#: libraries that this process has loaded and checked, by key and digest: to do it once is enough
_CHECKED: dict[tuple[str, str], ctypes.CDLL] = {}


class _Layout(NamedTuple):
    """Where numbers stand in the headers of 32 or 64 bits: formats and offsets."""

    size: int
    tables: tuple[str, int]
    counts: tuple[str, int]
    segment: str


_LAYOUTS = {
    1: _Layout(52, ("II", 28), ("4H", 42), "II8xI"),
    2: _Layout(64, ("QQ", 32), ("4H", 54), "I4xQ16xQ"),
}
_ORDERS = {1: "<", 2: ">"}
#: segments of this type are mapped into memory
_LOAD = 1


def require_casadi() -> str:
    """Version of CasADi.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        from casadi import CasadiMeta
    except ImportError as error:
        raise MissingDependencyError(
            "engine='compiled' needs it: pip install 'synctrl[compiled]'; or use engine='pinocchio'",
            subject="CasADi",
        ) from error
    return str(CasadiMeta.version())


def content_key(*parts: object) -> str:
    """Digest of plain data, of all code that generates code or is compared with it, compiler and processor.

    So two machines may share a cache, and neither runs code that was made for the other's processor.

    Raises:
        MissingDependencyError, CompilationError: there is no compiler, or it cannot be run.
    """
    command = compiler()
    version, machine = compiler_version(command), [platform.system(), platform.machine(), cpu_features()]
    content = json.dumps([*parts, command, version, machine, FLAGS, digest_of_sources()], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


@cache
def digest_of_sources(package: Path = Path(__file__).parents[1]) -> str:
    """Digest of every source file in the rooms that generated code depends on."""
    files = sorted(path for room in ROOMS for path in (package / room).rglob("*"))
    found = hashlib.sha256()
    for path in files:
        if path.suffix in (".py", ".c", ".h"):
            content = path.read_bytes()
            found.update(f"{path.relative_to(package)} {len(content)}\n".encode() + content)
    return found.hexdigest()


def cached_library(key: str, generate: Callable[[], Iterable[str]], check: Check) -> ctypes.CDLL:
    """The library of a key, from the cache or built now.

    Args:
        key: see `content_key`.
        generate: writes the C sources, called only if they are needed; they are compiled as they come.
        check: raises a CompilationError if a library computes something else than it should; it is called
            once in a process, for a new library and for one from the cache.

    Raises:
        CompilationError: the compiler refused the code, the cache cannot be written, somebody else can write
            to it, or the library fails the check.
    """
    folder = open_cache()
    try:
        return _stored(folder, key, check) or _built(folder, key, generate, check)
    except OSError as error:
        raise CompilationError(
            f"cannot write to the cache '{folder}': {error}", file=folder, found=error.strerror
        ) from error


def load(content: bytes, folder: Path) -> ctypes.CDLL:
    """A library with this content, from a copy that only this process knows.

    What happens to the file in the cache later has no effect on it.

    Raises:
        CompilationError: nothing may be executed, neither in the cache nor among the temporary files.
        OSError: it is no library.
    """
    if sys.platform == "linux" and not is_whole(content):
        raise OSError("no shared library, or only a part of one")
    with building_folder(executable_place(folder)) as place:
        copy = place / f"library{SUFFIX}"
        copy.write_bytes(content)
        return ctypes.CDLL(str(copy))


def is_whole(content: bytes) -> bool:
    """Whether a shared library of Linux, in ELF format, has every part that its headers speak of.

    The system's loader believes them; where they promise more than there is, the process dies.
    """
    if len(content) < 6 or content[:4] != b"\x7fELF":
        return False
    layout, order = _LAYOUTS.get(content[4]), _ORDERS.get(content[5])
    if layout is None or order is None or len(content) < layout.size:
        return False
    segments, sections = struct.unpack_from(order + layout.tables[0], content, layout.tables[1])
    size, count, section_size, section_count = struct.unpack_from(
        order + layout.counts[0], content, layout.counts[1]
    )
    ends = [segments + size * count, sections + section_size * section_count]
    if max(ends) > len(content) or size < struct.calcsize(order + layout.segment):
        return False
    for k in range(count):
        kind, start, length = struct.unpack_from(order + layout.segment, content, segments + k * size)
        if kind == _LOAD:
            ends.append(start + length)
    return max(ends) <= len(content)


# -- internals --------------------------------------------------------------------------------------------


def _stored(folder: Path, key: str, check: Check) -> ctypes.CDLL | None:
    """The library if its file is what was once published, and computes what it should; else None."""
    try:
        digest, content = read_file(folder / f"{key}.sha256", DIGEST), read_file(folder / f"{key}{SUFFIX}")
    except OSError:
        return None
    if digest is None or content is None or digest.strip() != _digest(key, content).encode():
        return None
    with suppress(OSError, CompilationError):
        return _checked(folder, key, content, check)
    return None


def _built(folder: Path, key: str, generate: Callable[[], Iterable[str]], check: Check) -> ctypes.CDLL:
    remove_leftovers(folder)
    with building_folder(folder) as place:
        content = compile_library(generate(), place).read_bytes()
        try:
            library = _checked(folder, key, content, check)
        except OSError as error:
            raise fault(compiler()[0], "wrote what cannot be loaded as a library", f": {error}") from error
        _publish(place, folder / key, key, content)
    return library


def _checked(folder: Path, key: str, content: bytes, check: Check) -> ctypes.CDLL:
    """The library with this content, loaded and checked unless this process has done so before."""
    name = key, _digest(key, content)
    if name not in _CHECKED:
        library = load(content, folder)
        check(library)
        _CHECKED[name] = library
    return _CHECKED[name]


def _publish(place: Path, target: Path, key: str, content: bytes) -> None:
    """Write a library and its digest, then move them to their names.

    In between, a reader finds a digest that does not fit.
    """
    for suffix, data in ((SUFFIX, content), (".sha256", _digest(key, content).encode())):
        file = place / f"published{suffix}"
        write_file(file, data)
        file.replace(f"{target}{suffix}")


def _digest(key: str, content: bytes) -> str:
    """Digest of a library under its key, so that it does not fit under another one."""
    return hashlib.sha256(key.encode() + b" " + content).hexdigest()
