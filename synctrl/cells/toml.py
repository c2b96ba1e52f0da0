"""TOML of plain data: numbers as Python writes them, which read back to the same bits."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

#: columns of a line, as far as values allow
WIDTH = 110
_BARE = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def document(data: Mapping[str, Any]) -> str:
    """Plain data as a TOML document."""
    return "\n".join(_table(data, ())).lstrip("\n") + "\n"


def _table(data: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """Lines of a table: first what fits on lines, then tables below it."""
    below = {key: value for key, value in data.items() if _has_own_lines(key, value)}
    for key, value in data.items():
        if key not in below:
            yield from _pair(key, value)
    for key, value in below.items():
        name = ".".join(map(_key, (*path, key)))
        header, rows = ("[{}]", [value]) if isinstance(value, Mapping) else ("[[{}]]", value)
        for row in rows:
            lines = [*_table(row, (*path, key))]
            is_said = not isinstance(value, Mapping) or not lines or bool(lines[0])
            yield from ("", header.format(name)) if is_said else ()
            yield from lines


def _has_own_lines(key: str, value: Any) -> bool:
    """Whether a value is better written below a header of its own."""
    if isinstance(value, Mapping):
        return len(f"{key} = {_inline(value)}") > WIDTH or any(map(_is_deep, value.values()))
    is_tables = isinstance(value, Sequence) and not isinstance(value, str) and len(value) > 0
    return is_tables and all(isinstance(each, Mapping) for each in value)


def _is_deep(value: Any) -> bool:
    return isinstance(value, Mapping) and any(isinstance(each, Mapping) for each in value.values())


def _pair(key: str, value: Any) -> Iterator[str]:
    line = f"{_key(key)} = {_inline(value)}"
    if len(line) <= WIDTH or not isinstance(value, Sequence) or isinstance(value, str):
        yield line
        return
    yield f"{_key(key)} = ["
    yield from _wrapped([_inline(each) for each in value])
    yield "]"


def _wrapped(items: Sequence[str]) -> Iterator[str]:
    line = "   "
    for item in items:
        if len(line) + len(item) + 2 > WIDTH and line.strip():
            yield line
            line = "   "
        line += f" {item},"
    yield line


def _inline(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return f'"{"".join(map(_letter, value))}"'
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{_key(key)} = {_inline(each)}" for key, each in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    return f"[{', '.join(map(_inline, value))}]"


def _letter(letter: str) -> str:
    if letter in _ESCAPES:
        return _ESCAPES[letter]
    return f"\\u{ord(letter):04x}" if ord(letter) < 32 or ord(letter) == 127 else letter


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _inline(key)
