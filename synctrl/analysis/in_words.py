"""Reports that a console shows as what they say."""

from __future__ import annotations


class InWords:
    """A report whose `repr` is its text: the arrays behind it would fill screens."""

    def __repr__(self) -> str:
        return str(self)


def units_in_words(unit: str) -> str:
    """A unit behind a number; several, where numbers in different units are compared, in brackets."""
    return f"({unit})" if ", " in unit else unit
