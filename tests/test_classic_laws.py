"""The laws that synchronization is compared with: each does what its statement says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Controller, Coupling, Experiment
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.laws import ChungSlotine, ComputedTorque, MasterSlave, PDGravity, SlotineLi, SunMills
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, panda_four, planar_four
from synctrl.simulation.result import LAYOUT

SEEDS = st.integers(0, 2**32 - 1)
LAWS = {
    "SlotineLi": SlotineLi(),
    "ComputedTorque": ComputedTorque(),
    "PDGravity": PDGravity(50.0),
    "MasterSlave": MasterSlave(),
}


def under(law, experiment: Experiment, **gains) -> Experiment:
    return replace(experiment, law=law, gains=experiment.gains.independent().replace(**gains))


def knowing(experiment: Experiment, share: float = 1.0) -> Experiment:
    """The same with first estimates that are this share of the truth."""
    cell = experiment.cell
    members = [
        replace(m, theta_hat0=share * p.theta) for m, p in zip(cell.members, cell.parameters, strict=True)
    ]
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space, cell.name))


#: cells that every example of a test has in common
KNOWN, FOUR = knowing(a460_pair(friction=False)), panda_four()


# -- Slotine and Li -----------------------------------------------------------------------------------------


def test_slotine_and_lis_law_is_the_papers_without_coupling_under_weights_of_one():
    experiment = a460_pair()
    cell = experiment.cell
    plain = replace(experiment, cell=Cell(cell.members, Coupling.pair(), cell.space))
    one, other = (under(law, plain).simulate(0.1) for law in (SlotineLi(), SunMills()))
    for name in LAYOUT:
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-10, err_msg=name)


def test_slotine_and_lis_law_does_not_depend_on_weights():
    one = under(SlotineLi(), planar_four()).simulate(0.1)
    cell = planar_four().cell
    weighted = Coupling.ring(4, [2.0, 0.5, 1.0, 3.0])
    moved = replace(planar_four(), cell=Cell(cell.members, weighted, cell.space))
    other = under(SlotineLi(), moved).simulate(0.1)
    np.testing.assert_array_equal(one.q, other.q)


def test_slotine_and_lis_law_is_certified():
    assert certify(under(SlotineLi(), a460_pair(friction=False)).simulate(0.3, dt=5e-4)).certified


# -- computed torque ----------------------------------------------------------------------------------------


def test_with_exact_parameters_computed_torque_leaves_the_error_that_two_equal_poles_leave():
    """e'' + 2 Lambda e' + Lambda^2 e = 0: e = e0 + (e0' + Lambda e0) t, times exp(-Lambda t)."""
    experiment = under(ComputedTorque(), knowing(planar_four()))
    result = experiment.simulate(0.5)
    Lambda = np.broadcast_to(experiment.gains.Lambda, (experiment.cell.m,))
    space, reference = experiment.cell.task, experiment.cell.references(np.zeros(1))[0]
    e0, e0_dot = space.measure(np.stack((experiment.cell.q0, experiment.cell.v0)), reference.desired).error
    t = result.t[:, None, None]
    expected = (e0 + (e0_dot + Lambda * e0) * t) * np.exp(-Lambda * t)
    size = np.abs(expected).max()
    assert np.abs(result.tracking_error - expected).max() <= 1e-6 * size


def test_computed_torque_learns_nothing_and_damps_nothing_on_an_arm_without_spare_joints():
    result = under(ComputedTorque(), planar_four()).simulate(0.1)
    assert np.abs(result.v_error).max() <= 1e-12
    assert np.abs(result.theta_hat - result.theta_hat[0]).max() <= 1e-12


# -- spring, damper and gravity -----------------------------------------------------------------------------


@given(SEEDS)
def test_the_torque_is_spring_damper_and_gravity(seed):
    rng = np.random.default_rng(seed)
    cell, Lambda, K_r = KNOWN.cell, 7.0, 30.0
    gains = KNOWN.gains.independent().replace(K_r=K_r, Lambda=Lambda)
    controller = Controller(cell, gains, law=PDGravity(K_r * Lambda))
    motion = np.stack((cell.q0, np.zeros_like(cell.q0))) + 0.1 * rng.standard_normal((2, 2, 3))
    reference = cell.references(np.array([0.4]))[0]
    s = controller.evaluate(reference, motion, cell.theta, np.zeros((1, 3)))
    gravity = [robot.gravity(q) for robot, q in zip(cell.robots, motion[0], strict=True)]
    e = reference.desired[0] - motion[0]
    np.testing.assert_allclose(s.tau, K_r * (Lambda * e - motion[1]) + gravity, atol=1e-9)


def test_a_target_that_stands_still_is_reached():
    experiment = knowing(a460_pair(friction=False))
    gains = {"K_r": 60.0, "Gamma": 0.0}
    result = under(PDGravity(400.0), experiment, **gains).simulate(8.0, engine="pinocchio", dt=2e-3)
    assert np.abs(result.tracking_error[-1]).max() <= 1e-3 * np.abs(result.q[-1] - result.q[0]).max()


def test_exact_gravity_that_is_adapted_leaves_an_arm_at_rest_beside_its_target():
    """tilde grows by Gamma times what the potential energy did, so that J^T K_p e = Y tilde at rest."""
    experiment = knowing(a460_pair(friction=False))
    result = under(PDGravity(400.0), experiment, K_r=60.0, Gamma=3.0).simulate(5.0, dt=2e-3)
    assert np.abs(result.v[-1]).max() < 1e-6
    assert np.abs(result.tracking_error[-1]).max() > 1e-2 * np.abs(result.q[-1] - result.q[0]).max()


# -- master and slaves --------------------------------------------------------------------------------------


@given(SEEDS)
def test_slaves_that_are_where_the_coupling_wants_them_are_asked_for_no_other_velocity(seed):
    """S w = 0 and S w' = 0: then r = 0 for all but the master."""
    rng = np.random.default_rng(seed)
    cell = FOUR.cell
    controller = Controller(cell, FOUR.gains.independent(), law=MasterSlave(1))
    from synctrl.control.laws import Errors

    n, m = cell.n, cell.m
    w = np.broadcast_to(rng.standard_normal((2, 1, m)), (2, n, m))
    S = cell.coupling.matrix
    null = np.linalg.svd(S)[2][-1]
    w = w * (null / null[1])[None, :, None]
    assert np.abs(S @ w).max() <= 1e-12
    weights = cell.references(np.zeros(1))[0].weights
    error = np.matvec(weights.c_inv, w)
    rates, x_dot = rng.standard_normal((2, n, m)), None
    x_dot = rates[0] - error[1]
    asked = controller.law.command(Errors(0.0, error, x_dot, rates, w, np.zeros((3, n, m)), weights))
    slip = asked.xref_dot - x_dot
    others = np.arange(n) != 1
    np.testing.assert_allclose(slip[others], 0, atol=1e-12)
    assert np.abs(slip[1]).max() > 1e-3


