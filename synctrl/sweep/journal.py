"""The folder of a sweep: what it is, and one line for every run that is done.

`sweep.json` describes the sweep and is written first. `runs.jsonl` grows by one line per run, in the order in
which runs finish; only complete lines count, so whatever stops the sweep costs the runs in flight and no
others. What a line can be follows from the description, and every line is compared with it. `table.csv`
appears when the last run is done: the same rows, sorted.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Self

from ..checks import count
from ..errors import MissingDependencyError, ResultError
from ..files import read_regular, reported, write_whole
from ..simulation.result import Result
from .description import ABOUT, FORMAT, difference, measures_of, own_of, read_about, row_format
from .distributions import Value
from .rows import Draws, Format, Generations, Row, fault_of_values, line_of, wrong_line

RUNS, TABLE, KEPT = "runs.jsonl", "table.csv", "runs"
#: columns that are text; all others are numbers, unless a factor's values are words
TEXT = ("status", "cause")


class Journal:
    """The folder of a sweep, held by one process from here on: nothing was read or written before.

    `begin` says what the sweep is and reads what was done; only then can rows be added.

    Args:
        folder: where; made if it does not exist.

    Attributes:
        rows: rows of the runs that are done, by number of the run, in the order of their lines.

    Raises:
        ResultError: another process has it, or it cannot be written.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        self.about: dict[str, Any] = {}
        self.rows: dict[int, Row] = {}
        with self._writing():
            self.folder.mkdir(parents=True, exist_ok=True)
            self._file = (self.folder / RUNS).open("a+b", buffering=0)
            lock(self._file, self.folder)

    def known(self) -> dict[str, Any] | None:
        """What the sweep in the folder is, or None if there is none yet.

        Raises:
            ResultError: its description is damaged or missing.
        """
        if (self.folder / ABOUT).exists():
            return read_about(self.folder)
        if os.fstat(self._file.fileno()).st_size:
            raise ResultError(
                f"'{self.folder}' has runs but no {ABOUT}; choose another folder", file=self.folder
            )
        return None

    def begin(self, about: Mapping[str, Any], runs: Draws | Generations) -> None:
        """Write what the sweep is, or compare it with what is written; and read the runs that are done.

        Args:
            about: what the sweep is, plain data.
            runs: which runs it has.

        Raises:
            ResultError: the folder holds another sweep, or cannot be written.
            SweepFileError: a line that cannot be of this sweep.
        """
        self.about = {"format": FORMAT, **about}
        known = self.known()
        with self._writing():
            if known is None:
                write_whole(self.folder / ABOUT, json.dumps(self.about, ensure_ascii=False, indent=1) + "\n")
            elif found := difference(known, json.loads(json.dumps(self.about))):
                other = f"'{self.folder}' holds another sweep: {found}; choose another folder"
                raise ResultError(other, file=self.folder, found=found)
            content = read_regular(self.folder / RUNS)
            measures, own = measures_of(self.about), own_of(self.about)
            rows = Format(about["columns"], runs, about["duration"], measures, own)
            self.rows = rows.read(self.folder / RUNS, content)
            self._file.truncate(content.rfind(b"\n") + 1)  # an incomplete last line does not count

    def has(self, run: int, values: Sequence[Value]) -> bool:
        """Whether a run is done.

        Raises:
            SweepFileError: it is, but with other values of the factors.
        """
        if run not in self.rows:
            return False
        names = self.about["columns"][1 : 1 + len(values)]
        fault = fault_of_values(names, values, self.rows[run][1 : 1 + len(values)])
        if fault:
            raise wrong_line(self.folder / RUNS, line_of(run, self.rows), f"run {run}, {fault}")
        return True

    def append(self, rows: Sequence[Row]) -> None:
        """Add rows of finished runs; they are on the disk when this returns."""
        text = "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in rows)
        with self._writing():
            rest = memoryview(text.encode())
            while rest:  # a disk that fills up takes a part first, and refuses the rest
                rest = rest[self._file.write(rest) :]
            os.fsync(self._file.fileno())
        self.rows.update({row[0]: row for row in rows})

    def finish(self) -> Path:
        """Write all rows, sorted by number of the run, to `table.csv`."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.about["columns"])
        for run in sorted(self.rows):
            writer.writerow("" if value is None else value for value in self.rows[run])
        with self._writing():
            write_whole(self.folder / TABLE, text.getvalue())
        return self.folder / TABLE

    def close(self) -> None:
        """Let another process write."""
        with contextlib.suppress(OSError):  # what counts was written and synchronized before
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- internals ----------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def _writing(self) -> Any:
        try:
            yield
        except OSError as error:
            raise ResultError(
                f"cannot write to the sweep in '{self.folder}': {error.strerror or error}; the runs written "
                "before are kept, and the same sweep goes on from them",
                file=self.folder,
            ) from error


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
    path = Path(folder) / RUNS
    with reported("read", path):
        content = read_regular(path) if path.exists() else b""
    rows = row_format(about).read(path, content)
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


def kept_file(folder: str | Path, run: int) -> Path:
    """Where the trajectories of a run are kept."""
    return Path(folder) / KEPT / f"{run:06d}.npz"


def lock(file: IO[bytes], folder: Path) -> None:
    """Keep other processes from writing, where the system can; the lock ends with the process.

    Raises:
        ResultError: another process holds it.
    """
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ResultError(
            f"another process has it: it is running the sweep in '{folder}'; wait until it ends", file=folder
        ) from None
