"""Files that a robot description names: where packages are, what may be read, and reading it.

A package is a folder with a package.xml, and is called what that file says, whatever the folder's name is.
Where that file is missing, a folder with `meshes` beside `urdf` or `robots` is a package of its own name. Of
files that somebody else has named, regular ones only are read, and never more of them than was asked for.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator
from functools import cached_property
from importlib import metadata
from pathlib import Path
from xml.etree import ElementTree

from ...checks import instance

MANIFEST = "package.xml"
DESCRIPTIONS, MESHES = ("urdf", "robots"), "meshes"

_MANIFEST_BYTES = 1_000_000
_DEPTH = 3
"""How far below a folder that holds packages they are looked for: in a workspace, src/repository/package."""


class Packages:
    """The packages that a description can name.

    Attributes:
        here: the folder of the description, in which its relative paths begin.
        home: the package that the description lies in; `here` if it lies in none.
    """

    def __init__(self, file: Path | None, folders: Iterable[str | Path] = ()) -> None:
        """Where to look.

        Args:
            file: the description; None means the working directory.
            folders: that the user has named: packages, or folders that hold packages.

        Raises:
            InputError: `folders` are no folders' names.
        """
        self.here = Path(os.path.abspath(file.parent if file else "."))
        self.home = next(filter(_package_name, self._above), self.here)
        self._named = named_folders(folders)

    def folder(self, name: str) -> Path | None:
        """The folder of the package called `name`, or None.

        Looked for above the description, beside it and beside its package, in the folders that the user has
        named, in those of ROS_PACKAGE_PATH and AMENT_PREFIX_PATH, and among the packages of
        example-robot-data, in this order.
        """
        if not _is_plain(name):
            return None
        above = (folder for folder in self._above if _package_name(folder) == name)
        installed = (holder / name for holder in self._installed if os.path.isdir(holder / name))
        return next(above, None) or self._others.get(name) or next(installed, None)

    @property
    def _above(self) -> tuple[Path, ...]:
        return self.here, *self.here.parents

    @cached_property
    def roots(self) -> tuple[Path, ...]:
        """The folders in which the description may read, links followed."""
        holders = (*self._named, *_search_path("ROS_PACKAGE_PATH"), *self._installed)
        return tuple(dict.fromkeys(folder.resolve() for folder in (self.home, *self._siblings, *holders)))

    def allows(self, file: Path) -> bool:
        """Whether the description may read this file, wherever links lead."""
        try:
            resolved = file.resolve()
        except (OSError, RuntimeError, ValueError):  # a name that is too long, links in a circle, a zero byte
            return False
        return any(resolved.is_relative_to(root) for root in self.roots)

    @cached_property
    def _others(self) -> dict[str, Path]:
        """Packages by name that are neither above the description nor installed; the first counts."""
        holders = (*self._named, *_search_path("ROS_PACKAGE_PATH"))
        below = (folder for holder in holders for folder in (holder, *_below(holder, _DEPTH)))
        found: dict[str, Path] = {}
        for folder in (self.here, *_below(self.here, 1), *self._siblings, *below):
            found.setdefault(_package_name(folder) or folder.name, folder)
        return found

    @cached_property
    def _siblings(self) -> tuple[Path, ...]:
        """Packages beside that of the description."""
        beside = _below(self.home.parent, 1) if _package_name(self.home) else ()
        return tuple(filter(_package_name, beside))

    @cached_property
    def _installed(self) -> tuple[Path, ...]:
        """Folders whose packages lie in folders of their names."""
        shares = [prefix / "share" for prefix in _search_path("AMENT_PREFIX_PATH")]
        stock = data_folder()
        return (*shares, *([stock] if stock else []))


def data_folder() -> Path | None:
    """The folder of the packages of example-robot-data, or None where it is not installed."""
    try:
        found = metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share")
    except metadata.PackageNotFoundError:
        return None
    return Path(str(found))


def named_folders(folders: Iterable[str | Path]) -> tuple[Path, ...]:
    """Folders as a user names them, one or several, as absolute paths.

    Raises:
        InputError: they are no folders' names.
    """
    given = (folders,) if isinstance(folders, (str, Path)) else folders
    instance("package_dirs", given, Iterable, "folders")
    given = tuple(given)
    for folder in given:
        instance("package_dirs", folder, (str, Path), "folders")
    return tuple(Path(os.path.abspath(folder)) for folder in given)


def _search_path(variable: str) -> tuple[Path, ...]:
    """The absolute folders that an environment variable lists."""
    listed = os.environ.get(variable, "").split(os.pathsep)
    return tuple(Path(folder) for folder in listed if os.path.isabs(folder))


def _is_plain(name: str) -> bool:
    """Whether a name stands for something inside a folder, and for nothing else."""
    return name not in ("", ".", "..") and not set(name) & {"/", "\\", "\0"}


def _is_laid_out(folder: Path) -> bool:
    """Whether a folder looks like a package: descriptions and meshes side by side."""
    return os.path.isdir(folder / MESHES) and any(os.path.isdir(folder / name) for name in DESCRIPTIONS)


def _below(folder: Path, depth: int) -> Iterator[Path]:
    """The folders below a folder, by name, hidden ones left out; packages are not looked into."""
    try:
        children = sorted(entry.path for entry in os.scandir(folder) if entry.is_dir())
    except OSError:  # no such folder, or one that may not be read
        return
    for child in map(Path, children):
        if child.name.startswith("."):
            continue
        yield child
        if depth > 1 and not _package_name(child):
            yield from _below(child, depth - 1)


def _package_name(folder: Path) -> str | None:
    """What a package is called: as its package.xml says, or else as its folder; None if it is no package."""
    try:
        data = read_regular(folder / MANIFEST, _MANIFEST_BYTES)
    except Unusable:
        return folder.name if _is_laid_out(folder) else None
    if b"\0" in data or b"<!DOCTYPE" in data:  # nobody needs entities here, or UTF-16, which would hide them
        return folder.name
    try:
        name = ElementTree.fromstring(data).findtext("name", "")
    except (SyntaxError, ValueError, LookupError):  # not XML, or an encoding that nobody knows
        return folder.name
    return name.strip() or folder.name


# -- reading a file that somebody else has named -----------------------------------------------------------


class Unusable(Exception):
    """A file that cannot be used; the words say why."""


def read_regular(file: Path, limit: int) -> bytes:
    """The content of a regular file of at most `limit` bytes.

    Whatever else has a name in a file system (a pipe, a device) may hold a reader for ever: it is not opened.
    Should one take the file's place meanwhile, opening it does not wait.

    Raises:
        Unusable: there is no such file, it is not a regular one, it is larger, or it cannot be read.
    """
    require_regular(file)
    try:
        descriptor = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(descriptor, "rb") as stream:
            _require(os.fstat(descriptor).st_mode)
            data = stream.read(limit + 1)
    except OSError as error:
        raise Unusable(_reason(error)) from error
    if len(data) > limit:
        raise Unusable(f"expected at most {limit / 1e6:g} MB, found more")
    return data


def require_regular(file: Path) -> None:
    """Make sure that a regular file is there, without opening it.

    Raises:
        Unusable: there is none.
    """
    try:
        _require(os.stat(file).st_mode)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise Unusable(_reason(error)) from error


def _require(mode: int) -> None:
    if not stat.S_ISREG(mode):
        raise Unusable("it is not a regular file")


def _reason(error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError):
        return "there is no such file"
    words = getattr(error, "strerror", None) or str(error)
    return f"it cannot be read: {words}"
