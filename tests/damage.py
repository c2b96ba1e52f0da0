"""Result files that somebody has damaged, by chance or on purpose: used by short and long tests."""

from __future__ import annotations

import io
import json
import struct
import warnings
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

HOSTILE_HEADERS = [
    "(",
    "{[]: 1}",
    "",
    "{",
    "{'descr': '<f8'}",
    "{'descr': '|O', 'fortran_order': False, 'shape': (3,), }",
    "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }",
    "{'descr': '<f8', 'fortran_order': 7, 'shape': (3,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (9223372036854775807, 2), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (1.5,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (True,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': 3, }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (" + "9" * 5000 + ",), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (" + "1, " * 5000 + "), }",
    "{'descr': '<U9999999999', 'fortran_order': False, 'shape': (), }",
    "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (3,), }",
    "(" * 2000,
    "-" * 60_000 + "1",
    "__import__('os').system('true')",
    "\x00" * 118,
    "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }" + "\n" * 9,
]

HOSTILE_VALUES: list[Any] = [
    None, True, 0, -1, 1, 3, 99_999, 2**31, 2**63, 2**64 - 1, 10**400, 0.5, -0.5, 1e300, -1e300, float("nan"),
    float("inf"), "", "x", "robot 1", "<script>alert(1)</script>", "$\\frac{", "\ud800", "\x00", "two\nlines",
    "\u202e", "é" * 5000, [], [[]], {}, [0], [0, 0], [0, 1], [[0, 1]], [1e300], ["x"], [None],
    {"robot": 0}, {"x": []}, {"robot": 99},
]  # fmt: skip

HOSTILE_NUMBERS = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e154, 1e31, 1e12, 0.0, -1.0, 5e-324, 1e5]


def members(data: bytes) -> dict[str, bytes]:
    """What is in an archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def archive_of(contents: list[tuple[str, bytes]]) -> bytes:
    """An archive whose entries are read without complaint, whatever they are."""
    file = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(file, "w") as archive:
        warnings.simplefilter("ignore")  # a name given twice is meant
        for name, content in contents:
            archive.writestr(name, content)
    return file.getvalue()


def with_header(header: str, body: bytes = b"", version: int = 1) -> bytes:
    """An .npy entry with any header."""
    text = header.encode("latin1")
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + length + text + body


def npy(array: np.ndarray) -> bytes:
    """An array as an .npy entry."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def array_of(entry: bytes) -> np.ndarray:
    """The array of an .npy entry."""
    return np.load(io.BytesIO(entry))


def info_of(entry: bytes) -> dict[str, Any]:
    """The info in an .npy entry."""
    return json.loads(str(array_of(entry)))


def places(data: Any, where: tuple = ()) -> list[tuple]:
    """Paths to everything in plain data."""
    found = [where] if where else []
    entries = dict(enumerate(data)) if isinstance(data, list) else data
    for key, part in entries.items() if isinstance(entries, dict) else ():
        found += places(part, (*where, key))
    return found


def put(data: Any, where: tuple, change: Callable[[Any, Any], None]) -> None:
    """Change a container inside plain data at a path."""
    *above, key = where
    for step in above:
        data = data[step]
    change(data, key)


# -- kinds of damage: functions of a generator and a whole file -------------------------------------------


def flip(rng: np.random.Generator, data: bytes) -> bytes:
    """Bits that fell over, in the whole file or where the names and headers are."""
    spoilt = bytearray(data)
    marks = [k for k in range(len(data)) if data[k : k + 2] == b"PK" or data[k : k + 6] == b"\x93NUMPY"]
    for _ in range(rng.integers(1, 9)):
        near = rng.choice(marks) + rng.integers(0, 130) if rng.random() < 0.7 else rng.integers(len(data))
        spoilt[min(int(near), len(data) - 1)] ^= 1 << rng.integers(8)
    return bytes(spoilt)


def cut(rng: np.random.Generator, data: bytes) -> bytes:
    """The end, the beginning or a part in between is missing."""
    a, b = sorted(int(k) for k in rng.integers(0, len(data) + 1, 2))
    return [data[:a], data[a:], data[:a] + data[b:]][rng.integers(3)]


def another_header(rng: np.random.Generator, data: bytes) -> bytes:
    """An array with a hostile header, in an archive that is whole."""
    found = members(data)
    name = rng.choice([*found])
    header, body = HOSTILE_HEADERS[rng.integers(len(HOSTILE_HEADERS))], found[name][128:]
    found[name] = with_header(header, body if rng.random() < 0.5 else b"", int(rng.integers(1, 4)))
    return archive_of([*found.items()])


