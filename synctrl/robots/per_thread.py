"""What every thread has one of its own of, such as the memory in which an algorithm leaves its results."""

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
