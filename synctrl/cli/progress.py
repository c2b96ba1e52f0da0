"""How far a run is, and how much time is left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .console import err, readable


@contextmanager
def progress_bar(what: str, total: float, unit: str = "s") -> Iterator[Callable[[float], None]]:
    """A function that is told how far something is; it is drawn on a terminal, and nowhere else."""
    console = err()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.completed:.4g}/{task.total:g} " + unit),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        task = bars.add_task(readable(what), total=total)
        yield lambda done: bars.update(task, completed=done)


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Words that something is at work that cannot say how far it is; on a terminal only."""
    console = err()
    if not console.is_terminal:
        yield
        return
    with console.status(readable(what)):
        yield
