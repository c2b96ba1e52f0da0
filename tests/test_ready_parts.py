"""Every ready cell takes an adaptation and a law, and one that does not suit it is refused by name."""

from __future__ import annotations

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
