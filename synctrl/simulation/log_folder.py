"""A result as a folder: an .npy file per array, which grows row by row while a run goes, and info as JSON.

`info.json` is written last: a folder without it is none of a run that has ended. A folder may come from
anybody. Names of files follow from the schema, so none lies outside the folder; links are not followed;
headers are matched with the one form that is written here, and compared with the size of the file. Arrays are
mapped into memory, read-only. Nothing is unpickled.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..errors import ResultError
from ..files import read_regular, reported, write_whole
from .memory import in_parts
from .npy import LENGTH, read_header, written_header
from .result_file import LAYOUT, check_shape, check_times, named, shapes
from .schema import check_info, read_json

#: precisions in which arrays may be kept
DTYPES = ("float64", "float32")
INFO, ROWS, OUTPUTS = "info.json", "rows", "outputs"
_CODES = {"float64": "<f8", "float32": "<f4"}


class FolderWriter:
    """Files that grow by rows; the folder is made when the first ones come.

    Args:
        folder: where, a folder that is not there yet.
        row_shapes: shape of one row of every array.
        dtype: of all arrays but the times, one of `DTYPES`.

    Raises:
        ResultError: nothing can be written there, in any method.
    """

    def __init__(self, folder: Path, row_shapes: Mapping[str, tuple[int, ...]], dtype: str):
        self.folder, self._shapes = folder, row_shapes
        self._codes = {name: _CODES["float64" if name == "t" else dtype] for name in row_shapes}
        self._files: dict[str, IO[bytes]] = {}
        self._count, self._begun = 0, False

    def put(self, first: int, rows: Mapping[str, np.ndarray]) -> None:
        """Write rows of every array from a number on; once more if an interrupt came meanwhile."""
        with reported("write the log to", self.folder):
            self._open()
            for name, part in rows.items():
                numbers = part.astype(self._codes[name], copy=False)
                self._files[name].seek(LENGTH + first * prod(part.shape[1:]) * numbers.itemsize)
                self._files[name].write(numbers.data)
        self._count = first + len(next(iter(rows.values())))

    def logged(self) -> dict[str, np.ndarray]:
        """What has come until now, mapped."""
        with reported("write the log to", self.folder):
            self._open()
            for file in self._files.values():
                file.flush()
            return {name: self._mapped(name) for name in self._files}

    def taken(self) -> dict[str, np.ndarray]:
        """What has come, mapped, at the end: files say how many rows they have."""
        with reported("write the log to", self.folder):
            self._open()
            for name, file in self._files.items():
                _finish(file, self._codes[name], (self._count, *self._shapes[name]))
        return {name: self._mapped(name) for name in self._files}

    def _open(self) -> None:
        """Make those of the files that are not there yet; it can be called again if an interrupt came."""
        if len(self._files) == len(self._shapes):
            return
        if not self._begun:
            self.folder.mkdir(parents=True)
            self._begun = True
        for name in (ROWS, OUTPUTS):
            (self.folder / name).mkdir(exist_ok=True)
        for name in (name for name in self._shapes if name not in self._files):
            file = self._path(name).open("wb")
            file.write(b" " * LENGTH)
            self._files[name] = file

    def _path(self, name: str) -> Path:
        return (self.folder if name in LAYOUT else self.folder / ROWS) / f"{name}.npy"

    def _mapped(self, name: str) -> np.ndarray:
        return _mapped(self._path(name), self._codes[name], (self._count, *self._shapes[name]))


def complete(
    folder: Path, info: Mapping[str, Any], arrays: Mapping[str, np.ndarray], dtype: str
) -> dict[str, np.ndarray]:
    """Make a folder of logged rows a result; it is one from when its info is there.

    Args:
        folder: what a `FolderWriter` has written.
        info: plain data, with its "format".
        arrays: those of `LAYOUT`, which are there already, and outputs after "outputs/".
        dtype: of outputs, one of `DTYPES`.

    Returns:
        All arrays, mapped.

    Raises:
        ResultError: it cannot be written, or does not follow the schema.
    """
    with named(folder, "cannot write the result to"):
        text = json.dumps(info)
        check_info(read_json(text))
        for name in (name for name in arrays if name not in LAYOUT):
            _write(folder / f"{name}.npy", arrays[name], _CODES[dtype])
        shutil.rmtree(folder / ROWS, ignore_errors=True)
        write_whole(folder / INFO, text)
    return read_folder(folder)[1]


def read_folder(folder: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Info, and the arrays mapped, of a folder; their numbers are not looked through, only the times.

    Raises:
        ResultError: something is missing, damaged, or no result.
    """
    if not (folder / INFO).exists():
        raise ResultError(
            f"no result in the folder '{folder}': {INFO} is missing, which ends a run", file=folder
        )
    with named(folder, "no result of synctrl can be read from"):
        folder = folder.resolve()
        _check_inside(folder / INFO)
        info = read_json(read_regular(folder / INFO).decode("utf-8"))
        check_info(info)
        t = _read(folder, "t", (None,), "float64")
        dtype = info.get("log_dtype", "float64")
        expected = {name: shape for name, shape in shapes(info, len(t)).items() if name != "t"}
        arrays = {name: _read(folder, name, shape, dtype) for name, shape in expected.items()}
        check_times(t)
    return info, {"t": t, **arrays}


# -- files -------------------------------------------------------------------------------------------------


def _read(folder: Path, name: str, expected: tuple[int | None, ...], dtype: str) -> np.ndarray:
    """One array of a result, mapped."""
    path = folder / f"{name}.npy"
    _check_inside(path)
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        header = read_header(file, name, size, widths=("8", "4"))
        check_shape(name, header.dtype.newbyteorder("="), header.shape, expected)
        if header.dtype.str != _CODES.get(dtype) or header.order != "C":
            raise ResultError.expected(f"rows of {dtype}", header.dtype.str, f"array '{name}'")
        return _map(file, header.dtype.str, header.shape, file.tell())


def _check_inside(path: Path) -> None:
    """Refuse files that are somewhere else, or none."""
    for part in (path, path.parent):
        if part.is_symlink():
            raise ResultError("expected a file, found a link", subject=f"{part.name!a}")
    if not path.is_file():
        raise ResultError("expected one, found none", subject=f"file {path.name!a}")


def _mapped(path: Path, code: str, shape: tuple[int, ...]) -> np.ndarray:
    with path.open("rb") as file:
        return _map(file, code, shape, LENGTH)


def _map(file: IO[bytes], code: str, shape: tuple[int, ...], offset: int) -> np.ndarray:
    """Numbers of a file, read-only; nothing can be mapped of none."""
    if not prod(shape):
        return np.zeros(shape, code)
    return np.memmap(file, code, "r", offset, shape)


def _write(path: Path, array: np.ndarray, code: str) -> None:
    """A file with all of an array, of which little is in memory at a time."""
    with path.open("xb") as file:
        file.write(b" " * LENGTH)
        for part in in_parts(array):
            file.write(np.ascontiguousarray(part, code).data)
        _finish(file, code, array.shape)


def _finish(file: IO[bytes], code: str, shape: tuple[int, ...]) -> None:
    """Write the header, bring all to the disk, and close."""
    if file.closed:
        return
    file.seek(0)
    file.write(written_header(code, shape))
    file.flush()
    os.fsync(file.fileno())
    file.close()
