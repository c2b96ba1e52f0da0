"""The folder in which compiled libraries are kept, and who may have written what is in it.

A library is run as soon as it is loaded. So nothing is taken from a folder, or by way of a folder, in which
somebody else could have put it: every folder and link on the way has to belong to this user, or to the
administrator, and nobody else may write there. What is then read is loaded from a copy that nobody else sees.
"""

from __future__ import annotations

import errno
import fcntl
import os
import pwd
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import CompilationError, InputError

#: a library that is larger than this, bytes, is none of ours
LARGEST = 500_000_000
#: how folders begin in which something is being built
BUILDING = "building-"
#: the file in such a folder that is locked as long as somebody builds there
LOCK = "lock"
#: links that may lie one behind another on the way to the folder, as the kernel allows them
MOST_LINKS = 40

_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_READ = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_LOCK = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
_KINDS = {
    stat.S_IFLNK: "a link",
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
_WAY_OUT = "or name another folder by SYNCTRL_CACHE, or use engine='pinocchio'"


def cache_folder() -> Path:
    """Where compiled libraries are kept: SYNCTRL_CACHE, or the user's cache folder.

    A user without a home gets a folder of their own among the temporary files.

    Raises:
        InputError: SYNCTRL_CACHE begins with the home of a user who is not known.
        CompilationError: SYNCTRL_CACHE is relative, and the working folder does not exist any more.
    """
    chosen = os.environ.get("SYNCTRL_CACHE")
    if not chosen:
        return _usual_folder()
    try:
        return Path(chosen).expanduser().absolute()
    except RuntimeError as error:
        raise InputError(
            f"expected a folder, found {chosen!r}: {error}", subject="SYNCTRL_CACHE", found=chosen
        ) from error
    except OSError as error:
        raise CompilationError(
            f"{chosen!r} is relative to a working folder that cannot be found: {error}",
            subject="SYNCTRL_CACHE",
            found=chosen,
        ) from error


def open_cache() -> Path:
    """The cache's folder, made if it was not there. Nobody else can write to it, or put another in its place.

    Raises:
        CompilationError: somebody else can, or it cannot be made; the message names the path.
    """
    folder = cache_folder()
    try:
        _check_way(folder)
        check_writers(folder, os.stat(folder))
    except OSError as error:
        raise CompilationError(
            f"the cache of compiled code, '{folder}', cannot be used: {error}; correct that, {_WAY_OUT}",
            file=folder,
            found=error.strerror,
        ) from error
    return folder


def read_file(path: Path, most: int = LARGEST) -> bytes | None:
    """What a file of the cache holds, up to so many bytes; None if there is none.

    Raises:
        CompilationError: it is no plain file, or somebody else may have written it.
        OSError: it cannot be read.
    """
    try:
        check_file(path, os.lstat(path))  # to open a device may do something
        with open(os.open(path, _READ), "rb") as file:
            check_file(path, os.fstat(file.fileno()))
            return file.read(most)
    except FileNotFoundError:
        return None


@contextmanager
def building_folder(place: Path) -> Iterator[Path]:
    """A folder for something that is being built; removed at the end.

    It is locked as long as it is used: see `remove_leftovers`.

    Raises:
        OSError: it cannot be made.
    """
    folder, lock = _locked_folder(place)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def remove_leftovers(cache: Path) -> None:
    """Remove what builds have left that were killed: folders that no living process has locked."""
    for folder in cache.glob(f"{BUILDING}*"):
        if folder.is_symlink() or not folder.is_dir():
            continue
        with suppress(OSError), open(os.open(folder / LOCK, _LOCK, 0o600), "r+b") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)


def executable_place(cache: Path) -> Path:
    """Where a library can be written and loaded: the cache, or else among the temporary files.

    Raises:
        CompilationError: in neither of them.
    """
    if _is_executable(cache):
        return cache
    other = _temporary()
    if not _is_executable(other):
        raise CompilationError(
            f"nothing may be written and executed in the cache '{cache}', nor in '{other}' (mounted noexec, "
            "or read-only?): name a folder where it may by SYNCTRL_CACHE or TMPDIR, or use "
            "engine='pinocchio'",
            file=cache,
            found="noexec",
        )
    _check_way(other)
    return other


# -- who may have written it ------------------------------------------------------------------------------


def check_owner(place: Path, found: os.stat_result) -> None:
    """Refuse what belongs to neither this user nor the administrator."""
    if found.st_uid not in (os.geteuid(), 0):
        raise _refusal(place, found, "belongs to another user", "remove it")


def check_writers(place: Path, found: os.stat_result) -> None:
    """Refuse a file or folder that others may write to."""
    if found.st_mode & _OTHERS:
        remedy = f"look at what is in it and run: chmod go-w '{place}'"
        raise _refusal(place, found, "can be written by others", remedy)


def check_file(path: Path, found: os.stat_result) -> None:
    """Refuse what is no plain file of this user, written by nobody else."""
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise _refusal(path, found, f"is {kind}, expected a plain file", "remove it")
    check_owner(path, found)
    check_writers(path, found)


def _refusal(place: Path, found: os.stat_result, fault: str, remedy: str) -> CompilationError:
    try:
        owner = f"{found.st_uid} ({pwd.getpwuid(found.st_uid).pw_name})"
    except KeyError:
        owner = str(found.st_uid)
    who = f"owner {owner}, mode {stat.S_IMODE(found.st_mode):04o}"
    return CompilationError(
        f"the cache of compiled code: '{place}' {fault} ({who}); "
        f"code is only run from where nobody else can have put it: {remedy}, {_WAY_OUT}",
        file=place,
        found=fault,
    )


def _check_way(folder: Path) -> None:
    """Refuse a folder that others could exchange for another one, in one of the folders above it."""
    for place, found in _way(folder):
        check_owner(place, found)
        if stat.S_ISDIR(found.st_mode) and not found.st_mode & stat.S_ISVTX:
            check_writers(place, found)


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


# -- places -----------------------------------------------------------------------------------------------


def _usual_folder() -> Path:
    """The folder for users who have not named one."""
    home = _home()
    if home is None:
        return _temporary() / f"synctrl-{os.geteuid()}"
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "synctrl"
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (named if named.is_absolute() else home / ".cache") / "synctrl"


def _home() -> Path | None:
    """The user's home, if there is one; `/` is what users without a home are given."""
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home if home.is_dir() and home != Path(home.anchor) else None


def _temporary() -> Path:
    try:
        return Path(tempfile.gettempdir())
    except OSError as error:
        raise CompilationError(f"no folder for temporary files: {error}; name one by TMPDIR") from error


def _is_executable(place: Path) -> bool:
    noexec = os.statvfs(place).f_flag & getattr(os, "ST_NOEXEC", 0)
    return not noexec and os.access(place, os.W_OK | os.X_OK)


def _locked_folder(place: Path) -> tuple[Path, int]:
    """A new folder, and the lock that says that it is in use.

    Between the two steps another process may take it for a leftover and remove it: then once more.
    """
    while True:
        folder = Path(tempfile.mkdtemp(dir=place, prefix=BUILDING))
        try:
            lock = os.open(folder / LOCK, _LOCK, 0o600)
        except FileNotFoundError:
            continue
        with suppress(OSError):  # file systems without locks keep their leftovers
            fcntl.flock(lock, fcntl.LOCK_EX)
        if (folder / LOCK).exists():
            return folder, lock
        os.close(lock)
