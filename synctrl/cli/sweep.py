"""`synctrl sweep`: many runs of a cell, each with other values, and their table."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from . import codes
from .answer import Answer, answering
from .made import planned
from .options import CellFile, Duration, Engine, Folder, Json, Period, Seed, Step, Workers

Vary = Annotated[
    list[str],
    typer.Option(
        metavar="NAME=KIND(...)", help="What differs from run to run: gains.beta=log(5,150). Repeatable."
    ),
]
Samples = Annotated[int, typer.Option(min=1, help="Runs, or runs for each combination of grids.")]
Backend = Annotated[str, typer.Option(help="Who makes the runs: joblib, dask or serial.")]
Keep = Annotated[int | None, typer.Option(min=1, metavar="N", help="Keep every N-th instant of all runs.")]
Best = Annotated[str, typer.Option(metavar="MEASURE", help="By which measure the best runs are listed.")]
#: how many of the best runs are listed
LISTED = 5


def sweep(
    cell: CellFile,
    vary: Vary,
    out: Folder = Path("out"),
    samples: Samples = 1,
    seed: Seed = 0,
    duration: Duration = None,
    dt: Step = None,
    engine: Engine = None,
    control_period: Period = None,
    workers: Workers = 2,
    backend: Backend = "joblib",
    keep_every: Keep = None,
    best: Best = "sync_rms",
    as_json: Json = False,
) -> None:
    """Run a cell many times, each time with other values, and write a table.

    Rows are on the disk as soon as they are there: whatever ends a sweep, the same command goes on from them.
    """
    with answering(as_json) as answer:
        from ..checks import choice
        from ..sweep import Sweep
        from ..sweep.measures import MEASURES
        from .values import read_factor

        choice("--best", best, MEASURES)
        asked = {"duration": duration, "dt": dt, "engine": engine, "control_period": control_period}
        base = planned(answer, cell, **asked)
        experiment, answer.data["folder"] = base.experiment, out
        factors = [read_factor("--vary", text, experiment.gains) for text in vary]
        made = Sweep(experiment, factors, samples=samples, seed=seed, **base.shared)
        try:
            shown = sys.stderr.isatty()
            table = made.run(out, workers, backend, keep_every=keep_every, progress=shown)
            answer.data["table"] = table
        except KeyboardInterrupt as error:
            answer.fault(error, codes.INTERRUPTED)
        _tell(answer, out, len(made), [factor.name for factor in factors], best, experiment.cell)


def _tell(answer: Answer, folder: Path, whole: int, names: list[str], best: str, cell: object) -> None:
    from ..sweep.measures import definitions
    from ..sweep.rows import COMPLETED
    from .console import lines
    from .rows import best_table, causes_of, endings, read_rows, spread_table, spreads

    rows = read_rows(folder)
    good = [row for row in rows if row["status"] == COMPLETED and row.get(best) is not None]
    first = sorted(good, key=lambda row: row[best])[:LISTED]
    answer.data |= {"planned": whole, "runs": len(rows), "endings": endings(rows)}
    answer.data |= {"measures": spreads(rows), "best": first}
    ended = ", ".join(f"{count} {status}" for status, count in endings(rows).items())
    answer.show(f"{len(rows)} of {whole} runs: {ended or 'none yet'}", "")
    if causes := causes_of(rows):
        answer.data["causes"] = causes
        said = [f"{cause} ({count} times)" if count > 1 else cause for cause, count in causes.items()]
        answer.show(lines("Why runs did not come to their end", said[:LISTED]), "")
    if len(rows) == whole and not good:
        answer.code = codes.FOUND_WANTING
    if good:
        units = definitions(cell)  # type: ignore[arg-type]
        answer.show(spread_table(rows, units), "")
        columns = [*names, *dict.fromkeys([best, "sync_rms", "tracking_rms", "peak_torque"])]
        answer.show(best_table(f"Least {best}, in SI units", first, columns), "")
    if len(rows) < whole:
        answer.show(f"Rows so far are in {folder}; the same command goes on from them.")
    else:
        answer.show(f"Written: {answer.data.get('table', folder)}")
