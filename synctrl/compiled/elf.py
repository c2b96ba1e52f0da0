"""Whether a shared library of Linux is whole.

The system's loader believes the headers of a file; where they promise more than there is, the process dies.
"""

from __future__ import annotations

import struct
from typing import NamedTuple


class _Layout(NamedTuple):
    """Where numbers stand in the headers of 32 or 64 bits: formats and offsets."""

    size: int
    tables: tuple[str, int]
    counts: tuple[str, int]
    segment: str


_LAYOUTS = {
    1: _Layout(52, ("II", 28), ("4H", 42), "II8xI"),
    2: _Layout(64, ("QQ", 32), ("4H", 54), "I4xQ16xQ"),
}
_ORDERS = {1: "<", 2: ">"}
#: segments of this type are mapped into memory
_LOAD = 1


def is_whole(content: bytes) -> bool:
    """Whether a file in ELF format has every part that its headers speak of.

    Args:
        content: of the file.
    """
    if len(content) < 6 or content[:4] != b"\x7fELF":
        return False
    layout, order = _LAYOUTS.get(content[4]), _ORDERS.get(content[5])
    if layout is None or order is None or len(content) < layout.size:
        return False
    segments, sections = struct.unpack_from(order + layout.tables[0], content, layout.tables[1])
    size, count, section_size, section_count = struct.unpack_from(
        order + layout.counts[0], content, layout.counts[1]
    )
    ends = [segments + size * count, sections + section_size * section_count]
    if max(ends) > len(content) or size < struct.calcsize(order + layout.segment):
        return False
    for k in range(count):
        kind, start, length = struct.unpack_from(order + layout.segment, content, segments + k * size)
        if kind == _LOAD:
            ends.append(start + length)
    return max(ends) <= len(content)
