"""Where things stand in a TOML file: the line of every key, found by tree-sitter."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import tree_sitter_toml
from tree_sitter import Language, Node, Parser

from .problems import Place

_KEYS = ("bare_key", "quoted_key", "dotted_key")
_PUNCTUATION = ("[", "]", ",", "comment", "[[", "]]", "{", "}", "=")


def lines_of(text: str) -> dict[Place, int]:
    """The line, counted from 1, of every table, key and entry of an array.

    Args:
        text: a TOML document without errors.
    """
    tree = Parser(Language(tree_sitter_toml.language())).parse(text.encode())
    found: dict[Place, int] = {(): 1}
    counts: dict[Place, int] = {}
    for node in tree.root_node.children:
        for place, line in _of_top(node, counts):
            found.setdefault(place, line)
    return found


def nearest(lines: Mapping[Place, int], place: Place) -> int:
    """The line of a place, or of what it lies in."""
    while place not in lines:
        place = place[:-1]
    return lines[place]


def _of_top(node: Node, counts: dict[Place, int]) -> Iterator[tuple[Place, int]]:
    """Places in a pair or a table at the top of a file."""
    if node.type == "pair":
        yield from _of_pair(node, ())
    elif node.type in ("table", "table_array_element"):
        key = next(child for child in node.children if child.type in _KEYS)
        place = _counted(_steps(key), counts)
        if node.type == "table_array_element":
            counts[place] = counts.get(place, -1) + 1
            yield place, _line(node)
            place = (*place, counts[place])
        yield from _above(place, _line(node))
        for child in node.children:
            if child.type == "pair":
                yield from _of_pair(child, place)


def _of_pair(node: Node, above: Place) -> Iterator[tuple[Place, int]]:
    key, *_, value = (child for child in node.children if child.type != "comment")
    steps = _steps(key)
    for k in range(1, len(steps) + 1):
        yield (*above, *steps[:k]), _line(key)
    yield from _of_value(value, (*above, *steps))


def _of_value(node: Node, place: Place) -> Iterator[tuple[Place, int]]:
    """Places in an array or in a table on one line."""
    if node.type == "inline_table":
        for child in node.children:
            if child.type == "pair":
                yield from _of_pair(child, place)
    elif node.type == "array":
        entries = (child for child in node.children if child.type not in _PUNCTUATION)
        for k, child in enumerate(entries):
            yield (*place, k), _line(child)
            yield from _of_value(child, (*place, k))


def _above(place: Place, line: int) -> Iterator[tuple[Place, int]]:
    """A place and all those that it lies in, of which the lines may not be known yet."""
    for k in range(len(place), 0, -1):
        yield place[:k], line


def _counted(steps: Place, counts: Mapping[Place, int]) -> Place:
    """Keys of a header as a place: below an array of tables they mean its last one."""
    place: Place = ()
    for k, step in enumerate(steps):
        place = (*place, step)
        if place in counts and k < len(steps) - 1:
            place = (*place, counts[place])
    return place


def _steps(key: Node) -> Place:
    """The keys of a dotted key, without quotes."""
    if key.type == "dotted_key":
        return tuple(step for child in key.children if child.type in _KEYS for step in _steps(child))
    text = (key.text or b"").decode()
    if key.type == "bare_key":
        return (text,)

    quoted: dict[str, Any] = tomllib.loads(f"{text} = 0")
    return tuple(quoted)


def _line(node: Node) -> int:
    return node.start_point[0] + 1
