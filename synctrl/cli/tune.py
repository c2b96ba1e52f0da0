"""`synctrl tune`: values, such as gains, with which a cell does as well as it can."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError, SynctrlError
from ..tune import Tuned
from .answer import Answer, answering
from .made import planned
from .options import CellFile, Duration, Engine, Folder, Json, Period, Seed, Step, Workers

Search = Annotated[
    list[str],
    typer.Option(
        metavar="NAME=KIND(LOW,HIGH)", help="A range to search: gains.beta=log(1,1000). Repeatable."
    ),
]
Small = Annotated[
    list[str], typer.Option(metavar="MEASURE", help="To be small; by default sync_rms. Repeatable.")
]
Large = Annotated[
    list[str], typer.Option(metavar="MEASURE", help="To be large, such as delay_margin. Repeatable.")
]
Limit = Annotated[
    list[str],
    typer.Option(metavar="MEASURE=VALUE", help="The largest value allowed of a measure. Repeatable."),
]
Generations = Annotated[int, typer.Option(min=1, help="How often the population is renewed.")]
Population = Annotated[int, typer.Option(min=5, help="Runs of a generation.")]

File = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The cell with the values found; by default FOLDER/tuned.toml. Robots' files "
        "have to lie below its folder.",
    ),
]


def tune(
    cell: CellFile,
    search: Search,
    minimize: Small = [],  # noqa: B006
    maximize: Large = [],  # noqa: B006
    limit: Limit = [],  # noqa: B006
    out: Folder = Path("out"),
    generations: Generations = 12,
    population: Population = 24,
    seed: Seed = 0,
    duration: Duration = None,
    dt: Step = None,
    engine: Engine = None,
    control_period: Period = None,
    workers: Workers = 2,
    tuned: File = None,
    as_json: Json = False,
) -> None:
    """Search ranges of gains for the best runs, and write the cell with the gains that were found.

    With several goals what is found is a front, and the run chosen is nearest to the best of every goal.
    FOLDER/tuned.toml is the cell with its values. The same command goes on where it was interrupted.
    """
    with answering(as_json) as answer:
        from ..tune import tune as find
        from .values import read_factor

        asked = {"duration": duration, "dt": dt, "engine": engine, "control_period": control_period}
        experiment, *_ = base = planned(answer, cell, **asked)
        factors = [read_factor("--search", text, experiment.gains) for text in search]
        goals = {"minimize": minimize or ([] if maximize else ["sync_rms"]), "maximize": maximize}
        amount = {"generations": generations, "population": population, "seed": seed}
        where = {"folder": out, "workers": workers, "progress": sys.stderr.isatty()}
        with _kept(answer, out):
            options: dict[str, Any] = {**goals, **amount, **where, **base.shared}
            found = find(experiment, factors, limits=_limits(limit), **options)
        _tell(answer, found)
        _write(answer, found, out)
        _write_cell(answer, found, tuned or out / "tuned.toml", base.kept)


@contextmanager
def _kept(answer: Answer, folder: Path) -> Iterator[None]:
    """Say of a search that is interrupted which runs are kept."""
    from .rows import endings, read_rows

    try:
        yield
    except KeyboardInterrupt:
        rows = read_rows(folder)
        answer.data |= {"runs": len(rows), "endings": endings(rows)}
        answer.show(f"{len(rows)} runs so far are in {folder}; the same command goes on from them.")
        raise


def _limits(texts: list[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise InputError.expected("MEASURE=VALUE", text, "--limit") from None
    return found


def _tell(answer: Answer, found: Tuned) -> None:
    from ..show.style import display
    from .console import number, table
    from .rows import best_table

    goals = [goal.name for goal in found.goals]
    answer.data |= {"runs": len(found.history), "run": found.run, "values": found.values}
    answer.data |= {"goals": goals, "measures": found.measures, "front": found.front}
    before = [[name, number(value, 4)] for name, value in found.values.items()]
    answer.show(
        f"{len(found.history)} runs; run {found.run} is chosen", "", table("Values", ("", ""), before), ""
    )
    rows = []
    for name, value in found.measures.items():
        unit, factor = display(found.definitions[name].unit)
        rows.append([name, number(None if value is None else factor * value), "" if unit == "1" else unit])
    answer.show(table("Measures", ("", "", ""), rows))
    if len(goals) > 1:
        columns = [*found.values, *goals]
        answer.show("", best_table(f"Front, in SI units: {len(found.front)} runs", found.front, columns))


def _write(answer: Answer, found: Tuned, folder: Path) -> None:
    """The front as a table and a figure."""
    from ..show.front_figures import front_figure
    from ..show.plots import save

    written = [found.save_front(folder / "front.csv")]
    if len(found.goals) > 1:
        written += save(front_figure(found), folder / "front")
    answer.data["written"] = written
    answer.show("", f"Written: {', '.join(map(str, written))}")


def _write_cell(answer: Answer, found: Tuned, file: Path, run: dict[str, Any]) -> None:
    """The cell with the values of the chosen run; one that no file can say is no failure of the search."""
    from ..cells import write_cell

    try:
        write_cell(found.experiment, file, run=run)
    except SynctrlError as error:
        answer.data["not_written"] = str(error)
        answer.show(f"Not written as a cell file: {error}")
        return
    answer.data["written"].append(file)
    answer.show(f"Run it: synctrl run {file} -o out")
