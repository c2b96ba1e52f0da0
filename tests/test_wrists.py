"""What is said of the distance of the wrists is what the desired paths and the runs make of it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from synctrl.experiments import a460_pair
from synctrl.experiments.a460_pair import FINAL, INITIAL, MOTION_TIME
from synctrl.paper.wrists import about_wrists, wrist_distance
from synctrl.tasks.trajectories import Cubic

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")


def test_the_desired_cubics_change_the_wrist_distance_by_ten_and_a_half_millimetres() -> None:
    """The ends are those of Table I, less than a millimetre apart; what changes it lies between them."""
    cell, t = a460_pair().cell, np.linspace(0, MOTION_TIME, 201)
    paths = [Cubic(start, end, MOTION_TIME) for start, end in zip(INITIAL, FINAL, strict=True)]
    q = np.stack([path(t).x for path in paths], axis=1)
    distance = wrist_distance(cell, q)
    assert np.ptp(distance) == pytest.approx(10.5e-3, abs=0.05e-3)
    assert abs(distance[-1] - distance[0]) < 1e-3
    assert 0.9 < t[distance.argmin()] < 1.1


def test_what_is_said_follows_the_runs() -> None:
    made = a460_pair()
    run = made.simulate(0.2, engine="compiled")
    exact = replace(run, x=run.x_desired)
    said = about_wrists({"synchronized": run, "without errors": exact}, made.cell)
    changes = re.search(r"at most ([\d.e-]+) mm synchronized and ([\d.e-]+) mm", said)
    assert changes is not None
    added, none = map(float, changes.groups())
    assert none == 0 < added
