"""The page about cell files is true: its files are read and run, and its Python runs."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from synctrl.cells import STARTER, read_cell_file, schema, toml
from synctrl.cells.file import CellTable
from synctrl.cells.motions import MOTIONS

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "cell_files.md").read_text("utf-8")
BLOCKS = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)


def whole(block: str) -> dict[str, Any]:
    """A file of which a block says a part: the rest is that of the starter."""
    said = tomllib.loads(block)
    if "coupling" in said and "robots" in said:
        return said
    data = {**tomllib.loads(STARTER), **said}
    robots = said.get("robots", data["robots"])
    if len(robots) == 1:
        joint = robots[0]["robot"] != "planar2r"
        second = {**robots[0], "name": "right", "base": {"xyz": [0.7, 0.0, 0.0]}} if joint else data["robots"]
        robots = [robots[0], second if joint else tomllib.loads(STARTER)["robots"][1]]
        data |= {"space": "joint", "disturbances": []} if joint else {}
    return {**data, "robots": robots}


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_a_file_of_the_page_is_read_and_runs(block: str, tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(toml.document(whole(block)), "utf-8")
    experiment, run = read_cell_file(path)
    assert experiment.simulate(6e-3, **run).status == "completed"


def test_the_python_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cell.toml").write_text(BLOCKS[0].replace("duration = 4.0", "duration = 0.02"), "utf-8")
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) == 4
    for block in blocks:
        exec(compile(block, "docs/cell_files.md", "exec"), {})


def test_the_first_file_has_twenty_lines() -> None:
    assert len([line for line in BLOCKS[0].splitlines() if line]) <= 20


def test_the_page_names_every_table_and_only_keys_that_there_are() -> None:
    keys = {*CellTable.model_fields}
    overview = PAGE.partition("| at the top |")[2].partition("\n\n")[0]
    named = {
        name
        for cell in re.findall(r"^\| (.*?) \|", overview, flags=re.MULTILINE)
        for name in re.findall(r"[a-z_]+", cell)
    }
    assert keys - named == {"form"}


def test_the_keys_of_motions_are_those_of_the_page() -> None:
    table = PAGE.partition("| `kind` | motion | keys")[2].partition("\n\n")[0]
    told = dict(re.findall(r"^\| `([\w-]+)` \|.*\| (.*?) \|$", table, flags=re.MULTILINE))
    fields = {kind.name: kind for kind in MOTIONS}
    assert len(told) == 12
    for name, cell in told.items():
        assert re.findall(r"`(\w+)`", cell) == list(fields[name].fields)
        needed, _, _ = cell.partition(";")
        model = fields[name].model.model_fields
        assert re.findall(r"`(\w+)`", needed) == [
            key for key in fields[name].fields if model[key].is_required()
        ]


def test_the_starter_shows_what_synchronization_is_for(tmp_path: Path) -> None:
    """The arms stay together although one is pushed: without coupling they come apart much farther."""
    apart = []
    for beta, K_eps in ((10.0, 20.0), (0.0, 0.0)):
        text = STARTER.replace("beta = 10.0", f"beta = {beta}").replace("K_eps = 20.0", f"K_eps = {K_eps}")
        (tmp_path / "cell.toml").write_text(text.replace("duration = 6.0", "duration = 2.5"), "utf-8")
        experiment, run = read_cell_file(tmp_path / "cell.toml")
        apart.append(abs(experiment.simulate(**run).sync_error).max())
    together, alone = apart
    assert 3 * together < alone


def test_the_page_of_keys_is_what_the_schema_says() -> None:
    found = runpy.run_path(str(ROOT / "scripts" / "cell_keys.py"))
    page = found["Page"](schema())
    assert not page.missing()
    assert found["PAGE"].read_text("utf-8") == page.text()
