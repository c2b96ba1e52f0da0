"""The folder of a sweep: what it is, and one line for every run that is done.

`sweep.json` describes the sweep and is written first. `runs.jsonl` grows by one line per run, in the order in
which runs finish; only complete lines count, so whatever stops the sweep costs the runs in flight and no
others. `table.csv` appears when the last run is done: the same rows, sorted.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Self

from ..errors import ResultError
from ..files import write_whole

FORMAT = "synctrl sweep 1"
ABOUT, RUNS, TABLE, KEPT = "sweep.json", "runs.jsonl", "table.csv", "runs"

Row = list[Any]


class Journal:
    """The folder of a sweep, held by one process that writes.

    Args:
        folder: where; made if it does not exist.
        about: what the sweep is, plain data with "columns", the names of a row's entries; the first is "run".

    Attributes:
        rows: rows of the runs that are done, by number of the run.

    Raises:
        ResultError: the folder holds another sweep, another process writes to it, it is damaged, or it cannot
            be written.
    """

    def __init__(self, folder: str | Path, about: Mapping[str, Any]):
        self.folder = Path(folder)
        self.about = {"format": FORMAT, **about}
        with self._writing():
            self.folder.mkdir(parents=True, exist_ok=True)
            self._begin()
            self._file = self._open()
            self.rows = read_rows(self.folder, self.about["columns"])

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

    def _begin(self) -> None:
        """Write what the sweep is, or compare it with what is written."""
        path = self.folder / ABOUT
        if not path.exists():
            if (self.folder / RUNS).exists():
                raise ResultError(f"'{self.folder}' has runs but no {ABOUT}; choose another folder")
            write_whole(path, json.dumps(self.about, ensure_ascii=False, indent=1) + "\n")
            return
        found = difference(read_about(self.folder), json.loads(json.dumps(self.about)))
        if found:
            raise ResultError(f"'{self.folder}' holds another sweep: {found}; choose another folder")

    def _open(self) -> IO[bytes]:
        """The file of runs, ready for another line; an incomplete last line is cut off."""
        path = self.folder / RUNS
        path.touch()
        file = path.open("r+b", buffering=0)
        lock(file, self.folder)
        content = path.read_bytes()
        file.truncate(content.rfind(b"\n") + 1)
        file.seek(0, os.SEEK_END)
        return file

    @contextlib.contextmanager
    def _writing(self) -> Any:
        try:
            yield
        except OSError as error:
            raise ResultError(
                f"cannot write to the sweep in '{self.folder}': {error.strerror or error}; the runs written "
                "before are kept, and the same sweep goes on from them"
            ) from error


def read_about(folder: str | Path) -> dict[str, Any]:
    """What the sweep in a folder is.

    Raises:
        ResultError: there is none, or its description cannot be read.
    """
    path = Path(folder) / ABOUT
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ResultError(f"no sweep in '{folder}': it has no {ABOUT}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise ResultError(f"'{path}' cannot be read: {error}") from error
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        found = about.get("format") if isinstance(about, dict) else type(about).__name__
        raise ResultError(f"'{path}': expected the format '{FORMAT}', found {found!r}")
    columns = about.get("columns")
    if not isinstance(columns, list) or columns[:1] != ["run"]:
        raise ResultError(f"'{path}': expected the names of the columns, 'run' first, found {columns!r}")
    return about


def read_rows(folder: str | Path, columns: Sequence[str]) -> dict[int, Row]:
    """Rows of the finished runs in a folder, by number; an incomplete last line does not count.

    Raises:
        ResultError: a complete line that is no row; the message names the file and the line.
    """
    path = Path(folder) / RUNS
    try:
        content = path.read_bytes() if path.exists() else b""
    except OSError as error:
        raise ResultError(f"'{path}' cannot be read: {error.strerror or error}") from error
    rows: dict[int, Row] = {}
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        row = _read_row(line)
        if row is None or len(row) != len(columns) or row[0] in rows:
            raise ResultError(
                f"'{path}', line {number}: expected a run's {len(columns)} values, each run once, found "
                f"{line[:60].decode(errors='replace')!r}; take the line out and its run is made again"
            )
        rows[row[0]] = row
    return rows


def _read_row(line: bytes) -> Row | None:
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        return None
    fits = isinstance(row, list) and row and type(row[0]) is int and row[0] >= 0
    return row if fits and all(v is None or isinstance(v, (int, float, str)) for v in row) else None


def difference(there: Any, here: Any, where: str = "") -> str:
    """The first thing in which two descriptions differ, in words; empty if they do not."""
    if isinstance(there, dict) and isinstance(here, dict):
        keys = [*there, *(key for key in here if key not in there)]
        parts: Iterable[tuple[str, Any, Any]] = (
            (f"{where}.{key}" if where else key, there.get(key), here.get(key)) for key in keys
        )
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        parts = ((f"{where}[{k}]", *pair) for k, pair in enumerate(zip(there, here, strict=True)))
    else:
        return "" if there == here else f"{where} is {_short(there)} there and {_short(here)} here"
    return next((found for name, a, b in parts if (found := difference(a, b, name))), "")


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 80 else text[:77] + "..."


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
        raise ResultError(f"another process is running the sweep in '{folder}'; wait until it ends") from None
