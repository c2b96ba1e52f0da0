"""Reports that a console shows as what they say."""

from __future__ import annotations


class InWords:
    """A report whose `repr` is its text: the arrays behind it would fill screens."""

    def __repr__(self) -> str:
        return str(self)
