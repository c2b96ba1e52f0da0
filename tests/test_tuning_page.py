"""The page about tuning: its examples run, and what it names is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import test_pages

from synctrl.tune import Tuned
from synctrl.tune.goals import MEASURED

PAGE = (Path(__file__).parents[1] / "docs" / "tuning.md").read_text("utf-8")


def test_the_examples_of_the_page_run(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    pytest.importorskip("pandas", reason="pip install 'synctrl[sweep]'")
    pytest.importorskip("optuna", reason="pip install 'synctrl[tune]'")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(
        test_pages.SHORTER, 'folder="out/front"', 'folder="out/front", generations=1, population=5, workers=1'
    )
    names = test_pages.run("tuning.md")
    assert len(names["table"]) == 10 and names["table"]["front"].sum() == len(names["found"].front)
    assert {path.name for path in (tmp_path / "out" / "front").glob("front.*")} == {
        "front.csv",
        "front.png",
        "front.svg",
    }


def test_the_attributes_and_goals_that_the_page_names_are_there():
    shown = {
        name for line in PAGE.splitlines() if line.startswith("| `") for name in re.findall(r"\.(\w+)", line)
    }
    named = {name for name in shown if name not in ("csv",)}
    fields = {*Tuned.__dataclass_fields__, *dir(Tuned)}
    assert {"front", "best", "chosen", "history", "to_pandas", "save_front"} <= named <= fields
    goals = re.findall(r"(?:minimize=\(|maximize=|limits=\{)(.*?)[)},\n]+\n", PAGE)
    assert {name for text in goals for name in re.findall(r'"(\w+)"', text)} <= {*MEASURED} and len(
        goals
    ) >= 3
