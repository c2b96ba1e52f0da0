"""Reading files that somebody else has named: regular ones only, never more of them than was asked for."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def read_regular(file: Path, limit: int) -> bytes:
    """The first `limit` bytes of a regular file.

    Whatever else has a name in a file system (a pipe, a device) may hold a reader for ever: it is not opened.
    Should one take the file's place meanwhile, opening it does not wait.

    Raises:
        OSError: there is no such file, it is not a regular one, its name is too long, or it cannot be read.
    """
    try:
        _require_regular(os.stat(file).st_mode)
    except ValueError as error:  # a zero byte in the name
        raise OSError(str(error)) from error
    descriptor = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(descriptor, "rb") as stream:
        _require_regular(os.fstat(descriptor).st_mode)
        return stream.read(limit)


def reason(error: OSError) -> str:
    """Why a file could not be read, in words."""
    return error.strerror or str(error)


def _require_regular(mode: int) -> None:
    if not stat.S_ISREG(mode):
        raise OSError("it is not a regular file")
