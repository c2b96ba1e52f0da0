"""Every ready cell is written as a file, and reads back to the same bits."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from cell_variants import CELLS, OWN, PARTS

from synctrl import Experiment
from synctrl.cells import read_cell, schema, write_cell
from synctrl.experiments import a460_pair
from synctrl.simulation.result import LAYOUT

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
JUDGE = jsonschema.Draft202012Validator(schema())
#: s, of a few steps
LONG, STEP = 4e-3, 1e-3


def ran(experiment: Experiment) -> tuple[dict[str, bytes], str]:
    """All numbers of a short run, to the last bit, and all that it says of itself."""
    sampled = bool(experiment.sensors or experiment.actuators)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = experiment.simulate(LONG, STEP, control_period=STEP if sampled else None)
    arrays = {name: getattr(result, name) for name in LAYOUT} | result.outputs
    return {name: array.tobytes() for name, array in arrays.items()}, repr(result.info)


def again(experiment: Experiment, path: Path) -> Experiment:
    """The experiment that a file gives back."""
    return read_cell(write_cell(experiment, path))


@pytest.mark.parametrize(
    ("make", "options"), CELLS, ids=[f"{make.__name__}-{k}" for k, (make, _) in enumerate(CELLS)]
)
def test_a_ready_cell_reads_back_to_the_same_bits(make: Any, options: dict[str, Any], tmp_path: Path) -> None:
    experiment, path = make(**options), tmp_path / "cell.toml"
    back = again(experiment, path)
    assert ran(back) == ran(experiment)
    JUDGE.validate(tomllib.loads(path.read_text("utf-8")))
    assert write_cell(back, tmp_path / "again.toml").read_text() == path.read_text()


@pytest.mark.parametrize("parts", PARTS, ids=[str(k) for k in range(len(PARTS))])
def test_a_part_reads_back_to_the_same_bits(parts: dict[str, Any], tmp_path: Path) -> None:
    experiment = a460_pair(**parts)
    back = again(experiment, tmp_path / "cell.toml")
    assert ran(back) == ran(experiment)


@pytest.mark.parametrize("name", OWN)
def test_a_cell_of_ones_own_reads_back_to_the_same_bits(name: str, tmp_path: Path) -> None:
    experiment = OWN[name]()
    back = again(experiment, tmp_path / "cell.toml")
    assert ran(back) == ran(experiment)
    assert [robot.name for robot in back.cell.robots] == [robot.name for robot in experiment.cell.robots]
