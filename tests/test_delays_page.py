"""The page about delays: its example runs, and its tables are what the package finds."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_pages import run
from ur5_joints import GAINS, ur5_joints

from synctrl.analysis import delay_margin, period_margin
from synctrl.experiments import a460_pair, mixed_four, panda_four, planar_four, ur5_payload
from synctrl.simulation.devices import DeadTime, DifferencedVelocity, Lag

PAGE = (Path(__file__).parents[1] / "docs" / "delays.md").read_text("utf-8")
READY: dict[str, Callable] = {
    "planar_four": planar_four,
    "a460_pair": lambda: a460_pair(friction=False),
    "panda_four": panda_four,
    "mixed_four": mixed_four,
    "ur5_payload": ur5_payload,
    "UR5 joints": lambda: SimpleNamespace(cell=ur5_joints(), gains=GAINS),
}
#: what stands in the loop, as the second table calls it
DEVICES = {
    "nothing": {},
    "control every 1 ms": {"control_period": 1e-3},
    "control every 1 ms, velocities by a filter of 500 rad/s": {
        "control_period": 1e-3,
        "sensors": [DifferencedVelocity(500.0)],
    },
    "control every 1 ms, velocities by a filter of 200 rad/s": {
        "control_period": 1e-3,
        "sensors": [DifferencedVelocity(200.0)],
    },
    "torque that lags by 1 ms": {"actuators": [Lag(1e-3)]},
    "dead time of 1 ms": {"actuators": [DeadTime(1e-3)]},
}


def rows(columns: int) -> dict[str, list[str]]:
    """The rows of the table with so many columns, by their first cell."""
    found = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line[:1] == "|"
    ]
    return {row[0]: row[1:] for row in found if len(row) == columns and not re.fullmatch("-+", row[0])}


def shown(seconds: float, beyond: str) -> str:
    return beyond if np.isinf(seconds) else f"{1e3 * seconds:.1f}"


def test_the_example_runs():
    names = run("delays.md")
    assert str(names["margin"]).startswith("stable below a delay of 21.4 ms, where joint 6 of robot 2 begins")
    assert names["margin"].growth(0.03) > 0 and 0 < names["longest"] < 1


def test_both_tables_have_all_of_their_rows():
    assert list(rows(8))[1:] == list(READY) and list(rows(2))[1:] == list(DEVICES)


@pytest.mark.parametrize("name", READY)
def test_a_cell_has_the_margins_of_the_table(name):
    ready = READY[name]()
    margin = delay_margin(ready.cell, ready.gains)
    receivers = (("hold", 1.0), ("extrapolate", 1.0), ("filter", 50.0), ("filter", 100.0), ("filter", 200.0))
    periods = [
        period_margin(ready.cell, ready.gains, receiver=receiver, omega=omega, longest=0.995)
        for receiver, omega in receivers
    ]
    found = [f"{min(margin.least_eigenvalue):.3f}", shown(margin.delay, "every")]
    assert rows(8)[name] == found + [shown(period, "> 995") for period in periods]


@pytest.mark.parametrize("name", DEVICES)
def test_devices_leave_the_margin_of_the_table(name):
    assert rows(2)[name] == [shown(delay_margin(ur5_joints(), GAINS, **DEVICES[name]).delay, "every")]


def test_four_planar_arms_are_as_slow_at_200_ms_as_the_page_says():
    paper = planar_four()
    assert -1 / delay_margin(paper.cell, paper.gains).growth(0.2) == pytest.approx(120, rel=0.02)  # s
