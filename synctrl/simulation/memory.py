"""Whether the log of a run fits into memory, asked before the run."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError
from .clock import Clock

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
    available = available_memory()
    if available is None or clock.rows * row <= SHARE * available:
        return
    fitting = int(SHARE * available) // row
    advice = "not even its two ends would"
    if fitting > 1:
        advice = f"log_dt={-(-clock.count // (fitting - 1)) * clock.dt:.12g} would"
    raise InputError(
        f"the log of {clock.rows} instants takes {clock.rows * row} bytes, and {available} bytes of "
        f"memory are available; expected a log that fits into {SHARE:.0%} of them: {advice}",
        subject="log_dt",
    )


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
