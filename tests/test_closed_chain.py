"""What the theorems say of a closed chain, and what of a run is outside them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from held import carried_along, evaluate_held
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl.analysis import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.analysis.replay import state_at
from synctrl.assembly.body import with_share
from synctrl.assembly.grasp import Fixture, grasp_matrix
from synctrl.assembly.theorems import THEOREMS, shares
from synctrl.control.admittance import Admittance
from synctrl.control.laws import ChungSlotine
from synctrl.coupling.cell import Cell, Member
from synctrl.errors import GainWarning, InputError
from synctrl.experiments import carry_ur5, planar_four
from synctrl.experiments.carry import GAINS
from synctrl.robots.robot import Robot
from synctrl.simulation.simulate import Experiment
from synctrl.tasks.rotations import exp
from synctrl.tasks.trajectories import Hold

HEAVY = Admittance(mass=(150.0, 3.0))


@given(st.integers(0, 2**32 - 1))
def test_the_power_of_fixtures_is_the_rate_of_an_energy_and_losses(seed):
    """sum (J s_i - s_o) h_i = -W' - losses, with h = K d + D d', in one direction and for any S."""
    rng = np.random.default_rng(seed)
    S, (K, D, Lambda, beta) = rng.normal(size=(3, 4)), rng.uniform(0.1, 5, 4)
    leak, L = rng.uniform(0, Lambda), S.T @ S
    L_plus, A = np.linalg.pinv(L), Lambda * np.eye(4) + beta * L
    d, d_dot, E = rng.normal(size=4), rng.normal(size=4), L @ rng.normal(size=4)
    E_dot, rest = -L @ d - leak * E, (Lambda - leak) * beta
    power = (-d_dot - A @ d + rest * E) @ (K * d + D * d_dot)
    rate = K * d @ d_dot + D * d @ A @ d_dot - rest * D * (d_dot @ E + d @ E_dot)
    rate += rest * (K + leak * D) * E @ L_plus @ E_dot
    lost = D * d_dot @ d_dot + Lambda * K * d @ d + (K - (Lambda - leak) * D) * beta * d @ L @ d
    lost += leak * rest * (K + leak * D) * E @ L_plus @ E
    assert power == pytest.approx(-rate - lost, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"leak": 3.0},
        {"leak": True, "gains": GAINS.replace(K_eps=[2e4] * 3 + [200.0] * 3)},
        {"geometric_error": True, "admittance": True},
        {"geometric_error": True, "tare": True, "synchronized": False, "admittance": True},
    ],
)
def test_fixtures_and_an_admittance_take_from_v_and_every_power_has_its_name(options):
    record = lyapunov(carry_ur5(**options).simulate(0.02, dt=1e-3))
    rounding, powers = record.rounding, record.power
    assert record.closes
    assert (np.abs(powers["other"]) <= rounding).all()
    assert (powers["fixtures"] <= rounding).all() and powers["fixtures"].min() < -0.1
    assert (record.V_dot <= rounding).all()
    giving = [record.energy["fixtures"]]
    if "admittance" in options:
        giving.append(record.energy["admittance"])
        assert (powers["admittance"] <= 0).all() and powers["admittance"].min() < 0
    assert min(energy.min() for energy in giving) >= 0


def test_of_the_independent_controller_fixtures_lose_what_the_theorem_says():
    """d'^T D d' + Lambda d^T K d at the grasps, to the first order in deflections that are small."""
    made = carry_ur5(synchronized=False)
    result = made.simulate(0.03, dt=1e-3)
    loop, record = made.closed_loop(), lyapunov(result)
    for k in (10, 20, 30):
        y = loop.state(state_at(result, k))
        signals = loop.look(loop.cell.references(result.t[k : k + 1])[0], y)
        d, d_dot = loop.chain.energies._deflections(y, signals)
        G = grasp_matrix(loop.plant._levers(y.hidden))
        d, d_dot = np.vecmat(d, G), np.vecmat(d_dot, G)
        lost = np.sum(d_dot * loop.plant.D * d_dot) + np.sum(loop.controller.Lambda * d * loop.plant.K * d)
        assert record.power["fixtures"][k] == pytest.approx(-lost, rel=0.03)


def with_changed(made: Experiment, memory: np.ndarray, gave: np.ndarray) -> tuple:
    """Power of the fixtures after 30 ms, with other integrals and arms that gave way; and of what it is."""
    loop, result = made.closed_loop(), made.simulate(0.03, dt=1e-3)
    y = loop.state(state_at(result, -1))
    y.memory[...], y.z[:, -12:] = memory, gave
    signals = loop.look(loop.cell.references(result.t[-1:])[0], y)
    terms = loop.chain.energies.terms(y, np.zeros_like(y.q), signals)
    return terms.powers["fixtures"], loop, y, signals


def test_integrals_that_leak_lose_to_fixtures_what_the_theorem_says():
    made = carry_ur5(admittance=True, leak=3.0, gains=GAINS.replace(K_eps=2e4))
    memory, none = np.zeros((1, 6)), np.zeros((2, 12))
    alone = with_changed(made, memory, none)[0]
    memory[:, :3] = 0.05 * np.random.default_rng(0).normal(size=3)
    found, _, _, signals = with_changed(made, memory, none)
    E = signals.E[:, :3] * [[1.0], [-1.0]]  # without the weights of the pair
    L_plus, (K, D) = np.array([[1.0, -1.0], [-1.0, 1.0]]) / 4, (1e5, 500.0)
    assert found - alone == pytest.approx(
        -3.0 * 3.0 * 6.0 * (K + 3.0 * D) * np.sum(E * (L_plus @ E)), rel=1e-2
    )


def test_an_admittance_stores_what_forces_inside_give_it_and_the_load_is_left():
    """Through y' + A y hands have the power of the load beside that of forces inside."""
    made, rest, none = carry_ur5(admittance=True), np.zeros((1, 6)), np.zeros((2, 12))
    alone, loop, y, _ = with_changed(made, rest, none)
    one = np.random.default_rng(0).normal(size=(2, 6)) * [[0.02], [0.1]]
    one[:, 3:] = 0.0
    found = with_changed(made, rest, np.stack((one.ravel(), -one.ravel())))[0]
    h = np.matvec(grasp_matrix(loop.plant._levers(y.hidden)), loop.plant._wrenches(y.q, y.v, y.hidden)[0])
    load = h - loop.plant.felt(y.q, y.v, y.hidden)
    R_d = exp(loop.cell.references(np.array([0.03]))[0].xd[0, 3:])
    moved = R_d @ (one[1] + (6.0 + 2 * 6.0) * one[0])[:3]  # A y = (Lambda + 2 beta) y
    inside = float(moved @ (h - load)[0, :3] - moved @ (h - load)[1, :3])
    left = float(moved @ (load[0] - load[1])[:3])
    assert found - alone == pytest.approx(left, abs=0.02 * abs(inside))


