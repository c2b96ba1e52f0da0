"""The folder in which compiled libraries are kept, and who may have written what is in it.

A library is run as soon as it is loaded. So nothing is taken from a folder, or by way of a folder, in which
somebody else could have put it: every folder and link on the way has to belong to this user, or to the
administrator, and nobody else may write there. What is then read is loaded from a copy that nobody else sees.
"""

from __future__ import annotations

import errno
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import CompilationError, InputError
from .owners import HAS_OWNERS, WAY_OUT, check_file, check_way, check_writers, find_home

#: a library that is larger than this, bytes, is none of ours
LARGEST = 500_000_000
#: how folders begin in which something is being built
BUILDING = "building-"
#: the file in such a folder that is locked as long as somebody builds there
LOCK = "lock"

#: what files are opened with, of what the system has: Windows has others than the rest
_SAFELY = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_CLOEXEC", "O_BINARY"))
_READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | _SAFELY
_LOCK = os.O_RDWR | os.O_CREAT | _SAFELY
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _SAFELY


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
        check_way(folder)
        check_writers(folder, os.stat(folder))
    except OSError as error:
        raise CompilationError(
            f"the cache of compiled code, '{folder}', cannot be used: {error}; correct that, {WAY_OUT}",
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


def write_file(path: Path, content: bytes) -> None:
    """Write a new file of the cache, for this user alone.

    Raises:
        OSError: it is there, or cannot be written.
    """
    with open(os.open(path, _NEW, 0o600), "wb") as file:
        file.write(content)


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
        shutil.rmtree(folder, ignore_errors=True)  # Windows removes no file that is open


def remove_leftovers(cache: Path) -> None:
    """Remove what builds have left that were killed: folders that no living process has locked."""
    for folder in cache.glob(f"{BUILDING}*"):
        if folder.is_symlink() or not folder.is_dir():
            continue
        with suppress(OSError), open(os.open(folder / LOCK, _LOCK, 0o600), "r+b") as lock:
            _seize(lock.fileno())
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
    check_way(other)
    return other


# -- places -----------------------------------------------------------------------------------------------


def _usual_folder() -> Path:
    """The folder for users who have not named one."""
    home = find_home()
    if home is None:
        return _temporary() / (f"synctrl-{os.geteuid()}" if HAS_OWNERS else "synctrl")
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "synctrl"
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "synctrl"
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (named if named.is_absolute() else home / ".cache") / "synctrl"


def _temporary() -> Path:
    try:
        return Path(tempfile.gettempdir())
    except OSError as error:
        raise CompilationError(f"no folder for temporary files: {error}; name one by TMPDIR") from error


def _is_executable(place: Path) -> bool:
    noexec = hasattr(os, "statvfs") and os.statvfs(place).f_flag & getattr(os, "ST_NOEXEC", 0)
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
            _seize(lock, wait=True)
        if (folder / LOCK).exists():
            return folder, lock
        os.close(lock)


def _seize(lock: int, wait: bool = False) -> None:
    """Lock an open file; the lock ends with it, or with the process.

    Raises:
        OSError: somebody else has it, or there are no locks; Windows has others.
    """
    try:
        import fcntl
    except ImportError as error:
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP)) from error
    fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
