"""Processes that share the work of a page."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

Report = tuple[str, float, float]
"""How far a run is: its name, its time and its duration, s."""
#: tells the parent how far a run is; set when a process starts, for it cannot be handed over with a run
_report: Any = None


class Processes:
    """Processes to which work is given; each piece of it begins in the order in which it was given.

    Args:
        pool: the processes.
        events: what they report.
    """

    def __init__(self, pool: ProcessPoolExecutor, events: Any):
        self._pool, self._events = pool, events

    def submit(self, function: Callable, *arguments: Any, **options: Any) -> Future:
        """Let one of them call a function, which like its arguments has to travel between processes."""
        return self._pool.submit(function, *arguments, **options)

    def reports(self) -> Iterator[Report]:
        """What has been reported since."""
        while not self._events.empty():
            yield self._events.get()


@contextmanager
def processes(count: int) -> Iterator[Processes]:
    """So many processes. Where something goes wrong, or who waits is interrupted, nothing more begins."""
    context = get_context("spawn")
    events = context.SimpleQueue()
    with ProcessPoolExecutor(count, context, initializer=_start, initargs=(events.put,)) as pool:
        try:
            yield Processes(pool, events)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def report(name: str, t: float, duration: float) -> None:
    """Tell the parent how far a run is; in one of the processes."""
    _report((name, t, duration))


def _start(put: Callable) -> None:
    """Prepare a process: it reports to its parent, which alone answers to an interrupt."""
    global _report
    _report = put
    signal.signal(signal.SIGINT, signal.SIG_IGN)
