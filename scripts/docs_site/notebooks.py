"""Notebooks with what they print and draw."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from docs_site.stage import ROOT, digest, keep

TIMEOUT = 300  # s, for a cell
#: what IPython says of every animation
HUSHED = "ignore:Consider using IPython.display.IFrame instead:UserWarning"
#: where a cell is while it runs
PLACE = re.compile(r"(?m)^\S*/ipykernel_\d+/\d+\.py:(?=\d+: )")


def executed(path: Path, place: Path, cache: Path, words: Callable[[str], str]) -> Path:
    """Run a notebook, unless it was with this code, and write it with its outputs.

    Args:
        path: the notebook.
        place: where it is written.
        cache: folder of those that were executed, by what they and the package are.
        words: what the site has for the words of a cell, which may have links.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell failed.
    """
    known = cache / f"{path.stem}-{digest([path, Path(__file__)])}.ipynb"
    if not known.is_file():
        for old in cache.glob(f"{path.stem}-*.ipynb"):
            old.unlink()
        keep(known, run(path).encode())
    notebook = json.loads(known.read_text("utf-8"))
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            cell["source"] = words("".join(cell["source"]))
    keep(place, json.dumps(notebook).encode())
    return place


def run(path: Path) -> str:
    """The text of a notebook with its outputs."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:  # what notebooks write stays there
        resources = {"metadata": {"path": folder}}
        client = NotebookClient(notebook, timeout=TIMEOUT, kernel_name="python3", resources=resources)
        client.execute(env={**os.environ, "PYTHONWARNINGS": HUSHED, "PYTHONPATH": str(ROOT)})
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times, which differ
        for output in cell.get("outputs", ()):
            if output.output_type == "stream":
                output.text = PLACE.sub("line ", output.text)
    return nbformat.writes(notebook)
