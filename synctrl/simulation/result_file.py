"""Result files: an uncompressed .npz archive of arrays, and info as JSON.

A file may come from anybody. What is read is compared with the size of the file before memory is asked for,
headers are matched with the one form that numpy writes and not evaluated, and whatever is wrong is a
ResultError.
"""

from __future__ import annotations

import json
import os
import struct
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np

from ..errors import ResultError
from ..files import whole_file
from ..robots.model import TURNS, unit_for
from .memory import in_parts
from .npy import Header, read_header, read_numbers
from .schema import check_info, read_json

#: what reading a file that is no archive, or a damaged one, may raise
_DAMAGE = (OSError, ValueError, LookupError, EOFError, RuntimeError, MemoryError, ArithmeticError)
_DAMAGE_OF_ARCHIVES = (*_DAMAGE, zipfile.BadZipFile, struct.error)
#: what arrays are made of
KINDS = (np.dtype(np.float64), np.dtype(np.float32))
#: largest time in a log, s, about 30,000 years: times beyond it are damage
LATEST = 1e12

#: array -> (dimensions, unit); "task" stands for the unit of the task, "weighted" for that of c e; what has
#: an axis "joint" has the unit that it has for a joint that turns
LAYOUT: Mapping[str, tuple[tuple[str, ...], str]] = MappingProxyType(
    {
        "t": (("time",), "s"),
        "x": (("time", "robot", "axis"), "task"),
        "x_desired": (("time", "robot", "axis"), "task"),
        "tracking_error": (("time", "robot", "axis"), "task"),
        "sync_error": (("time", "pair", "axis"), "weighted"),
        "sync_integral": (("time", "pair", "axis"), "weighted·s"),
        "coupled_error": (("time", "robot", "axis"), "weighted"),
        "q": (("time", "robot", "joint"), "rad"),
        "v": (("time", "robot", "joint"), "rad/s"),
        "v_error": (("time", "robot", "joint"), "rad/s"),
        "tau": (("time", "robot", "joint"), "N·m"),
        "disturbance": (("time", "robot", "joint"), "N·m"),
        "theta_hat": (("time", "robot", "parameter"), "SI"),
    }
)


def unit_of(array: str, task: str, weighted: str, joint: str = TURNS) -> str:
    """Unit of an array of `LAYOUT`, given those of the task and of c e, and of the position of the joint."""
    return unit_for(LAYOUT[array][1].replace("task", task).replace("weighted", weighted), joint)


