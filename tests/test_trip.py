"""The trip of a joint position to a torque is short: functions of the package that are called on the way."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import synctrl
from synctrl import Cell, Coupling, Experiment
from synctrl.experiments import a460_pair, planar_four

PACKAGE = str(Path(synctrl.__file__).parent)
PAGE = (Path(__file__).parents[1] / "docs" / "architecture.md").read_text("utf-8")
#: functions of the package from q to tau
DOZEN = 12


def calls(function: Callable, *arguments) -> list[str]:
    """Names of the functions of the package that run while one is called, in order."""
    found: list[str] = []

    def note(frame, event: str, _) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(PACKAGE):
            found.append(frame.f_code.co_qualname)

    sys.setprofile(note)
    try:
        function(*arguments)
    finally:
        sys.setprofile(None)
    return found


def trip(experiment: Experiment) -> list[str]:
    """What `Controller.signals` calls until it knows the torque; then comes the adaptation's `rate`."""
    loop = experiment.closed_loop()
    y = loop.state(loop.initial_state())
    state = loop.cell.references(np.zeros(1))[0], y.motion, y.z, y.memory
    loop.controller.signals(*state)  # what is made once is made
    _, *called = calls(loop.controller.signals, *state)
    (learning,) = (k for k, name in enumerate(called) if name.endswith(".rate"))
    return called[:learning]


@pytest.mark.parametrize("make", [planar_four, a460_pair])
def test_from_joint_positions_to_torque_it_is_a_dozen_calls_at_most(make: Callable[[], Experiment]) -> None:
    assert len(trip(make())) <= DOZEN


def times(k: int, experiment: Experiment) -> Experiment:
    """An experiment with k times as many robots."""
    members = [replace(member, name=None) for member in k * experiment.cell.members]
    cell = Cell(members, Coupling.signed_ring(len(members)), experiment.cell.space)
    return replace(experiment, cell=cell)


def test_robots_of_one_forest_share_the_trip_and_more_of_them_cost_no_more_calls_each() -> None:
    assert trip(times(2, planar_four())) == trip(planar_four())
    few, many = (len(trip(times(k, planar_four()))) / k for k in (6, 24))
    assert many < few


def test_every_station_is_in_the_file_that_the_page_says() -> None:
    stations = re.findall(r"^\| \d+ \| `(\w+)[\w.]*` \| `([\w/]+\.py)` \|", PAGE, flags=re.MULTILINE)
    assert len(stations) >= len(trip(planar_four())) - 1
    for name, file in stations:
        text = (Path(PACKAGE) / file).read_text("utf-8")
        assert re.search(rf"^(class|def) {name}\b", text, flags=re.MULTILINE), (name, file)


def test_every_station_of_the_trip_is_called_once() -> None:
    names = trip(planar_four())
    assert len(set(names)) == len(names)


def test_calls_inside_calls_are_counted() -> None:
    cell = a460_pair().cell
    cell.references(np.zeros(1))
    once, twice = (calls(lambda n=n: [cell.references(np.zeros(1)) for _ in range(n)]) for n in (1, 2))
    assert {"Cell.reference_table", "Cell.weights"} <= set(once)
    assert len(twice) == 2 * len(once)
