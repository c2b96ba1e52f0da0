"""The page about looking at results works as it stands there."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import synctrl.show
from synctrl.show.run_figures import FIGURES, OF_TASKS, ON_REQUEST

PAGE = (Path(__file__).parents[1] / "docs" / "looking.md").read_text("utf-8")


def test_the_page_runs_and_leaves_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    exec(compile(block, "docs/looking.md", "exec"), {})
    written = {str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*") if file.is_file()}
    single = {"run.npz", "cell.html", "figures/torque.pdf", "figures/torque.png"}
    single |= {"compared/tracking_error.png", "compared/tracking_error.svg"}
    assert written - single == {file for file in written if file.startswith("page/")} and single <= written
    assert {"page/index.html", "page/animation.html"} <= written


def test_the_page_names_all_figures():
    assert re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.MULTILINE) == [*FIGURES, *OF_TASKS, *ON_REQUEST]


def test_the_page_names_all_figures_of_the_proof():
    rows = re.findall(r"^\| `(\w+)\(.*\)` \| `(\w+)` \|", PAGE, flags=re.MULTILINE)
    modules = ("lyapunov_plots", "dissipation_figures", "modal_figures", "tube_figures", "rate_figures")
    assert [module for _, module in rows] == [*modules]
    assert all(hasattr(import_module(f"synctrl.show.{module}"), name) for name, module in rows)


def test_the_page_names_a_function_for_every_figure_of_a_run():
    pattern = r"^Each is a function of `synctrl.show`(.*?), all with"
    (words,) = re.findall(pattern, PAGE, re.MULTILINE | re.DOTALL)
    named = re.findall(r"`(\w+)`", words)
    assert len(named) == 12 and all(name in synctrl.show.__all__ for name in named)
