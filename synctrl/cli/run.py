"""`synctrl run`: a cell file, run; the page, numbers, certificate and animation of the run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .answer import answering
from .engines import AUTO
from .made import How, make_run
from .options import CellFile, Duration, Engine, Folder, Json, Period, Step
from .pages import certified, tell_run, write_page, write_run

LogStep = Annotated[
    float | None,
    typer.Option("--log-dt", metavar="SECONDS", help="Interval of the log; by default the step."),
]
Plant = Annotated[str, typer.Option(metavar="LIBRARY", help="What computes the plant: pinocchio or mujoco.")]
Page = Annotated[bool, typer.Option(help="Write the page with figures and animation, beside the numbers.")]


def run(
    cell: CellFile,
    out: Folder = Path("out"),
    duration: Duration = None,
    dt: Step = 1e-3,
    engine: Engine = AUTO,
    control_period: Period = None,
    log_dt: LogStep = None,
    plant: Plant = "pinocchio",
    page: Page = True,
    as_json: Json = False,
) -> None:
    """Run a cell, and write its page, numbers, certificate and animation into a folder.

    FOLDER/run.npz has everything that was computed, FOLDER/metrics.json its numbers, and FOLDER/index.html
    shows them. A run that has to stop, or is interrupted by Ctrl-C, is written as far as it came.
    """
    with answering(as_json) as answer:
        from ..cells import read_cell

        experiment = read_cell(cell)
        result = make_run(answer, experiment, How(duration, dt, engine, control_period, log_dt, plant))
        certificate = certified(answer, result, experiment)
        tell_run(answer, result, certificate)
        write_run(answer, out, result, certificate, cell)
        if page:
            write_page(answer, out, result, certificate, experiment)
