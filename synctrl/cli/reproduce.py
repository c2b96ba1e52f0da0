"""`synctrl reproduce`: the paper, checked, wherever the package is installed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from .answer import answering
from .options import Folder, Json, Workers

Quick = Annotated[bool, typer.Option("--quick", help="No more than a second of every run, as a trial.")]


def reproduce(
    out: Folder = Path("out"), workers: Workers = 2, quick: Quick = False, as_json: Json = False
) -> None:
    """Run every experiment of the paper, and write a page that checks its claims.

    The page has the paper's figures, a table of metrics, each claim with the number behind its verdict, and
    animations that play offline. Runs are in FOLDER/runs, all numbers in FOLDER/metrics.json.
    """
    with answering(as_json) as answer:
        from ..paper.whole import everything, longest_comparison
        from ..paper.whole import reproduce as make

        page = make(out, workers, everything(quick), longest_comparison(quick))
        answer.data |= {"page": page, "trial": quick, **_counted(out / "metrics.json")}
        answer.show(f"\nOpen {page}")


def _counted(path: Path) -> dict[str, Any]:
    """How many runs there are, and what became of each claim."""
    found = json.loads(path.read_text("utf-8"))
    claims = [{"text": claim["text"], "holds": claim["holds"]} for claim in found["claims"]]
    return {"metrics": path, "runs": len(found["runs"]), "claims": claims}
