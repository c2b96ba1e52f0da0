"""Who may have written a file or folder, and who could put another one in its place."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import CompilationError

#: whether files say whose they are, and who may write them; not on Windows
HAS_OWNERS = hasattr(os, "geteuid")
#: what else a user can do whose cache is refused
WAY_OUT = "or name another folder by SYNCTRL_CACHE, or use engine='pinocchio'"
#: links that may lie one behind another on the way to the folder, as the kernel allows them
MOST_LINKS = 40

_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_KINDS = {
    stat.S_IFLNK: "a link",
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def find_home() -> Path | None:
    """The user's home, if there is one; `/` is what users without a home are given."""
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home if home.is_dir() and home != Path(home.anchor) else None


def check_owner(place: Path, found: os.stat_result) -> None:
    """Refuse what belongs to neither this user nor the administrator."""
    if HAS_OWNERS and found.st_uid not in (os.geteuid(), 0):
        raise _refusal(place, found, "belongs to another user", "remove it")


def check_writers(place: Path, found: os.stat_result) -> None:
    """Refuse a file or folder that others may write to."""
    if HAS_OWNERS and found.st_mode & _OTHERS:
        remedy = f"look at what is in it and run: chmod go-w '{place}'"
        raise _refusal(place, found, "can be written by others", remedy)


def check_file(path: Path, found: os.stat_result) -> None:
    """Refuse what is no plain file of this user, written by nobody else."""
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise _refusal(path, found, f"is {kind}, expected a plain file", "remove it")
    check_owner(path, found)
    check_writers(path, found)


def check_way(folder: Path) -> None:
    """Refuse a folder that others could exchange for another one, in one of the folders above it.

    Where files do not say whose they are, only what lies in the user's home counts as theirs.
    """
    if not HAS_OWNERS:
        _check_home(folder)
    for place, found in _way(folder):
        check_owner(place, found)
        if stat.S_ISDIR(found.st_mode) and not found.st_mode & stat.S_ISVTX:
            check_writers(place, found)


# -- internals --------------------------------------------------------------------------------------------


def _check_home(folder: Path) -> None:
    home = find_home()
    if home is None or not Path(os.path.realpath(folder)).is_relative_to(os.path.realpath(home)):
        raise CompilationError(
            f"the cache of compiled code: '{folder}' is not in your home, and this system does not say who "
            "may have written it; code is only run from where nobody else can have put it: name a folder in "
            "your home by SYNCTRL_CACHE, or use engine='pinocchio'",
            file=folder,
            found="is not in your home",
        )


def _way(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    """Every folder and link from the root to a folder; folders that are missing are made, for this user.

    Raises:
        OSError: one of them is a file, or cannot be made or read.
    """
    here, ahead, links = Path(folder.anchor), [*reversed(folder.parts[1:])], 0
    while ahead:
        here /= ahead.pop()
        if here.name == "..":
            here = here.parent.parent
            continue
        found = _made(here)
        yield here, found
        if stat.S_ISLNK(found.st_mode):
            links += 1
            if links > MOST_LINKS:
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(folder))
            ahead += reversed(Path(os.readlink(here)).parts)
            here = here.parent
        elif not stat.S_ISDIR(found.st_mode):
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(here))


def _made(place: Path) -> os.stat_result:
    """What is at a place; a new folder for this user alone, if nothing was."""
    try:
        return os.lstat(place)
    except FileNotFoundError:
        with suppress(FileExistsError):
            os.mkdir(place, 0o700)
    return os.lstat(place)


def _refusal(place: Path, found: os.stat_result, fault: str, remedy: str) -> CompilationError:
    who = f"owner {_name(found.st_uid)}, mode {stat.S_IMODE(found.st_mode):04o}"
    return CompilationError(
        f"the cache of compiled code: '{place}' {fault} ({who}); "
        f"code is only run from where nobody else can have put it: {remedy}, {WAY_OUT}",
        file=place,
        found=fault,
    )


def _name(user: int) -> str:
    try:
        import pwd

        return f"{user} ({pwd.getpwuid(user).pw_name})"
    except (ImportError, KeyError):
        return str(user)
