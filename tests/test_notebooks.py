"""The notebooks run, teach, have no stored output, and are in step with their readable twins."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from synctrl import errors

jupytext = pytest.importorskip("jupytext", reason="an extra: pip install 'synctrl[notebooks]'")
nbclient = pytest.importorskip("nbclient", reason="an extra: pip install 'synctrl[notebooks]'")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))

#: s; robot 1 of the four arms is pushed after half a second
DURATION, LONGER = 0.3, {"planar_four": 0.6}
#: what else takes long, by the name that the notebooks give it
FEWER = {"RUNS": 60, "GENERATIONS": 1}
#: our own warnings, which notebooks may show and explain
WARNINGS = {name for name in vars(errors) if name.endswith("Warning")}


def cells(notebook):
    return [(cell.cell_type, cell.source.strip()) for cell in notebook.cells]


def test_there_are_notebooks_for_both_cells_of_the_paper_and_for_ones_own():
    assert {path.stem for path in NOTEBOOKS} >= {"planar_four", "a460_pair", "my_robots", "own_adaptation"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_says_what_is_learned_asks_for_more_and_leads_on(path):
    said = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "markdown"]
    assert re.search(r"(?m)^You will learn\n\n- ", said[0])
    exercises = "\n".join(said).partition("\n## Exercises\n")[2]
    assert len(re.findall(r"(?m)^\d\. ", exercises)) >= 3
    assert "\n## Further\n" in exercises
    links = re.findall(r"\]\((?!https?:)([^)#]+)", "\n".join(said))
    assert links and not [link for link in links if not (path.parent / link).is_file()]


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
    pages = [item["text/html"] for item in data if "text/html" in item]
    assert sum("image/png" in item for item in data) + sum("<img" in page for page in pages) >= 3
    animations = [page for page in pages if "<iframe" in page]
    assert animations
    assert not any(re.search(r"""(src|href)=["']https?://""", page) for page in pages)
    complaints = [output.text for output in outputs if output.get("name") == "stderr"]
    assert not [text for text in complaints if not any(name in text for name in WARNINGS)]


def shorten(notebook, duration):
    """A short horizon, s, and few runs, so that the test is quick."""
    found = 0
    for cell in notebook.cells:
        for name, value in {"DURATION": duration, **FEWER}.items():
            said = f"{name} = {value}"
            cell.source, times = re.subn(rf"^{name} = .*", said, cell.source, flags=re.MULTILINE)
            found += times * (name == "DURATION")
    assert found == 1, "one cell sets DURATION"


def folder(tmp_path):
    """Where the notebook runs: not in the project, which it must not need."""
    return {"metadata": {"path": str(tmp_path)}}