def test_slaves_follow_a_master_that_is_pushed():
    experiment = planar_four(disturbance="torque")
    alone, led = (under(law, experiment).simulate(2.0) for law in (SlotineLi(), MasterSlave()))
    assert np.abs(led.sync_error).max() < 0.7 * np.abs(alone.sync_error).max()


@pytest.mark.parametrize("master", [4, -1, True, "first"])
def test_a_master_that_is_no_robot_is_refused(master):
    with refused(InputError, "master"):
        under(MasterSlave(master), planar_four()).closed_loop()


# -- all ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_has_no_place_for_coupling_gains_refuses_them(name):
    with refused(InputError, "gains"):
        replace(planar_four(), law=LAWS[name]).closed_loop()


@pytest.mark.parametrize("name", LAWS)
def test_the_balance_of_v_closes_and_says_what_has_no_proof(name):
    result = under(LAWS[name], a460_pair(friction=False), K_r=80.0).simulate(0.1, dt=2.5e-4)
    record = lyapunov(result)
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert ("law" in record.power) == (name != "SlotineLi")


@pytest.mark.parametrize("control", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
@pytest.mark.parametrize("name", ["SlotineLi", "ComputedTorque", "PDGravity"])
def test_both_engines_agree(name, control):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = under(LAWS[name], planar_four())
    one, other = (experiment.simulate(0.1, engine=engine, **control) for engine in ("pinocchio", "compiled"))
    for array in LAYOUT:
        scale = np.abs(getattr(one, array)).max() + 1e-6
        assert np.abs(getattr(one, array) - getattr(other, array)).max() <= 1e-9 * scale, array


def test_the_compiled_engine_refuses_robots_that_follow_another_by_name():
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    with refused(InputError, "law", found="synctrl.control.laws.master_slave.BoundMasterSlave"):
        under(MasterSlave(), planar_four()).simulate(0.01, engine="compiled")


EVERY = [SunMills(), ChungSlotine(0.3), *LAWS.values()]


@pytest.mark.parametrize("law", EVERY, ids=lambda law: type(law).__name__)
def test_a_certificate_says_when_the_law_converges(law):
    certificate = certify(under(law, planar_four()).simulate(0.01))
    assert law.statement
    assert certificate.as_dict()["statement"] == law.statement
    assert f"law: {law.statement}" in str(certificate)


@pytest.mark.parametrize(
    "law", [SlotineLi(), ComputedTorque(), PDGravity(80.0), MasterSlave(), ChungSlotine(0.3)]
)
def test_ready_cells_leave_out_the_gains_that_a_law_has_no_place_for(law):
    gains = a460_pair(law=law).gains
    assert not gains.beta.any() and not gains.K_eps.any()
    assert bool(gains.Gamma.any()) == (type(law) is not PDGravity)
    with refused(InputError, "gains"):
        a460_pair(law=law, gains=a460_pair().gains)
