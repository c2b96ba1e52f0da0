"""The notebooks run, have no stored output, and are in step with their readable twins."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

jupytext = pytest.importorskip("jupytext", reason="an extra: pip install 'synctrl[notebooks]'")
nbclient = pytest.importorskip("nbclient", reason="an extra: pip install 'synctrl[notebooks]'")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))

#: s; robot 1 of the four arms is pushed after half a second
DURATION, LONGER = 0.3, {"planar_four": 0.6}


def cells(notebook):
    return [(cell.cell_type, cell.source.strip()) for cell in notebook.cells]


def test_there_are_notebooks_for_both_cells_of_the_paper():
    assert {path.stem for path in NOTEBOOKS} >= {"planar_four", "a460_pair"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_and_its_twin_say_the_same(path):
    twin = path.with_suffix(".py")
    assert twin.is_file()
    assert cells(jupytext.read(path)) == cells(jupytext.read(twin))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_no_stored_output(path):
    for cell in jupytext.read(path).cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_figures_and_an_animation(path, tmp_path):
    notebook = jupytext.read(path)
    shorten(notebook, LONGER.get(path.stem, DURATION))
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=folder(tmp_path))
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    data = [output.data for output in outputs if "data" in output]
    assert sum("image/png" in item for item in data) >= 4
    animations = [item["text/html"] for item in data if "<iframe" in item.get("text/html", "")]
    assert len(animations) == 2
    assert not any(re.search(r"""(src|href)=["']https?://""", page) for page in animations)


def shorten(notebook, duration):
    """A short horizon, s, so that the test is quick."""
    for cell in notebook.cells:
        said = f"DURATION = {duration}"
        cell.source, found = re.subn(r"^DURATION = .*", said, cell.source, flags=re.MULTILINE)
        if found:
            return
    raise AssertionError("no cell sets DURATION")


def folder(tmp_path):
    """Where the notebook runs: not in the project, which it must not need."""
    return {"metadata": {"path": str(tmp_path)}}
