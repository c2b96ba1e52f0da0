"""Scripts that start processes which import them again: such work has to stand below a main guard."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from types import FrameType, ModuleType

from ..errors import SweepError

GUARD = 'if __name__ == "__main__":'


def check_main_guard(what: str) -> None:
    """Refuse to start processes from a line of the main script that each of them would run again.

    Nothing is refused where no script is imported again, as in a notebook or under `python -m package`.

    Args:
        what: what starts the processes.

    Raises:
        SweepError: the script is no file, or its line that is being run has no main guard; the message names
            file and line.
    """
    main = sys.modules["__main__"]
    file, spec = getattr(main, "__file__", None), getattr(main, "__spec__", None)
    if file is None or (spec is not None and spec.name.endswith("__main__")):
        return
    if not Path(file).is_file():
        raise SweepError(f"{what} starts processes that import '{file}', which is no file; put it into one")
    line = _running_line(main)
    if line is not None and not _is_guarded(Path(file), line):
        raise SweepError(
            f"{what} starts processes that import '{file}', and its line {line} would start more of them "
            f"there; put that line below `{GUARD}`"
        )


def _running_line(main: ModuleType) -> int | None:
    """The line of the main script that is being run, or None if it is another thread that runs it."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if frame.f_globals is vars(main) and frame.f_code.co_name == "<module>":
            return frame.f_lineno
        frame = frame.f_back
    return None


def _is_guarded(file: Path, line: int) -> bool:
    """Whether a line of a script stands in an `if` that asks for `__name__`."""
    tree = ast.parse(file.read_bytes())
    return any(
        node.lineno <= line <= (node.end_lineno or line) and "__name__" in ast.unparse(node.test)
        for node in ast.walk(tree)
        if isinstance(node, ast.If)
    )
