"""Objects of which every thread has its own, such as the memory in which an algorithm leaves its results.

Robots and forests may be shared among threads, but Pinocchio's algorithms write into a `pin.Data`: two
threads that wrote into the same one would read each other's numbers.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cached_property
from typing import Generic, TypeVar

T = TypeVar("T")


class PerThread(threading.local, Generic[T]):
    """Something that each thread makes when it first asks for it, and that ends with the thread.

    Args:
        make: makes one.
    """

    def __init__(self, make: Callable[[], T]):
        self._make = make

    @cached_property
    def own(self) -> T:
        """The one of the thread that asks."""
        return self._make()
