"""What plain data from outside must look like: rules that read like the data they describe.

A rule is called with the place, the value there and the lengths that names such as "robot" stand for; it
raises a ResultError that says what is expected at that place and what is found.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, NoReturn, TypeAlias

from ..checks import LONGEST_LABEL, unprintable
from ..errors import ResultError

Sizes: TypeAlias = Mapping[str, int]
Rule: TypeAlias = Callable[[str, Any, Sizes], None]

#: how deep data may be nested, and the first whole number that is too large
DEEPEST, TOO_LARGE = 20, 2**63
#: characters
LONGEST_TEXT = 100_000


def read_json(text: str) -> Any:
    """Data in a JSON text, no key in it twice, not too deep, and its numbers not too large.

    Raises:
        ResultError: another text.
    """
    try:
        data = json.loads(text, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        raise ResultError(f"expected JSON, found {error}", subject="info") from None
    anything("info", data, {})
    return data


def anything(where: str, value: Any, sizes: Sizes, depth: int = 0) -> None:
    """Any plain data."""
    if depth > DEEPEST:
        _refuse(where, f"at most {DEEPEST} levels", value)
    if isinstance(value, dict):
        for key, entry in value.items():
            anything(f"{where}, {ascii(key)[1:-1]:.40}" if depth < 3 else where, entry, sizes, depth + 1)
    elif isinstance(value, list):
        for entry in value:
            anything(where, entry, sizes, depth + 1)
    elif isinstance(value, int) and not -TOO_LARGE < value < TOO_LARGE:
        _refuse(where, "numbers below 2^63", hex(value))


def text(where: str, value: Any, sizes: Sizes) -> None:
    """A text of one or more lines, for people."""
    if not isinstance(value, str):
        _refuse(where, "a text", value)
    if len(value) > LONGEST_TEXT or unprintable(value.replace("\n", " ").replace("\t", " ")):
        _refuse(where, f"up to {LONGEST_TEXT} characters that can be shown", value)


def label(where: str, value: Any, sizes: Sizes) -> None:
    """A name or a unit: a text of one line."""
    if not isinstance(value, str) or len(value) > LONGEST_LABEL or unprintable(value):
        _refuse(where, f"one line of up to {LONGEST_LABEL} characters", value)


def boolean(where: str, value: Any, sizes: Sizes) -> None:
    """True or false."""
    if not isinstance(value, bool):
        _refuse(where, "true or false", value)


def nothing(where: str, value: Any, sizes: Sizes) -> None:
    """Null."""
    if value is not None:
        _refuse(where, "null", value)


def number(where: str, value: Any, sizes: Sizes) -> None:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
        _refuse(where, "a finite number", value)


def numbers(where: str, value: Any, sizes: Sizes) -> None:
    """A finite number, or a list of such or of lists of such."""
    if isinstance(value, list):
        for k, entry in enumerate(value):
            numbers(f"{where}[{k}]", entry, sizes)
    else:
        number(where, value, sizes)


def whole(least: int = 0, below: str | None = None) -> Rule:
    """A whole number of at least `least`, and below the length that `below` names."""

    def rule(where: str, value: Any, sizes: Sizes) -> None:
        if type(value) is not int or value < least:
            _refuse(where, f"a whole number of at least {least}", value)
        if below is not None and value >= sizes[below]:
            _refuse(where, f"the number of a {below}, from 0 to {sizes[below] - 1}", value)

    return rule


def above(low: float, or_equal: bool = False) -> Rule:
    """A finite number above `low`."""

    def rule(where: str, value: Any, sizes: Sizes) -> None:
        number(where, value, sizes)
        if value < low or (value == low and not or_equal):
            _refuse(where, f"a number {'of at least' if or_equal else 'above'} {low:g}", value)

    return rule


def optional(rule: Rule) -> Rule:
    """What a rule asks for, or null."""
    return lambda where, value, sizes: None if value is None else rule(where, value, sizes)


def rows(rule: Rule, count: str | None = None, *, least: int = 0, distinct: bool = False) -> Rule:
    """A list, each entry after a rule; as long as the length that `count` names."""

    def check(where: str, value: Any, sizes: Sizes) -> None:
        if not isinstance(value, list) or len(value) < least:
            _refuse(where, f"a list of at least {least}", value)
        if count is not None and len(value) != sizes[count]:
            _refuse(where, f"{sizes[count]} entries, one per {count}", len(value))
        for k, entry in enumerate(value):
            rule(f"{where}[{k}]", entry, sizes)
        if distinct and len({*value}) < len(value):
            _refuse(where, "entries that differ", value)

    return check


def each(rule: Rule) -> Rule:
    """A dictionary with any keys, each entry after a rule."""

    def check(where: str, value: Any, sizes: Sizes) -> None:
        _is_dictionary(where, value)
        for key, entry in value.items():
            label(f"{where}, name of an entry", key, sizes)
            rule(f"{where}, {key}", entry, sizes)

    return check


def entries(needed: Mapping[str, Rule], known: Mapping[str, Rule] | None = None) -> Rule:
    """A dictionary with entries that are needed and others that follow a rule if they are there.

    What is not known is let through: whoever reads it has to know what it means.
    """

    def check(where: str, value: Any, sizes: Sizes) -> None:
        _is_dictionary(where, value)
        for key, rule in {**needed, **(known or {})}.items():
            if key in value:
                rule(f"{where}, {key}", value[key], sizes)
            elif key in needed:
                _refuse(f"{where}, {key}", "an entry of this name", [*value])

    return check


def _is_dictionary(where: str, value: Any) -> None:
    if not isinstance(value, dict):
        _refuse(where, "entries by name", value)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name that is there twice")
    return found


def _refuse(where: str, expected: str, found: Any) -> NoReturn:
    raise ResultError(f"expected {expected}, found {found!a:.80}", subject=where)
