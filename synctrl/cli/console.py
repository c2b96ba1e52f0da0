"""What is printed: tables and lines in a terminal, and the same as plain text elsewhere.

Names from files are text: nothing in them is ever markup, and what cannot be printed is escaped.
"""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

#: columns where nobody says how wide the terminal is
WIDTH = 120
GOOD, BAD, DIM, HEAD = "green", "bold red", "dim", "bold"


def out() -> Console:
    """What goes to the standard output."""
    return _console(sys.stdout)


def err() -> Console:
    """What goes to the standard error: remarks, errors and progress."""
    return _console(sys.stderr)


def _console(file: Any) -> Console:
    width = None if file.isatty() else shutil.get_terminal_size((WIDTH, 24)).columns
    return Console(file=file, width=width, markup=False, emoji=False, highlight=False)


def complain(kind: str, message: str) -> None:
    """Print `kind: message` to the standard error, as it is, however long it is."""
    style = {"error": BAD, "warning": "yellow"}.get(kind, HEAD)
    err().print(Text.assemble((f"{kind}: ", style), readable(message)), soft_wrap=True)


def readable(text: object) -> str:
    """A text with what cannot be printed escaped; lines stay lines."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in str(text)
    )


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], left: int = 1) -> Table:
    """A table; the first `left` columns are words, the others numbers. Cells are texts, or `Text`."""
    made = Table(title=readable(title), title_justify="left", title_style=HEAD, header_style=DIM, box=None)
    made.show_header = any(columns)
    made.pad_edge, made.padding = False, (0, 2, 0, 0)
    for k, name in enumerate(columns):
        made.add_column(name, justify="left" if k < left else "right", overflow="fold")
    for row in rows:
        made.add_row(*(cell if isinstance(cell, Text) else readable(cell) for cell in row))
    return made


def number(value: float | None, digits: int = 3) -> str:
    """A number in a few digits; a dash where there is none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    return f"{value:.{digits}g}"


def lines(title: str, texts: Iterable[object]) -> Text:
    """A heading, and indented lines below it."""
    made = Text(readable(title), style=HEAD)
    for text in texts:
        made.append(f"\n  {readable(text)}", style="not bold")
    return made
