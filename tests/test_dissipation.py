"""Theorem A: what unmodelled torque can do at most, beside what it did."""

from __future__ import annotations

import numpy as np
import pytest
from theory_cells import GAINS, coupling, experiment

from synctrl import Disturbance, Friction
from synctrl.analysis import Dissipation, dissipation
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import replay

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")  # odd rings are meant
PUSH = Disturbance(robot=0, torque=2.0, start=0.01, stop=0.03)
SOURCES = {
    "friction": {"friction": Friction(0.5, 0.3, 0.1)},
    "disturbance": {"disturbances": (PUSH,)},
    "model error": {"gains": GAINS.replace(Gamma=0.0)},
    "weight rate": {"reference_acceleration": "paper"},
}


def keeps(found: Dissipation) -> bool:
    """Whether a run stays below what the theorem promises."""
    return found.reason is None and found.X_bound >= found.X and found.rest_bound >= found.rest


@pytest.mark.parametrize("source", SOURCES)
def test_what_acts_is_named_and_stays_below_the_bound(source: str) -> None:
    run = replay(experiment(coupling("ring", 4, 2, "moving"), **SOURCES[source]).simulate(0.05, 1e-3))
    found, record = dissipation(run), lyapunov(run)
    assert keeps(found)
    assert [name for name, D in found.sources.items() if D > 1e-12] == [source]
    assert found.supply[-1] == pytest.approx(record.supplied[source], rel=1e-9)
    assert np.abs(found.gap).max() <= record.drift_bound
