"""Warnings point to the line of whoever called the package, however deep inside they arise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_saturation import pair
from test_step_error import rubbing

import synctrl
from synctrl import Cell, Coupling, Cubic, Experiment, Member, load_robot
from synctrl.errors import CouplingWarning, RobotWarning, SaturationWarning, StepWarning
from synctrl.robots.friction import Friction
from synctrl.robots.parameters import FrictionParameters

ARM = load_robot("planar2r")
ODD = Path(__file__).parent / "cases" / "urdf" / "effort_zero.urdf"
PATH = Cubic([0, 0], [1, 1], 1.0)


def simulate(experiment: Experiment) -> object:
    """A run by the function of the package."""
    return synctrl.simulate(experiment.cell, experiment.gains, experiment.duration, dt=1e-3)


def friction_twice() -> Cell:
    """Members that are told their friction by their parameters too."""
    parameters = FrictionParameters(ARM, Friction(viscous=0.1))
    member = Member(ARM, PATH, friction=Friction(viscous=0.1), parameters=parameters)
    return Cell([member, member], Coupling.pair())


CALLS = {
    "simulate": (StepWarning, lambda: simulate(rubbing(5.0))),
    "Experiment.simulate": (StepWarning, lambda: rubbing(5.0).simulate(dt=1e-3)),
    "a run that saturates": (SaturationWarning, lambda: pair(way=60.0).simulate()),
    "load_robot": (RobotWarning, lambda: load_robot(ODD)),
    "Coupling": (CouplingWarning, lambda: Coupling(2, [(0, 1), (0, 1)], [(1, -1)] * 2, np.ones(2))),
    "Coupling.from_graph": (CouplingWarning, lambda: Coupling.from_graph([(0, 1), (1, 0)])),
    "Coupling.ring": (CouplingWarning, lambda: Coupling.ring(3)),
    "Coupling.ring, two robots": (CouplingWarning, lambda: Coupling.ring(2)),
    "Cell": (DeprecationWarning, friction_twice),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_warning_points_to_the_line_that_called_the_package(name: str) -> None:
    category, call = CALLS[name]
    with pytest.warns(category) as caught:
        call()
    assert {Path(each.filename) for each in caught if each.category is category} == {Path(__file__)}
