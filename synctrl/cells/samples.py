"""A desired motion from the samples of a CSV file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..tasks.splines import Spline


def samples(file: Path, ends: str = "free") -> Spline:
    """The motion through the samples of a CSV file.

    Args:
        file: CSV, a line for each sample: time, s, then coordinates; a first line of names, none of which is
            a number, is passed over, and so is a byte order mark.
        ends: "rest" begins and ends at rest, and holds the first and last point; "free" leaves the ends to
            the points, at least six of them, and has no motion outside of the times.

    Raises:
        InputError: no such file, or a line that is no list of numbers, as many as in the lines before.
    """
    try:
        lines = file.read_text("utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "something else"
        raise InputError(f"expected a CSV file, found: {reason}", subject="file", found=file.name) from None
    rows = [(number, line.split(",")) for number, line in enumerate(lines, 1) if line.strip()]
    named = bool(rows) and not any(_numbers([text]) for text in rows[0][1])
    table = _table(file.name, rows[named:])
    return Spline(table[:, 0], table[:, 1:], ends)


def _table(name: str, rows: list[tuple[int, list[str]]]) -> np.ndarray:
    """Times and coordinates, (k, 1 + m)."""
    found: list[list[float]] = []
    for number, row in rows:
        values = _numbers(row)
        if values is None or len(values) < 2 or len(values) != len(rows[0][1]):
            count = max(len(rows[0][1]), 2)
            what = f"{count} numbers, a time and coordinates, in line {number} of {name}"
            raise InputError.expected(what, ",".join(row), "file")
        found.append(values)
    return np.array(found).reshape(len(found), -1) if found else np.zeros((0, 2))


def _numbers(row: list[str]) -> list[float] | None:
    try:
        return [float(text) for text in row]
    except ValueError:
        return None
