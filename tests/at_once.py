"""The same work in one thread and in several that take turns as often as the interpreter can."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Barrier
from typing import Any

import numpy as np

#: s, after which the interpreter lets another thread go on; by default it is 5 ms
TURN = 1e-6

Work = Callable[[int], Sequence[Any]]
"""The number of a piece of work -> the arrays it makes."""


@contextmanager
def short_turns() -> Iterator[None]:
    """Threads interrupt each other every few instructions."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def at_once(work: Work, count: int, threads: int = 4) -> list[list[bytes]]:
    """What the pieces of some work make, in threads that all start together."""
    start = Barrier(threads)

    def share(thread: int) -> dict[int, list[bytes]]:
        start.wait()
        return {k: _bytes(work(k)) for k in range(thread, count, threads)}

    with short_turns(), ThreadPoolExecutor(threads) as pool:
        made = {k: piece for part in pool.map(share, range(threads)) for k, piece in part.items()}
    return [made[k] for k in range(count)]


def one_by_one(work: Work, count: int) -> list[list[bytes]]:
    """What the pieces of some work make in this thread."""
    return [_bytes(work(k)) for k in range(count)]


def differing(make: Callable[[], Work], count: int, threads: int = 4) -> list[int]:
    """Numbers of the pieces that threads make otherwise, by a bit or more.

    Each time the work starts afresh, so that what is made at first use is made by the threads, too.
    """
    found, expected = at_once(make(), count, threads), one_by_one(make(), count)
    return [k for k in range(count) if found[k] != expected[k]]


def _bytes(arrays: Sequence[Any]) -> list[bytes]:
    return [np.asarray(array, dtype=float).tobytes() for array in arrays]