@pytest.mark.parametrize(
    ("options", "vanishes"),
    [({}, True), ({"geometric_error": True}, False), ({"geometric_error": True, "tare": True}, True)],
)
def test_forces_inside_have_no_power_through_velocity_errors_where_arms_agree(options, vanishes):
    """Of a rigid loop, whatever the forces are: both reference motions are one rigid motion."""
    made, exact = carry_ur5(**options), carry_ur5().cell
    rng = np.random.default_rng(1)
    q, v = carried_along(carry_ur5(), 0.01 * rng.normal(size=6), 0.1 * rng.normal(size=6))
    _, s = evaluate_held(made, q, v)
    inside = 30.0 * rng.normal(size=6)
    moved = [robot.jacobian(q_i) @ s_i for robot, q_i, s_i in zip(exact.robots, q, s.s_q, strict=True)]
    power = (moved[0] - moved[1]) @ inside
    assert abs(power) < 1e-9 if vanishes else abs(power) > 1e-2


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
    assert certificate.verdict != "covered by the theorem" and certificate.theorem == THEOREMS[0]
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


def test_the_theorems_are_about_the_pose_of_an_object_in_hands_that_stay_closed():
    made = carry_ur5(geometric_error=True)
    loop = made.closed_loop()
    loop.plant.events = (0.1,)
    changing = loop.plant.chain(loop.controller)
    assert len(changing.outside) == 1 and not changing.warnings and changing.energies is None
    robots = made.plant_type.keywords["robots"]
    members = [Member(r, Hold(q), q0=q) for r, q in zip(robots, made.cell.q0, strict=True)]
    found = replace(made, cell=Cell(members, made.cell.coupling)).closed_loop().chain
    assert len(found.outside) == 1 and found.energies is None and found.theorem == THEOREMS[0]
