"""Files that are whole: whoever reads a name finds all of one version, and never a part."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from .errors import ResultError


@contextlib.contextmanager
def whole_file(path: str | Path) -> Iterator[BinaryIO]:
    """A file to write to, which appears under its name, and on the disk, once all is written.

    Until then it has a name of its own in the same folder, so that any number of processes may write to one
    path: the last one to finish wins. If writing fails nothing is left, and what was there before stays. The
    folder is made; a link is followed.

    Raises:
        OSError: the file cannot be written, its name is none, or there is something that is no regular file.
    """
    with whole_path(path) as partial, open(partial, "wb") as file:
        yield file


@contextlib.contextmanager
def whole_path(path: str | Path) -> Iterator[Path]:
    """The same for whoever opens files itself: a path to write to, of an empty file.

    Raises:
        OSError: see `whole_file`.
    """
    target = _target(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    partial, descriptor = _create_beside(target)
    os.close(descriptor)
    try:
        yield partial
        _keep_content(partial)
        partial.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise
    _keep_name(target.parent)


def read_regular(path: str | Path) -> bytes:
    """What a file holds. What is none is refused before it is opened: a pipe would keep its reader waiting.

    Raises:
        OSError: there is none, it cannot be read, or it is no regular file.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "expected a regular file, found a folder, a pipe, a device or the like")
    return path.read_bytes()


def write_whole(path: str | Path, content: str | bytes) -> None:
    """Write text, as UTF-8 with lines as they are, or bytes, as `whole_file` does.

    Raises:
        OSError: see `whole_file`; also a text with half a surrogate pair, which no file can hold.
    """
    try:
        data = content.encode("utf-8") if isinstance(content, str) else content
    except UnicodeEncodeError as error:
        found = error.object[error.start : error.end]
        raise OSError(errno.EILSEQ, f"expected text that UTF-8 can hold, found {found!r} in it") from None
    with whole_file(path) as file:
        file.write(data)


@contextlib.contextmanager
def reported(doing: str, path: str | Path) -> Iterator[None]:
    """Turn an `OSError` in the block into what users are told.

    Args:
        doing: what cannot be done if it fails, for example "write the page".
        path: of the file or folder concerned.

    Raises:
        ResultError: what cannot be done to which file, and the system's reason.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise ResultError(f"cannot {doing} '{path}': {reason}", file=path, found=reason) from error


def _target(path: str | Path) -> Path:
    """Where a path leads; there is a regular file, or nothing."""
    try:
        target = Path(os.path.realpath(path))
        taken = target.exists() and not target.is_file()
    except ValueError:  # a zero byte, or half a surrogate pair
        raise OSError(errno.EINVAL, f"expected the name of a file, found {str(path)!r}") from None
    if taken:
        raise OSError(errno.EEXIST, "expected a file, found a folder, a device or the like")
    return target


def _create_beside(target: Path) -> tuple[Path, int]:
    """A new file in the folder of another one, with the permissions that new files have here."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    while True:
        partial = target.with_name(f".synctrl-{secrets.token_hex(8)}.part")
        with contextlib.suppress(FileExistsError):
            return partial, os.open(partial, flags, 0o666)


def _keep_content(file: Path) -> None:
    """Bring what a file holds to the disk.

    Raises:
        OSError: it cannot be brought there.
    """
    descriptor = os.open(file, os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _keep_name(folder: Path) -> None:
    """Bring a new name in a folder to the disk, where the system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
