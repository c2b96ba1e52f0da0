"""`synctrl new`: a cell file to begin with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError, near
from ..files import reported, write_whole
from .answer import answering
from .names import ready_cells
from .options import Json

Target = Annotated[Path, typer.Argument(metavar="FILE", help="The new file.")]
Ready = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="NAME",
        help="One of the ready cells, in the place of the starter.",
        autocompletion=ready_cells,
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there.")]
Schema = Annotated[bool, typer.Option("--schema", help="Write the JSON schema beside it, for editors.")]


def new(
    file: Target = Path("cell.toml"),
    ready: Ready = None,
    force: Force = False,
    schema: Schema = False,
    as_json: Json = False,
) -> None:
    """Write a cell file with comments, to begin with; or one of the ready cells as a file."""
    with answering(as_json) as answer:
        if file.exists() and not force:
            raise InputError(
                "expected a new file, found one that is there; --force writes over it", subject=str(file)
            )
        _write(file, ready)
        answer.data["written"] = [file]
        if schema:
            answer.data["written"].append(_write_schema(file))
        for path in answer.data["written"]:
            answer.show(f"Written: {path}")
        answer.show(f"Run it: synctrl run {file} -o out")


def _write(file: Path, ready: str | None) -> None:
    from .. import experiments
    from ..cells import STARTER, write_cell

    if ready is None:
        with reported("write the cell to", file):
            write_whole(file, STARTER)
        return
    if ready not in ready_cells(""):
        expected = f"a ready cell: {', '.join(ready_cells(''))}"
        raise InputError(
            f"expected {expected}, found {ready!r}{near(ready, ready_cells(''))}", subject="--from"
        )
    write_cell(getattr(experiments, ready)(), file)


def _write_schema(file: Path) -> Path:
    from ..cells import schema

    path = file.with_name(f"{file.stem}.schema.json")
    with reported("write the schema to", path):
        write_whole(path, json.dumps(schema(), indent=1, ensure_ascii=False) + "\n")
    return path
