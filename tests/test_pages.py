"""The examples of pages that have no test of their own run, on runs that are shorter and fewer."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from synctrl.errors import StepWarning

DOCS = Path(__file__).parents[1] / "docs"
#: what takes long, and what takes its place
SHORTER = {
    "samples=1000": "samples=2",
    "workers=2": "workers=1",
    "sweep.simulate(17)": "sweep.simulate(1)",
    "duration=2.0": "duration=0.02",
    'minimize="sync_rms"': 'minimize="sync_rms", generations=1, population=5, workers=1',
    'sweep.run("out/first", backend="dask")': 'sweep.run("out/second", backend="serial")',
    "simulate(0.2,": "simulate(0.01,",
    "duration=0.5": "duration=0.02",
}


def run(page: str) -> dict:
    """The names that the blocks of a page leave, run one after another."""
    text, names = (DOCS / page).read_text("utf-8"), {"__name__": "__main__"}
    for long, short in SHORTER.items():
        text = text.replace(long, short)
    for number, block in enumerate(re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL), start=1):
        exec(compile(block, f"block {number} of docs/{page}", "exec"), names)
    return names


def test_the_examples_about_sweeps_run(tmp_path, monkeypatch):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    pytest.importorskip("xarray", reason="xarray is an extra: pip install 'synctrl[sweep]'")
    monkeypatch.chdir(tmp_path)
    names = run("sweeps.md")
    assert len(names["table"]) == 2 and (tmp_path / "out" / "second" / "table.csv").is_file()
    assert names["best"].measures["peak_torque"] <= 1.0


def test_the_examples_about_sensors_and_actuators_run():
    names = run("devices.md")
    assert names["lost"].any() and names["skipping"].status == "completed"
    changes = np.diff(names["skipping"].outputs["measured_q"][:, 0, 1]) != 0
    assert (~changes).nonzero()[0].tolist() == [k - 1 for k in range(1, 51) if k % 5 == 4]


@pytest.mark.parametrize(
    ("page", "part", "name"), [("laws", "law", "ChungSlotine"), ("adaptation", "adaptation", "Natural")]
)
def test_the_example_with_gains_of_ones_own_runs(page, part, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        result = run(f"{page}.md")["result"]
    assert result.status == "completed" and result.info[part]["name"] == name


@pytest.fixture(scope="module")
def held_objects() -> dict:
    return run("assembly.md")


def test_in_the_example_about_held_objects_either_hand_has_half_of_the_weight(held_objects):
    force = held_objects["held"].outputs["hand_wrench"][-1, :, :3]
    half = -0.5 * held_objects["plate"].mass * np.array(held_objects["arm"].gravity_vector)
    np.testing.assert_allclose(force, [half, half], atol=1e-3)


def test_the_example_about_held_objects_has_the_outputs_that_the_page_names(held_objects):
    names = held_objects
    assert names["squeeze"].shape == names["result"].t.shape
    told = set(re.findall(r"`((?:object|hand|internal)_\w+)`", (DOCS / "assembly.md").read_text("utf-8")))
    assert told == {name for name in names["result"].outputs if name != "plant_state"}
    section = (DOCS / "assembly.md").read_text("utf-8").partition("## Two beads")[2].partition("\n## ")[0]
    beads = set(re.findall(r"`((?:gap_error|bead_(?!on_)|speed_)\w*)`", section))
    assert beads == set(names["laid"].outputs) and names["gap_error"].shape == names["laid"].t.shape
