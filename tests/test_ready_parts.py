"""Every ready cell takes an adaptation and a law, and one that does not suit it is refused by name."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from synctrl import experiments
from synctrl.control.adaptation import Natural
from synctrl.control.laws import SlotineLi
from synctrl.errors import InputError

CELLS = [name for name in experiments.__all__ if name != "quadratic_analysis"]
WITHOUT_BODIES = {"planar_four": "robot 1", "rigid_object": "robot 1", "mobile_robot": "left wheel"}
DIFFERENT = {"mixed_four"}  # its robots have different numbers of bodies
ALONE = {"bead_on_path": {"mode": "independent"}}  # how a cell is told that its robots are on their own


@pytest.mark.parametrize("name", CELLS)
def test_a_ready_cell_takes_a_law(name):
    experiment = getattr(experiments, name)(law=SlotineLi(), **ALONE.get(name, {"synchronized": False}))
    assert experiment.closed_loop().controller.law_settings["name"] == "SlotineLi"


@pytest.mark.parametrize("name", sorted({*CELLS} - {*WITHOUT_BODIES} - DIFFERENT))
def test_a_ready_cell_of_bodies_takes_an_adaptation_of_bodies(name):
    experiment = getattr(experiments, name)(adaptation=Natural(0.1))
    assert experiment.closed_loop().controller.adaptation_settings["name"] == "Natural"


@pytest.mark.parametrize("name", WITHOUT_BODIES)
def test_a_ready_cell_without_bodies_refuses_an_adaptation_of_bodies_and_names_the_robot(name):
    with refused(InputError, f"{WITHOUT_BODIES[name]}, adaptation"):
        getattr(experiments, name)(adaptation=Natural(0.1))


@pytest.mark.parametrize("name", ["carry_ur5", "carry_planar"])
@pytest.mark.parametrize("option", ["leak", "geometric_error", "admittance"])
def test_yes_and_no_may_be_said_by_numpy(name, option):
    for answer in (True, False):
        plain, other = (getattr(experiments, name)(**{option: said}) for said in (answer, np.bool_(answer)))
        assert (other.admittance is None) == (plain.admittance is None)
        assert np.array_equal(other.gains.leak, plain.gains.leak)
        for one, two in zip(other.cell.members, plain.cell.members, strict=True):
            assert np.array_equal(one.robot.tip_position(one.q0), two.robot.tip_position(two.q0))
            assert np.array_equal(one.trajectory(0.0).x, two.trajectory(0.0).x)
