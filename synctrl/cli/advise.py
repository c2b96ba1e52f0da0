"""`synctrl advise`: what the gains of a cell will do before it runs, and what to change first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from . import codes
from .answer import answering
from .made import planned
from .options import CellFile, Json, Period, Step

Write = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write the cell with all changes of gains; robots' files have to lie below its folder.",
    ),
]


def advise(
    cell: CellFile,
    dt: Step = None,
    control_period: Period = None,
    write: Write = None,
    as_json: Json = False,
) -> None:
    """Say what the gains of a cell will do, before it runs, and what to change first.

    Poles, the longest step and period, delay between robots, torque expected against limits, learning against
    damping. Ends with 4 if the run is expected to diverge.
    """
    with answering(as_json) as answer:
        from ..analysis.advise import advise_run
        from ..cells import write_cell

        experiment, how, _ = base = planned(
            answer, cell, engine="pinocchio", dt=dt, control_period=control_period
        )
        found = advise_run(experiment, how.get("dt", 1e-3), how.get("control_period"))
        answer.data |= found.to_dict()
        answer.show(f"{experiment.title or experiment.cell.name}", "", str(found))
        if write is not None:
            changed = replace(experiment, gains=found.changed)
            answer.data["written"] = [write_cell(changed, write, run=base.kept)]
            answer.show("", f"Written: {write}")
        answer.code = codes.FOUND_WANTING if found.diverges else codes.DONE
