"""What goes over the wire: the message of a robot, as bytes that are the same on every machine.

All numbers are little endian, one after another:

    4 bytes  "sync"             1 byte   version, 1          1 byte   rows of W, w, w' that follow
    2 bytes  m                  4 bytes  sender              8 bytes  stamp, a float, s
    8 bytes  each of the rows m numbers, floats              4 bytes  CRC-32 of all before
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...checks import count, finite_array, finite_number, instance
from ...errors import InputError

MARK, VERSION = b"sync", 1
_HEAD, _CHECK = struct.Struct("<4sBBHId"), struct.Struct("<I")
#: the most rows, coordinates and robots that a message can tell of
ROWS, COORDINATES, ROBOTS = 3, 2**16 - 1, 2**32 - 1


@dataclass(frozen=True, eq=False)
class Message:
    """What a robot tells of its own errors.

    Args:
        sender: which robot, counted from 0.
        stamp: when it was so, s.
        rows: W, w and w', or the first of them, (1 to 3, m).

    Raises:
        InputError: numbers that are not finite, or are none of a robot, or another shape.
    """

    sender: int
    stamp: float
    rows: np.ndarray

    def __post_init__(self) -> None:
        rows = finite_array("message, rows", self.rows, (None, None)).copy()
        if not (1 <= rows.shape[0] <= ROWS and 1 <= rows.shape[1] <= COORDINATES):
            raise InputError.expected("1 to 3 rows of at least one number", rows.shape, "message, rows")
        sender = count("message, sender", self.sender, least=0)
        if sender > ROBOTS:
            raise InputError.expected(f"a robot up to {ROBOTS}", sender, "message, sender")
        rows.flags.writeable = False
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "sender", sender)
        object.__setattr__(self, "stamp", finite_number("message, stamp", self.stamp))

    def to_bytes(self) -> bytes:
        """This message for a wire; the head of the module has the layout."""
        r, m = self.rows.shape
        body = _HEAD.pack(MARK, VERSION, r, m, self.sender, self.stamp) + self.rows.astype("<f8").tobytes()
        return body + _CHECK.pack(zlib.crc32(body))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The message that `to_bytes` made bytes of.

        Raises:
            InputError: no bytes, or not those of a whole and unharmed message of this version.
        """
        instance("message", data, (bytes, bytearray, memoryview), "bytes")
        data = bytes(data)
        if len(data) < _HEAD.size + _CHECK.size:
            raise InputError.expected(f"at least {_HEAD.size + _CHECK.size} bytes", len(data), "message")
        mark, version, r, m, sender, stamp = _HEAD.unpack_from(data)
        if (mark, version) != (MARK, VERSION):
            raise InputError.expected(f"the mark {MARK!r} and version {VERSION}", (mark, version), "message")
        end = _HEAD.size + 8 * r * m
        if len(data) != end + _CHECK.size:
            raise InputError.expected(f"{end + _CHECK.size} bytes for {r} rows of {m}", len(data), "message")
        if _CHECK.unpack_from(data, end)[0] != zlib.crc32(data[:end]):
            raise InputError("expected bytes that fit their CRC-32, found harmed ones", subject="message")
        return cls(sender, stamp, np.frombuffer(data, "<f8", r * m, _HEAD.size).reshape(r, m))
