"""Notebooks with what they print and draw."""

from __future__ import annotations

import hashlib
from pathlib import Path

from docs_site.stage import keep

ROOT = Path(__file__).resolve().parents[2]
TIMEOUT = 300  # s, for a cell


def executed(path: Path, place: Path, cache: Path) -> Path:
    """Run a notebook, unless it was with this code, and write it with its outputs.

    Args:
        path: the notebook.
        place: where it is written.
        cache: folder of those that were executed, by what they and the package are.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell failed.
    """
    known = cache / f"{path.stem}-{digest(path)}.ipynb"
    if not known.is_file():
        for old in cache.glob(f"{path.stem}-*.ipynb"):
            old.unlink()
        keep(known, run(path).encode())
    keep(place, known.read_bytes())
    return place


def run(path: Path) -> str:
    """The text of a notebook with its outputs."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, timeout=TIMEOUT, kernel_name="python3", resources=resources).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times, which differ
    return nbformat.writes(notebook)


def digest(path: Path) -> str:
    """What a notebook and all code of the package are, as a short text."""
    found = hashlib.sha256(path.read_bytes())
    for module in sorted((ROOT / "synctrl").rglob("*.py")):
        found.update(module.read_bytes())
    return found.hexdigest()[:16]
