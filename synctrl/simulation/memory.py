"""Whether the log of a run fits into memory, asked before the run."""

from __future__ import annotations

import mmap
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .clock import Clock

#: bytes of an array that are looked at at a time
PART = 4_000_000
#: largest share of the available memory that a log may take; the rest is for what is made of it
SHARE = 0.8


def check_fits(clock: Clock, row: int) -> None:
    """Refuse a log that needs more than `SHARE` of the available memory.

    Args:
        clock: its instants.
        row: what one of them takes, bytes.

    Raises:
        InputError: with the bytes needed, those available, and the least log_dt that would fit.
    """
    _check_room(clock, row, available_memory(), "memory")


def check_fits_disk(clock: Clock, row: int, folder: Path) -> None:
    """Refuse a log that needs more than `SHARE` of what is free where a folder is to be.

    Raises:
        InputError: see `check_fits`.
    """
    there = next((place for place in folder.parents if place.is_dir()), None)
    _check_room(clock, row, None if there is None else shutil.disk_usage(there).free, "disk")


def _check_room(clock: Clock, row: int, available: int | None, where: str) -> None:
    if available is None or clock.rows * row <= SHARE * available:
        return
    fitting = int(SHARE * available) // row
    advice = "not even its two ends would"
    if fitting > 1:
        advice = f"log_dt={-(-clock.count // (fitting - 1)) * clock.dt:.12g} would"
    raise InputError(
        f"the log of {clock.rows} instants takes {clock.rows * row} bytes, and {available} bytes of "
        f"{where} are available; expected a log that fits into {SHARE:.0%} of them: {advice}",
        subject="log_dt",
    )


def in_parts(array: np.ndarray) -> Iterator[np.ndarray]:
    """An array over time, some instants at a time: what is made of them takes little memory.

    Of an array that is mapped from a file, what was read is let go.
    """
    length = max(1, PART // max(1, array[:1].nbytes))
    for first in range(0, len(array), length):
        yield array[first : first + length]
        let_go(array)


def let_go(array: np.ndarray) -> None:
    """Free the memory that holds what was read of a file, if an array is mapped from one to be read only."""
    mapped = getattr(array, "_mmap", None)
    if mapped is not None and hasattr(mapped, "madvise") and getattr(array, "mode", "") == "r":
        mapped.madvise(mmap.MADV_DONTNEED)


def row_of(array: np.ndarray, *place: int) -> np.ndarray:
    """One number, or row, of an array over time at all instants, in memory."""
    where: Any = (slice(None), *place)
    parts = [part[where].copy() for part in in_parts(array)]
    return np.concatenate(parts) if parts else array[where]


def available_memory() -> int | None:
    """Bytes that this process may still take, or None if the machine does not tell.

    The least of what is free or can be freed, what the control group leaves, and what the limit of the
    process's address space leaves.
    """
    return min((*_of_machine(), *_of_group(), *_of_process()), default=None)


def _of_machine() -> Iterator[int]:
    for line in _read("/proc/meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            yield 1024 * int(line.split()[1])
            return
    if "SC_AVPHYS_PAGES" in os.sysconf_names:
        yield os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _of_group(root: str = "/sys/fs/cgroup") -> Iterator[int]:
    """What control groups (version 2) leave: that of the process and those it lies in."""
    path = next((line[3:] for line in _read("/proc/self/cgroup").splitlines() if line.startswith("0::")), "/")
    for group in (Path(path), *Path(path).parents):
        folder = f"{root}/{group}"
        limit, used = _read(f"{folder}/memory.max").strip(), _read(f"{folder}/memory.current").strip()
        if limit.isdigit() and used.isdigit():
            cached = dict(line.split() for line in _read(f"{folder}/memory.stat").splitlines())
            yield max(int(limit) - int(used) + int(cached.get("inactive_file", 0)), 0)


def _of_process() -> Iterator[int]:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    limit, pages = resource.getrlimit(resource.RLIMIT_AS)[0], _read("/proc/self/statm").split()
    if limit != resource.RLIM_INFINITY and pages:
        yield max(limit - int(pages[0]) * os.sysconf("SC_PAGE_SIZE"), 0)


def _read(path: str) -> str:
    """Content of a file of the system; nothing if it is not there."""
    try:
        return Path(path).read_text(encoding="ascii")
    except (OSError, ValueError):
        return ""
