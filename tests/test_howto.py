"""Every How-to page answers one question, its blocks run, and what they print is on the page."""

from __future__ import annotations

import re
import warnings
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {path.stem: path.read_text("utf-8") for path in sorted((DOCS / "howto").glob("*.md"))}
#: a block, with the file that it is if the line before names one
BLOCK = re.compile(r"(?:`([\w.]+)`:\n\n)?```(\w+)\n(.*?)```", flags=re.DOTALL)
#: packages that pages need, beside the package's own
NEEDS = {
    "compare_laws": ("casadi",),
    "faster": ("casadi",),
    "resume_sweep": ("casadi", "joblib", "pandas"),
    "own_law": ("casadi",),
    "trust": ("casadi", "mujoco"),
    "export": ("h5netcdf", "mcap", "pandas", "xarray"),
}


def told(kind: str, body: str, names: dict, page: str) -> str | None:
    """What a block prints; None of one that is no Python."""
    if kind != "python":
        return None
    out = StringIO()
    with redirect_stdout(out):
        exec(compile(body, f"docs/howto/{page}.md", "exec"), names)
    return out.getvalue().rstrip()


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_run_and_print_what_the_page_shows(page, tmp_path, monkeypatch):
    for package in NEEDS.get(page, ()):
        pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    names, printed = {"__name__": "__main__"}, ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for file, kind, body in BLOCK.findall(PAGES[page]):
            if file:
                (tmp_path / file).write_text(body)
            if kind == "text":
                assert body.rstrip() == printed
            printed = told(kind, body, names, page) or printed * (kind != "python")
    ours = {each.category.__name__ for each in caught if "synctrl" in each.category.__module__}
    assert all(name in PAGES[page] for name in ours), [str(each.message) for each in caught]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_one_question_and_an_answer_that_runs(page):
    first, *rest = PAGES[page].splitlines()
    assert re.fullmatch(r"# [A-Z].*\?", first)
    assert not any(
        line.startswith("# ")
        for line in re.sub(r"```.*?```", "", "\n".join(rest), flags=re.DOTALL).splitlines()
    )
    assert "```python\n" in PAGES[page]


def test_there_are_pages_enough_to_be_of_use():
    assert len(PAGES) >= 12
