"""What a cell file would say several times it says once, under a name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

#: keys of motions and paths that may be said by name, and the table in which they then stand
SHARED = {"body": "motions", "frame": "motions", "desired": "motions", "path": "paths"}


def with_names(data: dict[str, Any]) -> dict[str, Any]:
    """Data of a cell file in which equal motions of bodies, and equal paths, are one with a name.

    Args:
        data: of a file that has no names yet.
    """
    counts = Counter(repr(value) for key, value in _tables(data) if key in SHARED)
    return _Names(counts).of(data)


def _tables(data: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """All tables in some data, each with its key."""
    if isinstance(data, list):
        for each in data:
            yield from _tables(each)
    elif isinstance(data, dict):
        for key, value in data.items():
            if isinstance(value, dict):
                yield key, value
            yield from _tables(value)


class _Names:
    """Names of what is there more than once."""

    def __init__(self, counts: Counter[str]):
        self._counts = counts
        self._names: dict[str, str] = {}
        self._tables: dict[str, dict[str, Any]] = {"paths": {}, "motions": {}}

    def of(self, data: dict[str, Any]) -> dict[str, Any]:
        """The data with names, and with the tables of these before the robots."""
        said = {key: self._value("", value) for key, value in data.items()}
        named = {table: entries for table, entries in self._tables.items() if entries}
        head = {key: value for key, value in said.items() if not isinstance(value, (dict, list))}
        return {**head, **named, **{key: value for key, value in said.items() if key not in head}}

    def _value(self, key: str, value: Any) -> Any:
        if isinstance(value, list):
            return [self._value("", each) for each in value]
        if not isinstance(value, dict):
            return value
        if key in SHARED and self._counts[repr(value)] > 1:
            return self._name(key, value)
        return {inner: self._value(inner, each) for inner, each in value.items()}

    def _name(self, key: str, value: dict[str, Any]) -> str:
        told = repr(value)
        if told not in self._names:
            table = self._tables[SHARED[key]]
            taken = sum(name.partition("-")[0] == key for name in table)
            self._names[told] = name = f"{key}-{taken + 1}" if taken else key
            table[name] = {inner: self._value(inner, each) for inner, each in value.items()}
        return self._names[told]
