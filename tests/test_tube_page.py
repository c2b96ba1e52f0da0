"""What docs/tube.md says of the ready cells, and its examples."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_pages import run

from synctrl import Cell, Experiment
from synctrl.analysis import Tube, tube
from synctrl.experiments import (
    a460_pair,
    bead_on_edge,
    mixed_four,
    mobile_robot,
    panda_four,
    planar_four,
    rigid_object,
    ur5_payload,
)

PAGE = (Path(__file__).parents[1] / "docs" / "tube.md").read_text("utf-8")
CELLS: dict[str, Callable[[], Experiment]] = {
    "a460_pair()": a460_pair,
    "a460_pair(friction=False)": lambda: a460_pair(friction=False),
    "a460_pair(adapt_friction=True)": lambda: a460_pair(adapt_friction=True),
    "mobile_robot(disturbed=False)": lambda: mobile_robot(disturbed=False),
    "mobile_robot()": mobile_robot,
    "rigid_object(disturbed=False)": lambda: rigid_object(disturbed=False),
    "rigid_object()": rigid_object,
    "planar_four()": planar_four,
    'planar_four(disturbance="torque")': lambda: planar_four(disturbance="torque"),
    "ur5_payload()": ur5_payload,
    "panda_four()": panda_four,
    "mixed_four()": mixed_four,
    "bead_on_edge()": bead_on_edge,
}
#: of what the page writes a number in: one of these in SI units
UNITS = {"deg": np.pi / 180, "mm": 1e-3, "rad": 1.0}


def rows() -> dict[str, tuple[str, str, str]]:
    """The lines of the first table: tube, error and answer by cell."""
    table = PAGE.partition("| cell | tube |")[2].partition("\n\n")[0]
    lines = (line.strip("| ").split(" | ") for line in table.splitlines()[2:])
    return {line[0].strip("`"): (line[1], line[2], line[3]) for line in lines}


def numbers(text: str) -> np.ndarray:
    """Numbers with their units, such as `4.78, 4.28 deg` or `190 mm, 0.922 rad`, in SI units."""
    found: list[float] = []
    for listed, unit in re.findall(r"([\d., ]+) (deg|mm|rad)", text):
        found += [float(number) * UNITS[unit] for number in re.findall(r"\d+\.?\d*", listed)]
    return np.array(found)


def told(one: Experiment, instants: int = 21, **changes: float) -> Tube:
    times = np.linspace(0.0, one.duration, instants)
    gains = one.gains.replace(**changes)
    return tube(one.cell, gains, duration=one.duration, disturbances=one.disturbances, times=times)


def test_the_table_has_the_ready_cells() -> None:
    assert list(rows()) == list(CELLS)


@pytest.mark.parametrize("name", CELLS)
def test_the_table_has_the_radii_and_the_answers(name: str) -> None:
    radius, _, answer = rows()[name]
    found = told(CELLS[name]())
    assert found.largest.max(0) == pytest.approx(numbers(radius), rel=0.01)
    said = {True: "yes", False: "no:", None: "no answer"}[found.excludes_singularities]
    assert answer.startswith(said) and found.closes is answer.startswith("yes")
    if found.excludes_half_turns is not None:
        assert found.excludes_half_turns is ("half turns are excluded" in answer)


@pytest.mark.parametrize("name", ["planar_four()", "rigid_object(disturbed=False)"])
def test_errors_are_those_of_runs(name: str) -> None:
    """They are largest within the first 0.3 s."""
    one = CELLS[name]()
    result = one.simulate(0.3, 1e-3)
    found = told(one).sizes(result.tracking_error).max((0, 1))
    assert found == pytest.approx(numbers(rows()[name][1]), rel=0.03)
    assert all((numbers(tube_) > numbers(error)).all() for tube_, error, _ in rows().values())


def nearer(one: Experiment, share: float) -> Experiment:
    """The cell with a first estimate of which only a share of the error is left."""
    off = [share * (np.asarray(m.theta_hat0) - m.theta) for m in one.cell.members]
    members = [replace(m, theta_hat0=m.theta + o) for m, o in zip(one.cell.members, off, strict=True)]
    return replace(one, cell=Cell(members, one.cell.coupling, one.cell.space))


def on_path(one: Experiment) -> Experiment:
    """The two UR5 where their paths begin."""
    module = sys.modules[ur5_payload.__module__]
    members = [
        replace(m, q0=module._start(m.robot, m.trajectory(0.0).x, np.zeros(6))) for m in one.cell.members
    ]
    return replace(one, cell=Cell(members, one.cell.coupling, one.cell.space))


def test_the_cells_that_do_not_close_do_so_with_the_changes_of_the_page() -> None:
    four, pushed = planar_four(), planar_four(disturbance="torque")
    assert told(four, Gamma=0.4).closes and told(four, K_r=3.0).closes and told(nearer(four, 0.5)).closes
    assert told(pushed, K_r=4.0, Gamma=0.4).closes
    held = rigid_object()
    assert told(held, K_r=1.0).closes and told(held, Lambda=20.0).closes
    arms = on_path(ur5_payload())
    strong = {"K_r": 10 * arms.gains.K_r, "Lambda": 5 * arms.gains.Lambda}
    assert told(nearer(arms, 0.001 / 0.3), **strong).closes
    assert not told(nearer(arms, 0.001 / 0.3)).closes


def test_its_examples_print_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    run("tube.md")
    printed = capsys.readouterr().out.splitlines()
    shown = [line.strip() for line in PAGE.splitlines() if line.startswith("    ")]
    assert printed[: len(shown)] == shown
    assert f"`{printed[-1]}`" in PAGE
