"""A result written for other tools, by the ending of a file's name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from ..errors import InputError
from ..simulation.result import Result
from .answer import Answer

#: by the ending, the method of `Result` that writes it
WRITERS: Mapping[str, str] = MappingProxyType(
    {
        ".csv": "to_csv",
        ".mat": "to_mat",
        ".nc": "to_netcdf",
        ".mcap": "to_mcap",
        ".rrd": "to_rerun",
    }
)


def check_exports(files: Sequence[Path]) -> None:
    """Refuse an ending that nothing is written for, before anything runs.

    Raises:
        InputError: with the endings that there are.
    """
    for file in files:
        if file.suffix.lower() not in WRITERS:
            raise InputError.expected(f"a file that ends in {', '.join(WRITERS)}", str(file), "--export")


def export(answer: Answer, result: Result, files: Sequence[Path]) -> None:
    """Write a result to files for other tools.

    Raises:
        MissingDependencyError: an extra is needed.
        ResultError: a file cannot be written.
    """
    check_exports(files)
    written = [getattr(result, WRITERS[file.suffix.lower()])(file) for file in files]
    if written:
        answer.data["exported"] = written
        answer.show("", f"Written: {', '.join(map(str, written))}")
