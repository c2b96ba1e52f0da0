"""`synctrl show`: any saved result, as numbers, a page and an animation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .answer import answering
from .exports import check_exports, export
from .options import Export, Json
from .pages import cell_beside, certified, tell_run, write_page

Saved = Annotated[
    Path, typer.Argument(metavar="RESULT", help="A saved result: a .npz file, or the folder of a long log.")
]
Pages = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        metavar="FOLDER",
        help="Where the page goes; by default beside the result, named as it is.",
    ),
]
Cell = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="The cell that made it, for a certificate; by default cell.toml beside it."
    ),
]
Open = Annotated[bool, typer.Option("--open", help="Open the page in a browser.")]
Written = Annotated[bool, typer.Option("--page/--no-page", help="Write the page; else print numbers only.")]


def show(
    result: Saved,
    out: Pages = None,
    cell: Cell = None,
    page: Written = True,
    open_: Open = False,
    export_to: Export = [],  # noqa: B006
    as_json: Json = False,
) -> None:
    """Show a saved result: its numbers here, and a page with figures and an animation.

    Where the cell file that made it is known, it is certified as well.
    """
    with answering(as_json) as answer:
        from ..cells import read_cell
        from ..simulation.result import Result

        check_exports(export_to)
        loaded = Result.load(result)
        experiment = cell_beside(answer, result) if cell is None else read_cell(cell)
        certificate = None if experiment is None else certified(answer, loaded, experiment)
        tell_run(answer, loaded, certificate)
        export(answer, loaded, export_to)
        if page:
            made = write_page(answer, _folder(result, out), loaded, certificate, experiment)
            if open_:
                typer.launch(str(made))


def _folder(result: Path, out: Path | None) -> Path:
    """Where the page of a result goes."""
    if out is not None:
        return out
    return result.parent if result.name == "run.npz" else result.with_suffix(".page")
