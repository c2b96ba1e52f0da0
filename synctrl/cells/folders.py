"""Files that a cell file names lie below its own folder, wherever links lead."""

from __future__ import annotations

from pathlib import Path, PurePosixPath, PureWindowsPath

from ..errors import near
from .problems import Misfit, Place


def below(folder: Path, name: str, place: Place) -> Path:
    """The file or folder of a name, which has to lie below a folder.

    Args:
        folder: of the cell file.
        name: a path from there, with `/` between its parts.
        place: where the name stands.

    Raises:
        Misfit: a path from the root, one that leads out of the folder, by `..` or by a link, or to nothing.
    """
    pure = PurePosixPath(name)
    outside = pure.is_absolute() or ".." in pure.parts or "\0" in name or "\\" in name
    if outside or PureWindowsPath(name).drive:
        raise Misfit.at(
            place, f"expected a path that stays below the folder of this file, found {name!r}", name
        )
    try:
        found = (folder / pure).resolve()
        exists = found.exists()
    except (OSError, RuntimeError):
        found, exists = folder, False
    if exists and not found.is_relative_to(folder.resolve()):
        words = (
            f"expected a path that stays below the folder of this file, found {name!r}, a link that leads out"
        )
        raise Misfit.at(place, words, name)
    if not exists:
        words = f"expected a file below the folder of this file, found none at {name!r}"
        raise Misfit.at(place, f"{words}{near(name, _beside(folder, pure))}", name)
    return found


def _beside(folder: Path, pure: PurePosixPath) -> list[str]:
    """Names of what there is in the folder in which a file should be, if that lies below."""
    try:
        if not (folder / pure.parent).resolve().is_relative_to(folder.resolve()):
            return []
        return [(pure.parent / each.name).as_posix() for each in (folder / pure.parent).iterdir()]
    except (OSError, RuntimeError):
        return []


def from_folder(folder: Path, path: Path) -> str | None:
    """The name of a file as a cell file in a folder has it; None if it does not lie below."""
    found, root = path.resolve(), folder.resolve()
    return found.relative_to(root).as_posix() if found.is_relative_to(root) else None
