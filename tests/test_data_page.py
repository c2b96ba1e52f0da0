"""The page about results as data works as it stands there, and names what there is."""

from __future__ import annotations

import re
from pathlib import Path

from synctrl.simulation.exported import Exported

PAGE = (Path(__file__).parents[1] / "docs" / "data.md").read_text("utf-8")


def test_the_examples_of_the_page_run_one_after_another(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) >= 9
    names: dict = {}
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"block {number} of docs/data.md", "exec"), names)
    written = {file.name for file in (tmp_path / "out").iterdir()}
    assert written == {"run.nc", "run.csv", "run.mat", "run.mcap", "run.layout.json"}


def test_the_page_has_every_way_out_of_a_result():
    told = re.findall(r"^\| `result\.(\w+)\(", PAGE, flags=re.MULTILINE)
    assert {*told} == {name for name in vars(Exported) if name.startswith("to_")}


def test_the_page_names_the_topics_of_a_recording():
    from synctrl.export.pictures import CHANGING, FRAMES, GROWING, STILL

    told = re.findall(r"^\| `(/[\w/]+)`", PAGE, flags=re.MULTILINE)
    assert {FRAMES, STILL, CHANGING, GROWING} <= {*told}