def spliced(rng: np.random.Generator, data: bytes) -> bytes:
    """A header with some of its characters exchanged, in an archive that is whole."""
    found = members(data)
    name = rng.choice([*found])
    entry = bytearray(found[name])
    for _ in range(rng.integers(1, 4)):
        entry[rng.integers(0, min(len(entry), 90))] = rng.choice(
            [*b"()[]{}'\",:0123456789<>fUO|-eE \n\x00\xff"]
        )
    found[name] = bytes(entry)
    return archive_of([*found.items()])


def other_members(rng: np.random.Generator, data: bytes) -> bytes:
    """Entries that are missing, there twice, exchanged, renamed, or no arrays."""
    found = [*members(data).items()]
    a, b = (int(k) for k in rng.integers(0, len(found), 2))
    way = rng.integers(6)
    if way == 0:
        del found[a]
    elif way == 1:
        found.append((found[a][0], found[b][1]))
    elif way == 2:
        found[a], found[b] = (found[a][0], found[b][1]), (found[b][0], found[a][1])
    elif way == 3:
        names = ["outputs/more.npy", "outputs/.npy", "../x.npy", "x", "info", "\x01.npy", "é.npy"]
        found[a] = (str(rng.choice(names)), found[a][1])
    elif way == 4:
        found[a] = (found[a][0], rng.bytes(int(rng.integers(0, 300))))
    else:
        found.append(("outputs/more.npy", found[b][1]))
    return archive_of(found)


def other_info(rng: np.random.Generator, data: bytes) -> bytes:
    """One or two entries of info are something else, or gone."""
    found = members(data)
    info = info_of(found["info.npy"])
    for _ in range(rng.integers(1, 3)):
        known = places(info)
        where = known[rng.integers(len(known))]
        if rng.random() < 0.15:
            put(info, where, lambda holder, key: holder.pop(key))
        else:
            value = HOSTILE_VALUES[rng.integers(len(HOSTILE_VALUES))]
            put(info, where, lambda holder, key, value=value: holder.__setitem__(key, value))
    found["info.npy"] = npy(np.array(json.dumps(info)))
    return archive_of([*found.items()])


def other_text(rng: np.random.Generator, data: bytes) -> bytes:
    """Info that is no JSON, or an unusual one."""
    found = members(data)
    text = str(array_of(found["info.npy"]))
    k = int(rng.integers(len(text)))
    texts = [
        text[:k],
        text[:k] + str(rng.choice([*'{}[]",:0123456789eE-'])) + text[k + 1 :],
        text[:-1] + ', "title": "twice"}',
        text[:-1] + ', "deep": ' + "[" * 30 + "]" * 30 + "}",
        "[" * 100_000,
        text[:-1] + ', "large": ' + "9" * 10_000 + "}",
        text[:-1] + ', "more": "\\ud800"}',
    ]
    found["info.npy"] = npy(np.array(texts[rng.integers(len(texts))]))
    return archive_of([*found.items()])


def other_numbers(rng: np.random.Generator, data: bytes) -> bytes:
    """Numbers in an array that no run has, or rows that are missing in all."""
    found = members(data)
    arrays = {name: array_of(entry).copy() for name, entry in found.items() if name != "info.npy"}
    name = str(rng.choice([*arrays, "t.npy", "rows"]))
    if name == "rows":
        left = int(rng.integers(0, 3))
        arrays = {key: array[:left] for key, array in arrays.items()}
    else:
        for _ in range(rng.integers(1, 4)):
            where = tuple(int(rng.integers(k)) for k in arrays[name].shape)
            arrays[name][where] = rng.choice(HOSTILE_NUMBERS)
    return archive_of([("info.npy", found["info.npy"]), *((k, npy(a)) for k, a in arrays.items())])


WAYS = [
    flip, cut, another_header, spliced, other_members, other_info, other_info, other_info, other_text,
    other_numbers, other_numbers,
]  # fmt: skip


def damaged(seed: int, data: bytes) -> tuple[str, bytes]:
    """A damaged version of a file, another one for each seed, and the name of what was done to it."""
    rng = np.random.default_rng(seed)
    way = WAYS[seed % len(WAYS)]
    return way.__name__, way(rng, data)
