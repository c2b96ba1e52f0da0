"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .names import engine_names

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
CellFile = Annotated[Path, typer.Argument(metavar="CELL", help="A cell file (TOML).")]
Folder = Annotated[
    Path, typer.Option("--out", "-o", metavar="FOLDER", help="For everything that is written.")
]
Workers = Annotated[int, typer.Option(min=1, help="Number of processes.")]
Duration = Annotated[
    float | None, typer.Option(metavar="SECONDS", help="How long to run; by default what the file says.")
]
Step = Annotated[
    float | None,
    typer.Option("--dt", metavar="SECONDS", help="Step; by default what the file says, or 0.001."),
]
Engine = Annotated[
    str | None,
    typer.Option(
        metavar="ENGINE",
        help="pinocchio, compiled (C, many times faster), or auto: compiled where it can be had. By default "
        "what the file says, or auto.",
        autocompletion=engine_names,
    ),
]
Period = Annotated[
    float | None,
    typer.Option(
        "--control-period", metavar="SECONDS", help="Hold torque so long; by default as the file says."
    ),
]
Export = Annotated[
    list[Path],
    typer.Option(
        "--export",
        metavar="FILE",
        help="Write it for other tools: .csv, .mat, .nc (netCDF), .mcap (Foxglove), .rrd (Rerun).",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Of random numbers.")]