def write_result(path: Path, info: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Write a result; what is written can be read.

    Args:
        path: the file.
        info: plain data, with its "format".
        arrays: those of `LAYOUT`, and outputs after "outputs/".

    Raises:
        ResultError: the file cannot be written, or the result does not follow the schema.
    """
    with named(path, "cannot write the result to"):
        try:
            text = json.dumps(info)
        except (TypeError, ValueError, RecursionError) as error:
            raise ResultError.expected("plain data", error, "info", shown=f"{error}") from None
        check_info(read_json(text))
        check_arrays(info, arrays)
        content: dict[str, Any] = {name: np.ascontiguousarray(array, float) for name, array in arrays.items()}
        with whole_file(path) as file:
            np.savez(file, info=np.array(text), **content)


def read_result(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Info and arrays of a result file.

    Raises:
        ResultError: the file is missing, damaged, or no result.
    """
    if not path.is_file():
        raise ResultError(f"no result file at '{path}'", file=path)
    with named(path, "no result of synctrl can be read from"), path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size  # of what is open: there may be another file of that name now
        with zipfile.ZipFile(file) as archive:
            members = _members(archive, size)
            info = read_json(_read_text(archive, members.pop("info", None)))
            check_info(info)
            arrays = _read_arrays(archive, members, info)
        check_arrays(info, arrays)
    return info, arrays


@contextmanager
def named(path: Path, what: str) -> Iterator[None]:
    """Name the file, or folder, in whatever goes wrong.

    Raises:
        ResultError: what cannot be done to it, and why.
    """
    try:
        yield
    except (ResultError, *_DAMAGE_OF_ARCHIVES) as error:
        found = getattr(error, "found", None) or getattr(error, "strerror", None)
        damage = ResultError(f"{what} '{path}': {error}", file=path, found=found)
        raise damage.about(getattr(error, "subject", None)) from error


# -- archives ---------------------------------------------------------------------------------------------


def _members(archive: zipfile.ZipFile, size: int) -> dict[str, zipfile.ZipInfo]:
    """What is in an archive, by name of the array: no more than there is on the disk."""
    found = archive.infolist()
    if any(entry.compress_type != zipfile.ZIP_STORED for entry in found):
        raise ResultError("expected uncompressed entries")
    if sum(entry.file_size for entry in found) > size:
        raise ResultError(f"expected entries of at most {size} bytes, as large as the file")
    members = {entry.filename.removesuffix(".npy"): entry for entry in found}
    if len(members) < len(found) or not all(entry.filename.endswith(".npy") for entry in found):
        raise ResultError("expected each array once, in an entry called <name>.npy")
    return members


def _read_arrays(
    archive: zipfile.ZipFile, members: Mapping[str, zipfile.ZipInfo], info: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """The arrays, each of the shape that info says; how many instants there are says the first one."""
    if "t" not in members:
        raise ResultError("expected one, found none", subject="array 't'")
    with archive.open(members["t"]) as stream:
        instants = _header_of(stream, members["t"]).shape
    expected = shapes(info, instants[0] if instants else 0)
    check_array_names(members, expected)
    return {name: _read_array(archive, members[name], name, expected[name]) for name in expected}


def _read_array(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str, expected: tuple[int | None, ...]
) -> np.ndarray:
    with archive.open(member) as stream:
        header = _header_of(stream, member)
        check_shape(name, header.dtype.newbyteorder("="), header.shape, expected)
        return read_numbers(stream, header).astype(float, copy=False)


def _read_text(archive: zipfile.ZipFile, member: zipfile.ZipInfo | None) -> str:
    """The one text of an array that holds nothing else."""
    if member is None:
        raise ResultError("expected one, found none", subject="array 'info'")
    with archive.open(member) as stream:
        header = _header_of(stream, member)
        if header.dtype.kind != "U" or header.shape:
            raise ResultError.expected("a text", (str(header.dtype), header.shape), "info")
        return str(read_numbers(stream, header))


def _header_of(stream: IO[bytes], member: zipfile.ZipInfo) -> Header:
    return read_header(stream, member.filename, member.file_size)


# -- what arrays have to be ---------------------------------------------------------------------------------


def shapes(info: Mapping[str, Any], instants: int) -> dict[str, tuple[int | None, ...]]:
    """Shape of every array, and of every output after "outputs/"; None is a length that info does not say."""
    lengths = {**info["sizes"], "time": instants}
    dimensions = chain(
        ((name, axes) for name, (axes, _) in LAYOUT.items()),
        ((f"outputs/{name}", about["axes"]) for name, about in info.get("outputs", {}).items()),
    )
    return {name: tuple(lengths.get(axis) for axis in axes) for name, axes in dimensions}


def check_arrays(info: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays that are not those that info speaks of, or numbers that no run has.

    Every number is finite, as a run stops before anything else is logged; outputs may say by NaN that there
    is no value. Times grow.

    Raises:
        ResultError: the array, what is expected and what is found.
    """
    expected = shapes(info, arrays["t"].size)
    check_array_names(arrays, expected)
    for name, array in arrays.items():
        check_shape(name, array.dtype, array.shape, expected[name])
        if name in LAYOUT and not all(np.isfinite(part).all() for part in in_parts(array)):
            where = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
            shown = f"{array[where]} at {where}"
            raise ResultError.expected("finite numbers", array[where], f"array '{name}'", shown=shown)
    check_times(arrays["t"])


def check_array_names(found: Iterable[str], expected: Iterable[str]) -> None:
    """Refuse arrays that are too many or too few.

    Raises:
        ResultError: with the names that are not in both.
    """
    different = ", ".join(sorted({*found} ^ {*expected}))
    if different:
        raise ResultError(
            f"expected those that info speaks of and no others, these differ: {different}",
            subject="arrays",
            found=different,
        )


def check_shape(name: str, dtype: np.dtype, found: tuple[int, ...], expected: tuple[int | None, ...]) -> None:
    """Refuse an array of another kind or shape; float32 is what a log may be kept in.

    Raises:
        ResultError: see above.
    """
    fits = len(found) == len(expected) and all(
        e is None or e == f for e, f in zip(expected, found, strict=True)
    )
    if not fits or dtype not in KINDS:
        kind, shown = (str(dtype), found), f"{dtype} of shape {found}"
        raise ResultError.expected(f"float64 of shape {expected}", kind, f"array '{name}'", shown=shown)


def check_times(t: np.ndarray) -> None:
    """Refuse times that do not grow, or are too large.

    Raises:
        ResultError: see above.
    """
    wrong = np.flatnonzero(~(np.abs(t) <= LATEST) | (np.diff(t, prepend=-np.inf) <= 0))
    if wrong.size:
        k = wrong[0]
        growing = f"times that grow, at most {LATEST:g} s"
        raise ResultError.expected(growing, t[k], "array 't'", shown=f"{t[k]} at {k}")
