"""What an error carries, in the words of a test: its kind, what it is about, and the rest of its data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def refused(
    kind: type[BaseException] | tuple[type[BaseException], ...], *subject: str | None, **data: Any
) -> Iterator[pytest.ExceptionInfo]:
    """A block that is refused by an error of this kind.

    Args:
        kind: of the error.
        subject: what the error has to be about, if that is said.
        data: further attributes that it has to have.
    """
    with pytest.raises(kind) as caught:
        yield caught
    expected = {**dict(zip(("subject",), subject, strict=False)), **data}
    found = {name: getattr(caught.value, name) for name in expected}
    assert found == expected, caught.value
