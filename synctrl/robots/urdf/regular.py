"""Reading files that somebody else has named: regular ones only, never more of them than was asked for."""

from __future__ import annotations

import os
import stat
from pathlib import Path


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
