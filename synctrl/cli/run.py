"""`synctrl run`: a cell file, run; the page, numbers, certificate and animation of the run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .answer import answering
from .exports import check_exports, export
from .made import make_run, planned
from .options import CellFile, Duration, Engine, Export, Folder, Json, Period, Step
from .pages import certified, prepare_folder, tell_run, write_page, write_run

LogStep = Annotated[
    float | None,
    typer.Option("--log-dt", metavar="SECONDS", help="Interval of the log; by default the step."),
]
Plant = Annotated[
    str | None, typer.Option(metavar="LIBRARY", help="What computes the plant: pinocchio or mujoco.")
]
Page = Annotated[bool, typer.Option(help="Write the page with figures and animation, beside the numbers.")]


def run(
    cell: CellFile,
    out: Folder = Path("out"),
    duration: Duration = None,
    dt: Step = None,
    engine: Engine = None,
    control_period: Period = None,
    log_dt: LogStep = None,
    plant: Plant = None,
    page: Page = True,
    export_to: Export = [],  # noqa: B006
    as_json: Json = False,
) -> None:
    """Run a cell, and write its page, numbers, certificate and animation into a folder.

    FOLDER/run.npz has everything that was computed, FOLDER/metrics.json its numbers, and FOLDER/index.html
    shows them. A run that has to stop, or is interrupted by Ctrl-C, is written as far as it came.
    """
    with answering(as_json) as answer:
        check_exports(export_to)
        asked = {"duration": duration, "dt": dt, "engine": engine, "control_period": control_period}
        experiment, how, _ = planned(answer, cell, **asked, log_dt=log_dt, plant=plant)
        prepare_folder(out, cell)
        result = make_run(answer, experiment, how)
        certificate = certified(answer, result, experiment)
        tell_run(answer, result, certificate)
        write_run(answer, out, result, certificate, cell)
        if page:
            write_page(answer, out, result, certificate, experiment)
        export(answer, result, export_to)
