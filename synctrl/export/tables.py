"""Results as tables: a row for each logged instant, a column for each number."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import instance
from ..files import reported, whole_file
from ..simulation.result import Result
from .needed import needed
from .quantities import Entry, Quantity, quantities

#: rows that are written at a time
ROWS = 1000


def to_pandas(result: Result) -> Any:
    """A `pandas.DataFrame` of a result, see `Result.to_pandas`.

    Its index is the time, s. Its columns have three levels: quantity, what it belongs to, and coordinate or
    joint. `attrs` has the title and the status, and by quantity "units", "long_names" and "equations".

    Raises:
        MissingDependencyError: pandas is not installed.
    """
    pandas = needed("a pandas table", "pandas")
    found = quantities(result)
    columns = [(each.name, entry.row, entry.column) for each in found for entry in each.entries]
    table = pandas.DataFrame(
        _rows(found, slice(None)),
        index=pandas.Index(np.array(result.t), name="time"),
        columns=pandas.MultiIndex.from_tuples(columns, names=["quantity", "of", "coordinate"]),
    )
    table.attrs = {
        "title": str(result.info["title"]),
        "status": result.status,
        "units": {each.name: each.unit for each in found},
        "long_names": {each.name: each.long_name for each in found},
        "equations": {each.name: each.equation for each in found if each.equation},
    }
    return table


def to_csv(result: Result, path: str | Path) -> Path:
    """Write a result as comma-separated values in UTF-8, see `Result.to_csv`.

    The first column is the time. What has no value, NaN, is an empty field.

    Raises:
        ResultError: the file cannot be written.
    """
    instance("path", path, (str, Path), "a path")
    found = quantities(result)
    with reported("write the table", path), whole_file(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", errors="replace", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["time [s]", *(column_name(each, entry) for each, entry in _columns(found))])
        for rows in _parts(len(result.t)):
            writer.writerows(_fields(np.hstack([result.t[rows, None], _rows(found, rows)])))
        text.detach()
    return Path(path)


def column_name(quantity: Quantity, entry: Entry) -> str:
    """What a column is called: `tau/robot 1/joint2 [N·m]`; slashes in names are shown as others."""
    words = (word.replace("/", "∕") for word in (quantity.name, entry.row, entry.column) if word)
    return f"{'/'.join(words)} [{entry.unit}]"


def _columns(found: Sequence[Quantity]) -> Iterator[tuple[Quantity, Entry]]:
    return ((each, entry) for each in found for entry in each.entries)


def _rows(found: Sequence[Quantity], rows: slice) -> np.ndarray:
    return np.hstack([each.flat(rows) for each in found])


def _parts(count: int) -> Iterator[slice]:
    return (slice(start, start + ROWS) for start in range(0, count, ROWS))


def _fields(numbers: np.ndarray) -> list[list[Any]]:
    rows: list[list[Any]] = numbers.tolist()
    if not np.isnan(numbers).any():
        return rows
    return [["" if value != value else value for value in row] for row in rows]
