"""Where the rows of a log go: into arrays in memory, or through a few rows of doubles on to where they stay.

Engines fill rows of doubles, one after another, and count them. In memory these are the arrays of the result
already. Where rows are kept in single precision, or in files, they are the first rows of a block, which is
passed on and filled anew: then at most `AHEAD` + `OFTEN` rows are in memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..checks import choice, instance
from ..errors import InputError
from .clock import Clock
from .log_folder import DTYPES, FolderWriter
from .memory import check_fits, check_fits_disk

#: rows that an engine may fill before it counts them, at most
AHEAD = 4096
#: rows that are passed on together where they come one by one
OFTEN = 64
#: doubles in a piece of memory: the allocator of Linux gives up to 32 MB out again without asking the system
PIECE = 2**22 - 2**13

Shapes = Mapping[str, tuple[int, ...]]
"""Shape of one row of every array."""


class Keeping(NamedTuple):
    """How a log is kept.

    Attributes:
        folder: where its arrays become files; None for memory.
        dtype: "float64" or "float32", of all arrays but the times.
    """

    folder: Path | None = None
    dtype: str = "float64"

    @property
    def whole(self) -> bool:
        """Whether the rows that engines fill are those of the result."""
        return self.folder is None and self.dtype == "float64"


IN_MEMORY = Keeping()


def check_room(clock: Clock, row: int, kept: Keeping) -> None:
    """Refuse a log that does not fit where it is kept.

    Args:
        clock: its instants.
        row: what one of them takes in doubles, bytes.
        kept: how it is kept.

    Raises:
        InputError: see `check_fits`.
    """
    size = row if kept.dtype == "float64" else -(-row // 2)
    if kept.folder is None:
        check_fits(clock, size)
    else:
        check_fits_disk(clock, size, kept.folder)


def keeping(log_to: Any, log_dtype: Any) -> Keeping:
    """What a user says of how to keep a log.

    Raises:
        InputError: no path, a folder or file that is there already, or an unknown word.
    """
    dtype = choice("log_dtype", log_dtype, DTYPES)
    if log_to is None:
        return Keeping(None, dtype)
    instance("log_to", log_to, (str, Path), "the path of a folder")
    folder = Path(log_to).absolute()
    try:
        os.lstat(folder)
    except FileNotFoundError:
        return Keeping(folder, dtype)
    except (OSError, ValueError) as error:
        text = f"expected the path of a folder, found {str(log_to)!a:.80}: {error}"
        raise InputError(text, subject="log_to") from None
    raise InputError.expected("a folder that is not there yet", str(folder), "log_to")


class Log(Protocol):
    """Rows that are logged one after another.

    Attributes:
        rows: arrays of doubles by name, in which the next rows are filled.
        at: the row of these arrays that is filled next.
        count: how many rows are logged.
    """

    rows: dict[str, np.ndarray]

    @property
    def at(self) -> int: ...

    @property
    def count(self) -> int: ...

    def advance(self, number: int) -> None:
        """Count so many rows that were filled."""

    def last(self, name: str) -> np.ndarray:
        """An array in the row that was logged last; zeros if there is none."""

    def logged(self) -> dict[str, np.ndarray]:
        """What was logged until now, by name; to be read, and valid as long as the log goes on."""

    def taken(self) -> dict[str, np.ndarray]:
        """What was logged, by name, at the end."""


class WholeLog:
    """Arrays for all rows of a run; the system gives memory to those that are filled."""

    def __init__(self, shapes: Shapes, rows: int):
        self.rows = _side_by_side(shapes, rows)
        self.count = 0

    @property
    def at(self) -> int:
        """The row that is filled next."""
        return self.count

    def advance(self, number: int) -> None:
        self.count += number

    def last(self, name: str) -> np.ndarray:
        array = self.rows[name]
        return array[self.count - 1] if self.count else np.zeros(array.shape[1:])

    def logged(self) -> dict[str, np.ndarray]:
        return {name: array[: self.count] for name, array in self.rows.items()}

    def taken(self) -> dict[str, np.ndarray]:
        return {name: _taken(array, self.count) for name, array in self.rows.items()}


class PassedLog:
    """A block of rows that are passed on to somewhere else.

    Args:
        shapes: of one row of every array.
        rows: how many rows there will be at most.
        target: what takes the rows.
    """

    def __init__(self, shapes: Shapes, rows: int, target: MemoryTarget | FolderWriter):
        length = min(rows, AHEAD + OFTEN)
        self.rows = {name: np.zeros((length, *shape)) for name, shape in shapes.items()}
        self._last = {name: np.zeros(shape) for name, shape in shapes.items()}
        self._target = target
        self.at = self.count = 0

    def advance(self, number: int) -> None:
        self.at += number
        self.count += number
        if self.at >= OFTEN:
            self._pass_on()

    def last(self, name: str) -> np.ndarray:
        return self.rows[name][self.at - 1] if self.at else self._last[name]

    def logged(self) -> dict[str, np.ndarray]:
        self._pass_on()
        return self._target.logged()

    def taken(self) -> dict[str, np.ndarray]:
        self._pass_on()
        return self._target.taken()

    def _pass_on(self) -> None:
        """Hand on the rows that were filled; the next ones are filled in their place."""
        if self.at:
            rows = {name: array[: self.at] for name, array in self.rows.items()}
            self._target.put(self.count - self.at, rows)
            self._last = {name: array[self.at - 1].copy() for name, array in self.rows.items()}
            self.at = 0


class MemoryTarget:
    """Arrays in memory of another precision; the times stay doubles."""

    def __init__(self, shapes: Shapes, rows: int, dtype: str):
        kinds = {name: "float64" if name == "t" else dtype for name in shapes}
        self._arrays = {name: np.empty((rows, *shape), kinds[name]) for name, shape in shapes.items()}
        self._count = 0

    def put(self, first: int, rows: Mapping[str, np.ndarray]) -> None:
        """Take rows of every array from a number on; once more if an interrupt came meanwhile."""
        end = first + len(next(iter(rows.values())))
        for name, part in rows.items():
            self._arrays[name][first:end] = part
        self._count = end

    def logged(self) -> dict[str, np.ndarray]:
        """What has come until now."""
        return {name: array[: self._count] for name, array in self._arrays.items()}

    def taken(self) -> dict[str, np.ndarray]:
        """What has come, at the end."""
        return {name: _taken(array, self._count) for name, array in self._arrays.items()}


def make_log(shapes: Shapes, rows: int, kept: Keeping) -> Log:
    """A log of at most so many rows."""
    if kept.whole:
        return WholeLog(shapes, rows)
    if kept.folder is None:
        return PassedLog(shapes, rows, MemoryTarget(shapes, rows, kept.dtype))
    return PassedLog(shapes, rows, FolderWriter(kept.folder, shapes, kept.dtype))


def _side_by_side(shapes: Shapes, rows: int) -> dict[str, np.ndarray]:
    """Arrays in few pieces of memory, which come in large pages, and are used again if they are freed."""
    found: dict[str, np.ndarray] = {}
    for names in _pieces({name: rows * math.prod(shape) for name, shape in shapes.items()}):
        ends = np.cumsum([rows * math.prod(shapes[name]) for name in names])
        parts = np.split(np.empty(ends[-1]), ends[:-1])
        found |= {name: part.reshape(rows, *shapes[name]) for name, part in zip(names, parts, strict=True)}
    return found


def _pieces(sizes: Mapping[str, int]) -> list[list[str]]:
    """Names one after another, such that no piece of several is larger than `PIECE`."""
    pieces: list[list[str]] = []
    room = 0
    for name, size in sizes.items():
        if size > room:
            pieces.append([])
            room = PIECE
        pieces[-1].append(name)
        room -= size
    return pieces


def _taken(array: np.ndarray, count: int) -> np.ndarray:
    """The rows that were logged; a copy only where the array is not all of that."""
    return np.ascontiguousarray(array) if count == len(array) else array[:count].copy()
