"""The rows of a sweep's folder in a few lines: how many ended how, and how large the measures are."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..show.style import display
from ..sweep.measures import MEASURES, Measure
from ..sweep.rows import COMPLETED
from .console import number, table

#: what is said of the values of a measure
SHARES = {"least": 0.0, "5%": 0.05, "median": 0.5, "95%": 0.95, "largest": 1.0}


def read_rows(folder: Path) -> list[dict[str, Any]]:
    """The finished runs of a sweep's folder, each by the names of its columns; none if there is no sweep."""
    about, runs = folder / "sweep.json", folder / "runs.jsonl"
    if not (about.is_file() and runs.is_file()):
        return []
    columns = json.loads(about.read_text("utf-8"))["columns"]
    whole = runs.read_bytes().split(b"\n")[:-1]  # what follows the last end of a line is incomplete
    return [dict(zip(columns, json.loads(line), strict=False)) for line in whole]


def endings(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many runs ended how."""
    return dict(Counter(str(row["status"]) for row in rows))


def causes_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Why runs did not come to their end, the most frequent cause first, and of how many it is said."""
    return dict(Counter(str(row["cause"]) for row in rows if row["status"] != COMPLETED).most_common())


def spreads(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Of every measure, over the runs that came to their end: least, median and largest value, ..."""
    found = {}
    for name in MEASURES:
        values = [row[name] for row in rows if row["status"] == COMPLETED and row.get(name) is not None]
        if values:
            found[name] = {word: float(np.quantile(values, share)) for word, share in SHARES.items()}
    return found


def spread_table(rows: Sequence[Mapping[str, Any]], units: Mapping[str, Measure]) -> Any:
    """The spread of every measure in a table, in units that are read easily."""
    made = []
    for name, values in spreads(rows).items():
        unit, factor = display(units[name].unit)
        cells = [number(factor * value) for value in values.values()]
        made.append([name, "" if unit == "1" else unit, *cells])
    return table("Measures of runs that came to their end", ("", "", *SHARES), made, left=2)


def best_table(title: str, rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Any:
    """Some runs with the values of their factors and some measures, in SI units."""
    return table(
        title, ("run", *names), [[row["run"], *(_cell(row.get(name)) for name in names)] for row in rows]
    )


def _cell(value: Any) -> str:
    return value if isinstance(value, str) else number(value, 4)
