"""The memory of a digital controller as a file: what is read is exactly what would have been written.

A state has known arrays of known sizes, so nothing in a file is believed: it is no longer than it may be, and
the header of every array has to be the one that numpy writes for that array. There is no pickle in it.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from ..checks import instance
from ..errors import ResultError
from ..files import reported, whole_file

#: bytes of an archive beside its arrays, per array: names, sizes and numpy's header
OVERHEAD = 1024


def write_state(path: str | Path, state: Mapping[str, np.ndarray]) -> Path:
    """Write arrays of floats to an .npz file, which appears when it is whole.

    Args:
        path: the file.
        state: arrays by name.

    Raises:
        InputError: something else than a path.
        ResultError: the file cannot be written.
    """
    instance("path", path, (str, Path), "a path")
    with reported("write the controller's state to", path), whole_file(path) as file:
        np.savez(file, **state)  # type: ignore[arg-type]
    return Path(path)


def read_state(path: str | Path, like: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays with the names and sizes of others, from a file that `write_state` made.

    Args:
        path: the file.
        like: what is expected, by name.

    Raises:
        InputError: something else than a path.
        ResultError: the file is missing, damaged, or holds anything else.
    """
    instance("path", path, (str, Path), "a path")
    limit = sum(array.nbytes + OVERHEAD for array in like.values()) + OVERHEAD
    try:
        with Path(path).open("rb") as file:
            data = file.read(limit + 1)
        if len(data) > limit:
            raise ResultError(f"expected at most {limit} bytes, found more")
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return _arrays(archive, like)
    except Exception as error:  # whatever a damaged archive makes its readers raise
        raise ResultError(f"'{path}' has no state of this controller: {error}", file=path) from error


def _arrays(archive: zipfile.ZipFile, like: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    expected, found = sorted(f"{name}.npy" for name in like), sorted(archive.namelist())
    if found != expected:
        raise ResultError(f"expected the arrays {', '.join(expected)}, found {', '.join(found) or 'none'}")
    return {name: _array(archive, name, array) for name, array in like.items()}


def _array(archive: zipfile.ZipFile, name: str, like: np.ndarray) -> np.ndarray:
    header = _header(like)
    entry = archive.getinfo(f"{name}.npy")
    size = len(header) + like.nbytes
    if entry.compress_type != zipfile.ZIP_STORED or entry.file_size != size:
        raise ResultError(f"{name}: expected {size} bytes as they are, found {entry.file_size}")
    data = archive.read(entry)
    if not data.startswith(header):
        raise ResultError(f"{name}: expected an array of floats of shape {like.shape}")
    return np.frombuffer(data, dtype=float, offset=len(header)).reshape(like.shape).copy()


def _header(like: np.ndarray) -> bytes:
    """What numpy writes before the numbers of an array of floats."""
    file = BytesIO()
    np.save(file, np.zeros(like.shape))
    return file.getvalue()[: file.tell() - like.nbytes]
