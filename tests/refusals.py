"""What an error carries, in the words of a test: its kind, what it is about, and the rest of its data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def refused(
    kind: type[BaseException] | tuple[type[BaseException], ...], subject: str | None = None, **data: Any
) -> Iterator[pytest.ExceptionInfo]:
    """A block that is refused by an error of this kind.

    Args:
        kind: of the error.
        subject: what the error has to be about; None where it is about no part alone.
        data: further attributes that it has to have.
    """
    with pytest.raises(kind) as caught:
        yield caught
    found = {name: getattr(caught.value, name) for name in ("subject", *data)}
    assert found == {"subject": subject, **data}, caught.value
