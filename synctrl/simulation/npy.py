"""Arrays as .npy files have them, in one form of header: matched with it, and not evaluated."""

from __future__ import annotations

import re
from math import prod
from typing import IO, Any, NamedTuple

import numpy as np

from ..errors import ResultError

#: bytes that are read at a time
CHUNK = 2**20
MAGIC = b"\x93NUMPY\x01\x00"
_HEADER = re.compile(
    rb"\{'descr': '([<>])([fU])(\d{1,10})', 'fortran_order': (True|False), "
    rb"'shape': \(((?:\d{1,19}, )*(?:\d{1,19},?)?)\), \} *\n"
)
#: bytes before the numbers of a file that grows: enough for the header of any shape, and a multiple of 64
LENGTH = 256


class Header(NamedTuple):
    """What an .npy entry says of its array; all of it is there."""

    dtype: np.dtype
    order: Any
    shape: tuple[int, ...]


def read_header(stream: IO[bytes], name: str, file_size: int, widths: tuple[str, ...] = ("8",)) -> Header:
    """The header of an .npy file or entry, in the only form in which numpy writes the arrays of a result.

    Args:
        stream: of the file, from its beginning.
        name: what messages call it.
        file_size: bytes.
        widths: bytes that a number may have.

    Raises:
        ResultError: another header, or a file of another size than it says.
    """
    start = stream.read(len(MAGIC) + 2)
    length = int.from_bytes(start[len(MAGIC) :], "little")
    found = _HEADER.fullmatch(stream.read(length))
    if not start.startswith(MAGIC) or found is None:
        raise ResultError("expected an array of numbers or a text", subject=f"{name!a}")
    byte_order, kind, width, fortran, lengths = (part.decode("ascii") for part in found.groups())
    shape = tuple(int(k) for k in lengths.replace(",", " ").split())
    if kind == "f" and width not in widths:
        raise ResultError(f"expected float64, found float{8 * int(width)}", subject=f"{name!a}")
    size = int(width) * (4 if kind == "U" else 1) * prod(shape)
    if len(start) + length + size != file_size:
        raise ResultError.expected(
            f"{size} bytes of an array of shape {shape}",
            file_size - length - len(start),
            f"{name!a}",
        )
    return Header(np.dtype(f"{byte_order}{kind}{width}"), "F" if fortran == "True" else "C", shape)


def read_numbers(stream: IO[bytes], header: Header) -> np.ndarray:
    """The numbers, or the text, behind a header.

    Raises:
        EOFError: they end too early.
    """
    array: np.ndarray = np.empty(header.shape, header.dtype, header.order)
    left = memoryview(array.reshape(-1, order=header.order).view(np.uint8))  # type: ignore[arg-type]
    while left:
        read = stream.readinto(left[:CHUNK])  # type: ignore[attr-defined]
        if not read:
            raise EOFError("an array ends too early")
        left = left[read:]
    return array


def written_header(code: str, shape: tuple[int, ...]) -> bytes:
    """A header of `LENGTH` bytes, for rows of numbers of a kind such as "<f8"."""
    start = MAGIC + (LENGTH - len(MAGIC) - 2).to_bytes(2, "little")
    text = f"{{'descr': '{code}', 'fortran_order': False, 'shape': {shape}, }}".encode("ascii")
    return start + text.ljust(LENGTH - len(start) - 1) + b"\n"
