"""Names as other tools allow them."""

from __future__ import annotations

from collections.abc import Iterable


def identifiers(names: Iterable[str], longest: int = 63) -> list[str]:
    """Names of ASCII letters, digits and underscores, a letter first; no two alike, whatever their case.

    Args:
        names: any texts.
        longest: characters that each may have, at least 10.
    """
    found: dict[str, None] = {}
    lower: set[str] = set()
    for name in names:
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        plain = (plain if plain[:1].isalpha() else f"x{plain}")[:longest]
        stem, number = plain, 1
        while plain.lower() in lower:
            number += 1
            plain = f"{stem[: longest - 1 - len(str(number))]}_{number}"
        found[plain] = None
        lower.add(plain.lower())
    return list(found)
