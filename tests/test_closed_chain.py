"""What the theorems say of a closed chain, and what of a run is outside them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from synctrl.analysis import certify
from synctrl.assembly.body import with_share
from synctrl.assembly.grasp import Fixture
from synctrl.assembly.theorems import THEOREMS, shares
from synctrl.control.admittance import Admittance
from synctrl.control.laws import ChungSlotine
from synctrl.coupling.cell import Cell
from synctrl.errors import GainWarning, InputError
from synctrl.experiments import carry_ur5, planar_four
from synctrl.experiments.carry import GAINS
from synctrl.robots.robot import Robot
from synctrl.simulation.simulate import Experiment

HEAVY = Admittance(mass=(150.0, 3.0))


def chain(**options):
    return carry_ur5(**options).closed_loop().chain


@pytest.mark.parametrize(
    ("options", "number", "warned"),
    [
        ({}, 2, 0),
        ({"synchronized": False}, 2, 0),
        ({"geometric_error": True, "tare": True}, 2, 0),
        ({"geometric_error": True}, 0, 1),
        ({"geometric_error": True, "leak": True}, 0, 0),
        ({"geometric_error": True, "synchronized": False}, 0, 0),
        ({"geometric_error": True, "admittance": True}, 3, 0),
        ({"admittance": HEAVY}, 0, 1),
        ({"admittance": HEAVY, "synchronized": False}, 3, 0),
        ({"admittance": True, "leak": 1.0}, 0, 1),
        ({"admittance": True, "leak": 1.0, "gains": GAINS.replace(K_eps=2e4)}, 3, 0),
        ({"admittance": Admittance(mass=(0.0, 0.0))}, 0, 1),
        ({"admittance": Admittance(mass=(0.0, 0.0)), "synchronized": False}, 3, 0),
    ],
)
def test_the_theorem_that_covers_a_cell_and_the_conditions_that_do_harm(options, number, warned):
    found = chain(**options)
    assert found.theorem == THEOREMS[number]
    assert len(found.warnings) == warned and set(found.warnings) <= set(found.outside)
    assert bool(found.outside) == (number == 0)


def test_a_run_warns_of_what_does_harm_and_its_certificate_says_it():
    made = carry_ur5(geometric_error=True)
    with pytest.warns(GainWarning, match="tare"):  # a warning carries no data
        certificate = certify(made.simulate(3e-3, dt=1e-3))
    assert certificate.verdict != "certified" and certificate.theorem == THEOREMS[0]
    assert set(made.closed_loop().chain.outside) <= set(certificate.outside)
    assert THEOREMS[0] in str(certificate) and certificate.as_dict()["theorem"] == THEOREMS[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error", GainWarning)
        assert certify(carry_ur5().simulate(3e-3, dt=1e-3)).theorem == THEOREMS[2]


def test_arms_that_hold_nothing_are_in_no_closed_chain():
    assert planar_four().closed_loop().chain is None


def test_another_law_and_an_object_that_is_nobodys_load_are_outside():
    another = carry_ur5(law=ChungSlotine(K_2=1.0)).closed_loop().chain
    assert len(another.outside) == 1 and "ChungSlotine" in another.outside[0]
    made = carry_ur5()
    found = replace(made, cell=modelled_as(made, made.plant_type.keywords["robots"])).closed_loop().chain
    assert len(found.outside) == 1 and not found.warnings


def test_the_shares_of_both_arms_are_the_halves_of_the_payload():
    plant = carry_ur5().closed_loop().plant
    halves = np.tile(0.5 * plant.body.parameters, (2, 1))
    np.testing.assert_allclose(shares(plant), halves, atol=1e-5 * plant.body.mass)


def test_shares_that_do_not_add_up_are_refused():
    made = carry_ur5()
    kept = made.plant_type.keywords
    d, G = kept["grasps"][0].object_in_hand
    more = with_share(kept["robots"][0], 0.6 * kept["body"].parameters, d, G)
    with refused(InputError, "shares"):
        replace(made, cell=modelled_as(made, [more, made.cell.robots[1]]))


def modelled_as(made: Experiment, robots: Sequence[Robot]) -> Cell:
    """The cell with the inertial parameters of these robots."""
    members = [
        replace(m, robot=m.robot.with_parameters(robot.inertial_parameters), theta_hat0=None)
        for m, robot in zip(made.cell.members, robots, strict=True)
    ]
    return Cell(members, made.cell.coupling, made.cell.space)


def test_fixtures_softer_than_their_damping_at_the_rate_of_the_integral_are_refused():
    soft = Fixture((1e5, 5.0), (500.0, 3.0))  # Lambda D is 18 N m/rad
    with refused(InputError, "grasp, compliance", found=5.0):
        carry_ur5(grasp=soft)
    carry_ur5(grasp=soft, leak=True), carry_ur5(grasp=soft, synchronized=False)


def test_leaks_beyond_lambda_are_refused_in_a_closed_chain_too():
    with refused(InputError, "leak", found=7.0):
        carry_ur5(leak=7.0)
    with refused(InputError, "leak"):
        carry_ur5(leak=-1.0)
