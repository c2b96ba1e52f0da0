"""Tasks of assembly on the page: what a task is made of, and its section.

A task is a value: its runs, and what is said, drawn, tabulated and asked of them. Another task is another
value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..show.curves import Curves, overlay
from ..show.side_by_side import side_by_side
from ..simulation.result import Result
from .claims import MUCH, OURS, Claim, Finding, need
from .report import Block, Links, Section, Table, Text, Verdicts, as_picture, number
from .reproduction import PlannedRun

#: where the claims of tasks are from
OUR_CELL = f"{OURS}: a cell that is not in the paper"
#: words for runs that a task compares: synchronized, independent with as much gain, and independent
COMPARED = "synchronized", "Λ = 26 s⁻¹", "independent"


@dataclass(frozen=True)
class Drawing:
    """Curves of some runs of a task on one another.

    Attributes:
        stem: name of the file, without its ending.
        caption: below the figure.
        curves_of: what is drawn of each run.
        runs: which ones, by their names in the task.
    """

    stem: str
    caption: str
    curves_of: Callable[[Result], Sequence[Curves]]
    runs: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Task:
    """A task of the paper's introduction.

    Attributes:
        name: what the names of its runs begin with.
        title: of its section.
        words: paragraphs before the figures.
        planned: its runs by name.
        labels: what tables, legends and animations call them.
        drawings: its figures.
        animated: runs that are played side by side.
        columns: heads of the table's columns, and what stands in them.
        claims: what is asked of the runs.
    """

    name: str
    title: str
    words: tuple[str, ...]
    planned: Mapping[str, PlannedRun]
    labels: Mapping[str, str]
    drawings: tuple[Drawing, ...]
    animated: tuple[str, ...]
    columns: Mapping[str, Callable[[Result], float]]
    claims: Callable[[Mapping[str, Result]], list[Claim]]


def planned_runs(tasks: Sequence[Task]) -> dict[str, PlannedRun]:
    """The runs of all tasks as this machine can make them, under names that begin with those of the tasks."""
    return {f"{task.name}_{name}": run.possible() for task in tasks for name, run in task.planned.items()}


def runs_of(task: Task, every: Mapping[str, Result]) -> dict[str, Result]:
    """The runs of a task, under their names in it.

    Raises:
        InputError: one is missing.
    """
    return dict(zip(task.planned, need(every, *planned_runs([task])), strict=True))


def task_section(task: Task, runs: Mapping[str, Result], claims: Sequence[Claim], out: Path) -> Section:
    """What is said, drawn, tabulated and found of a task; its files go into `out`.

    Args:
        task: the task.
        runs: its runs, by their names in it.
        claims: what `task.claims` found.
        out: the folder of the page.
    """
    blocks: list[Block] = [Text(each) for each in task.words]
    blocks.append(_animation(task, runs, out))
    for drawing in task.drawings:
        figure = overlay(drawing.curves_of, _labelled(task, runs, drawing.runs))
        blocks.append(as_picture(figure, out / "figures" / drawing.stem, drawing.caption))
    blocks += [_table(task, runs), Verdicts(tuple(claims))]
    return Section(task.title, tuple(blocks))


def _labelled(task: Task, runs: Mapping[str, Result], names: Sequence[str]) -> dict[str, Result]:
    return {task.labels[name]: runs[name] for name in names}


def _animation(task: Task, runs: Mapping[str, Result], out: Path) -> Links:
    scene = side_by_side(_labelled(task, runs, task.animated))
    path = scene.write(out / "animations" / f"{task.name}.html")
    return Links(((path.relative_to(out).as_posix(), f"Animation: {scene.title}"),))


def _table(task: Task, runs: Mapping[str, Result]) -> Table:
    rows = [
        (
            task.labels[name],
            *(number(measure(runs[name])) for measure in task.columns.values()),
            str(runs[name].info["engine"]),
        )
        for name in task.planned
    ]
    return Table(("", *task.columns, "engine"), tuple(rows), _ENGINES)


_ENGINES = "Engine: “compiled” is the closed loop of the reference engine, “pinocchio”, as generated C."


def more_than_gain(peaks: Sequence[float], seen: Sequence[Finding], remark: str = "") -> Claim:
    """The peak is smaller than that of independent control with as much gain, which is itself better.

    Args:
        peaks: of an error, one for each run of `COMPARED`.
        seen: what is told of them.
        remark: what is to be added.
    """
    asked = (
        f"Asked: a peak smaller by a factor of at least {MUCH:g} than with Λ = 26 s⁻¹, which is smaller than "
        "with Λ = 6 s⁻¹."
    )
    return Claim(
        "That is not gain alone: an independent controller with Λ + β for Λ gets part of the way.",
        OUR_CELL,
        peaks[0] * MUCH <= peaks[1] < peaks[2],
        tuple(seen),
        " ".join(filter(None, (asked, remark))),
    )


def root_mean_square(values: np.ndarray) -> float:
    """Root of the average over instants of equal distance of squared lengths, of (T,) or (T, k)."""
    return float(np.sqrt(np.mean(np.sum(values.reshape(len(values), -1) ** 2, axis=1))))


def since_push(run: Result, values: np.ndarray) -> np.ndarray:
    """Values over time, (T, ...), from the first disturbance on; the last one if the run ends before."""
    start = min(each["start"] for each in run.info["disturbances"])
    return values[run.t >= min(start, run.t[-1])]
