"""A newcomer who does what the pages of the chapter Start say gets through: every block runs, in order."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import pytest

from synctrl.errors import StepWarning

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs" / "start").glob("*.md"))
#: a block, its language, and the text before it
BLOCK = re.compile(r"(?ms)^```(\w+)\n(.*?)^```$")
#: what a block is to be saved as, if the text before it says so
SAVED = re.compile(r"[Ss]ave (?:this|it) as `([\w.]+)`")
#: what takes long, and what takes its place
SHORTER = {
    "simulate(duration=2.0)": "simulate(duration=0.7)",
    "simulate(2.0)": "simulate(0.3)",
    "synctrl doctor": "synctrl doctor --no-trial",
    "synctrl run": "synctrl run --duration 0.3",
    "synctrl compare": "synctrl compare --duration 0.3",
}
#: commands of the shell that prepare a machine; what they name is looked at below
PREPARING = ("python3 -m venv", ". .venv", "pip install")
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]


def blocks(page: Path) -> list[tuple[str, str, str]]:
    """(text before it, language, code) of every block."""
    text, found, end = page.read_text("utf-8"), [], 0
    for block in BLOCK.finditer(text):
        found.append((text[end : block.start()], block[1], block[2]))
        end = block.end()
    return found


def shell(code: str) -> None:
    """Run the commands of synctrl in a block, each as a process."""
    for line in code.splitlines():
        if line.startswith(PREPARING):
            continue
        word, *arguments = line.split()
        assert word == "synctrl", f"who runs {line}?"
        command = [sys.executable, "-c", "from synctrl.cli import main; main()", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"


def follow(page: Path) -> dict:
    """Do what a page says, in this folder; the names that its Python leaves."""
    names: dict = {"__name__": "__main__"}
    for number, (before, language, code) in enumerate(blocks(page), start=1):
        for long, short in SHORTER.items():
            code = code.replace(long, short)
        saved = SAVED.search(before)
        if saved and language in ("toml", "xml"):
            Path(saved[1]).write_text(code, encoding="utf-8")
        elif language == "sh":
            shell(code)
        else:
            assert language == "python", f"block {number} of {page.name}: nobody knows {language}"
            exec(compile(code, f"block {number} of docs/start/{page.name}", "exec"), names)
    return names


@pytest.fixture(scope="module")
def followed(tmp_path_factory) -> dict[str, tuple[Path, dict]]:
    """All pages, each followed in a folder of its own."""
    found = {}
    for page in PAGES:
        with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", StepWarning)
            folder = tmp_path_factory.mktemp(page.stem)
            patch.chdir(folder)
            found[page.stem] = folder, follow(page)
    return found


def test_there_are_the_five_pages_and_each_says_what_is_learned_and_what_comes_next():
    assert {page.stem for page in PAGES} == {"install", "first_run", "your_cell", "your_robot", "results"}
    for page in PAGES:
        text = page.read_text("utf-8")
        assert re.search(r"(?m)^What you will ", text), page.name
        assert re.search(r"(?m)^Next: ", text), page.name


def test_every_page_can_be_followed_from_its_first_block_to_its_last(followed):
    assert set(followed) == {page.stem for page in PAGES}


def test_the_first_run_shows_that_synchronized_arms_stay_together(followed):
    folder, names = followed["first_run"]
    together, alone = (abs(names[name].sync_error).max() for name in ("together", "alone"))
    assert together < alone
    for name in ("out/first/index.html", "out/figures/sync_error.png", "out/both.html"):
        assert (folder / name).is_file(), name


def test_the_cell_of_the_page_is_better_with_the_gains_that_it_asks_for(followed):
    _, names = followed["your_cell"]
    guessed, suggested = (abs(run.sync_error).max() for run in names["runs"].values())
    assert suggested < guessed and names["run"].status == "completed"


def test_the_lifts_of_the_page_are_covered_by_the_theorem(followed):
    _, names = followed["your_robot"]
    assert names["certify"](names["run"]).verdict == "covered by the theorem"
    assert names["run"].units("tau")[0] == ("N", "N·m")


def test_the_run_of_the_page_about_results_means_what_the_page_says(followed):
    folder, names = followed["results"]
    page = next(page for page in PAGES if page.stem == "results").read_text("utf-8")
    told = re.findall(r"(?m)^\| ((?:`\w+`(?:, )?)+) \| \(", page)
    arrays = {name for group in told for name in re.findall(r"`(\w+)`", group)}
    assert arrays == {name for name in vars(names["run"]) if name not in ("info", "outputs", "experiment")}
    assert names["certificate"].verdict == "covered by the theorem"
    assert (folder / "out" / "page" / "index.html").is_file()


def test_the_extras_that_the_page_about_installing_names_are_those_that_there_are():
    page = next(page for page in PAGES if page.stem == "install").read_text("utf-8")
    named = {name for row in re.findall(r"(?m)^\| (`.*?) \|", page) for name in re.findall(r"`(\w+)`", row)}
    asked = {name for group in re.findall(r"pip install '\.\[(.*?)\]'", page) for name in group.split(",")}
    assert asked <= set(EXTRAS)
    assert {name for name in named if name in EXTRAS} == set(EXTRAS) - {"benchmark", "docs", "test", "dev"}
