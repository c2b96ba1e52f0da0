"""Reading what a sweep has written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..checks import count
from ..errors import MissingDependencyError, ResultError
from ..simulation.result import Result
from .description import read_about
from .evaluation import kept_file
from .journal import read_rows

#: columns that are text; all others are numbers, unless a factor's values are words
TEXT = ("status", "cause")


def load(folder: str | Path) -> Any:
    """The rows of all finished runs, also of a sweep that is not finished.

    `table.attrs` has what the sweep is: factors, measures with their definitions and units, versions.

    Args:
        folder: what `Sweep.run` was given.

    Returns:
        A pandas DataFrame with the numbers of the runs as its index, sorted; `table.to_xarray()` makes an
        xarray Dataset of it.

    Raises:
        ResultError: no sweep, or one that is damaged; the message names the file.
        SweepFileError: a line that cannot be of this sweep; the message names the file and the line.
        MissingDependencyError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise MissingDependencyError("reading a table needs pandas: pip install 'synctrl[sweep]'") from error
    about = read_about(folder)
    columns = about["columns"]
    rows = read_rows(folder, about)
    table = pd.DataFrame([rows[run] for run in sorted(rows)], columns=columns)
    for name in columns[1:]:
        if name in TEXT or any(isinstance(value, str) for value in table[name]):
            table[name] = table[name].astype(object).where(table[name].notna(), "")
        else:
            table[name] = table[name].astype(float)
    table = table.astype({"run": int}).set_index("run")
    table.attrs.update(about)
    return table


def trajectories(folder: str | Path, run: int) -> Result:
    """The trajectories that were kept of a run, see `keep_every` of `Sweep.run`.

    Raises:
        InputError: no number of a run.
        ResultError: none were kept, or the file is damaged or of another run.
    """
    read_about(folder)
    path = kept_file(folder, count("run", run, least=0))
    if not path.is_file():
        raise ResultError(
            f"no trajectories of run {run} in '{folder}': run the sweep with keep_every", file=path
        )
    result = Result.load(path)
    if result.info.get("run") != run:
        found = result.info.get("run")
        raise ResultError(f"'{path}': expected run {run}, found run {found!r}", file=path, found=found)
    return result
