"""Processes that write to one path, while others read it: used by short and long tests."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from synctrl import Result
from synctrl.files import write_whole


def versions(size: int) -> list[bytes]:
    """Contents that can be told apart, each so long that it takes several writes."""
    return [bytes([letter]) * size for letter in b"abc"]


def write_often(path: Path, content: bytes, times: int) -> list[str]:
    """Write something many times; returns what went wrong."""
    return _often(lambda: write_whole(path, content), times)


def save_often(path: Path, result: Result, times: int) -> list[str]:
    """Save a result many times; returns what went wrong."""
    return _often(lambda: result.save(path), times)


def read_often(path: Path, read: Callable[[Path], object], known: list, times: int) -> list[str]:
    """Read many times; returns what was none of the known contents."""
    return _often(lambda: _known(read(path), known), times)


def at_once(*jobs: Callable[[], list[str]]) -> list[str]:
    """Each job in a process of its own, all at the same time; what went wrong in any of them."""
    with ProcessPoolExecutor(len(jobs), get_context("spawn")) as pool:
        return [fault for job in [pool.submit(job) for job in jobs] for fault in job.result()]


def _often(act: Callable[[], object], times: int) -> list[str]:
    faults = []
    for _ in range(times):
        try:
            act()
        except Exception as error:
            faults.append(f"{type(error).__name__}: {error}")
    return faults


def _known(found: object, known: list) -> None:
    if not any(found == each for each in known):
        raise ValueError(f"neither of the {len(known)} contents: {found!r:.100}")
