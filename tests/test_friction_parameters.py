"""Friction and rotors among the adapted parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from machines import random_robot, seeds
from refusals import refused

from synctrl import Cell, Friction, FrictionParameters, LinearParameters, load_robot
from synctrl.errors import InputError
from synctrl.experiments import a460_pair
from synctrl.experiments.a460_pair import FRICTION
from synctrl.robots.parameters import friction_diagonals, planar_two_link_parameters, with_friction_columns


def machine(seed: int) -> tuple[np.random.Generator, FrictionParameters, object, Friction]:
    """A random robot with rotors and friction, and the parameters that describe it."""
    rng = np.random.default_rng(seed)
    robot = random_robot(seed)
    robot = robot.with_armature(rng.uniform(0, 2, robot.nv))
    friction = Friction(rng.uniform(0, 3, robot.nv), rng.uniform(0, 3, robot.nv), rng.uniform(0.01, 1))
    return rng, FrictionParameters(robot, friction, armature=True), robot, friction


@settings(max_examples=20)
@given(seed=seeds)
def test_y_theta_is_the_torque_of_the_robot_with_its_friction_and_rotors(seed: int) -> None:
    rng, parameters, robot, friction = machine(seed)
    q, v, a = rng.normal(size=(3, robot.nv))
    expected = robot.inverse_dynamics(q, v, a) + friction.torque(v)
    found = parameters.regressor(q, v, v, a) @ parameters.theta
    np.testing.assert_allclose(found, expected, atol=1e-9 * (1 + np.abs(expected).max()))
    assert len(parameters.names) == parameters.theta.size == 10 * robot.nv + 3 * robot.nv


@settings(max_examples=20)
@given(seed=seeds)
def test_what_the_proof_needs_holds_with_friction(seed: int) -> None:
    """M s' + C s = Y theta - F_v s - tau, for any v_ref, a_ref and tau."""
    rng, parameters, robot, friction = machine(seed)
    q, v, v_ref, a_ref, tau = rng.normal(size=(5, robot.nv))
    s = v_ref - v
    s_dot = a_ref - robot.forward_dynamics(q, v, tau - friction.torque(v))
    left = robot.mass_matrix(q) @ s_dot + robot.coriolis_matrix(q, v) @ s
    right = parameters.regressor(q, v, v_ref, a_ref) @ parameters.theta - friction.viscous * s - tau
    np.testing.assert_allclose(left, right, atol=1e-8 * (1 + np.abs(right).max()))


@pytest.mark.parametrize("armature", [True, False])
def test_the_columns_of_friction_are_those_of_each_robot_alone_and_can_be_traced(armature: bool) -> None:
    ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    rng = np.random.default_rng(0)
    v, v_ref, a_ref = rng.normal(size=(3, 4, 3))
    Y_b, smoothing = rng.normal(size=(4, 3, 5)), rng.uniform(0.01, 1, (4, 1))
    together = with_friction_columns(Y_b, v, v_ref, a_ref, smoothing, armature)
    symbols = [np.array(ca.vertsplit(ca.SX.sym(name, 3)), dtype=object) for name in ("v", "v_ref", "a_ref")]
    for i, width in enumerate(smoothing[:, 0]):
        motion = v[i], v_ref[i], a_ref[i]
        alone = with_friction_columns(Y_b[i], *motion, width, armature)
        np.testing.assert_array_equal(together[i], alone)
        traced = np.stack(friction_diagonals(*symbols, width, armature)).ravel()
        found = ca.Function("columns", [ca.vertcat(*row) for row in symbols], [ca.vertcat(*traced)])(*motion)
        diagonals = [np.diagonal(alone[:, k : k + 3]) for k in range(5, alone.shape[1], 3)]
        np.testing.assert_allclose(np.array(found)[:, 0], np.concatenate(diagonals), rtol=1e-14)


def friction_run(duration: float, **options):
    """The A460 with friction that is adapted."""
    experiment = a460_pair(adapt_friction=True)
    return experiment, experiment.simulate(duration, **options)


def test_v_of_the_proof_falls_along_a_run_with_friction() -> None:
    experiment, result = friction_run(0.6)
    cell, gains = experiment.cell, experiment.gains
    V = np.zeros(len(result.t))
    for k in range(len(result.t)):
        E = cell.coupling.matrix.T @ result.sync_integral[k]
        V[k] = (
            0.5 * gains.K_eps * ((result.sync_error[k] ** 2).sum() + gains.Lambda * gains.beta * (E**2).sum())
        )
        tilde = cell.theta - result.theta_hat[k]
        V[k] += 0.5 * (tilde**2 / gains.Gamma).sum()
        for i, robot in enumerate(cell.robots):
            s = result.v_error[k, i]
            V[k] += 0.5 * s @ robot.mass_matrix(result.q[k, i]) @ s
    assert (np.diff(V) <= 1e-12 * V[0]).all()
    assert V[-1] < V[0]


def test_the_offset_that_friction_leaves_goes_away() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    unknown = a460_pair().simulate(8.0, engine="compiled")
    _, adapted = friction_run(8.0, engine="compiled")
    frictionless = a460_pair(friction=False).simulate(8.0, engine="compiled")
    end = [np.abs(result.tracking_error[-1]).max() for result in (unknown, adapted, frictionless)]
    assert end[1] < 0.1 * end[0]
    assert end[1] <= end[2]


def test_the_compiled_engine_adapts_friction_too() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = a460_pair(adapt_friction=True)
    members = []
    for k, member in enumerate(experiment.cell.members):
        robot = member.robot.with_armature(0.3)
        parameters = FrictionParameters(robot, FRICTION, armature=True)
        guess = 0.5 * parameters.theta
        members.append(replace(member, robot=robot, parameters=parameters, theta_hat0=(1 + k) * guess))
    gains = replace(experiment.gains, Gamma=np.repeat([0.3, 50.0, 1.0], [30, 6, 3]))
    cell = Cell(members, experiment.cell.coupling, experiment.cell.space)
    experiment = replace(experiment, cell=cell, gains=gains)
    reference, compiled = experiment.simulate(0.2), experiment.simulate(0.2, engine="compiled")
    for name in ("q", "tau", "theta_hat"):
        expected = getattr(reference, name)
        assert np.abs(getattr(compiled, name) - expected).max() < 1e-9 * np.abs(expected).max()


def test_friction_goes_with_few_parameters_of_the_rigid_bodies() -> None:
    robot = load_robot("planar2r")
    few = planar_two_link_parameters(robot)
    assert isinstance(few, LinearParameters)
    parameters = FrictionParameters(robot, Friction(0.1, (0.2, 0.3)), base=few)
    assert parameters.names[3:] == ("joint1.viscous", "joint2.viscous", "joint1.coulomb", "joint2.coulomb")
    np.testing.assert_array_equal(parameters.theta[3:], [0.1, 0.1, 0.2, 0.3])


def test_friction_that_does_not_fit_is_refused() -> None:
    robot = load_robot("a460")
    with refused(InputError, "friction, viscous"):
        FrictionParameters(robot, Friction(viscous=(1.0, 2.0)))
    with refused(InputError, "base"):
        FrictionParameters(robot, FRICTION, base=FrictionParameters(robot, FRICTION))


def test_rotors_add_to_the_diagonal_of_the_mass_matrix() -> None:
    robot = load_robot("ur5")
    q = np.ones(robot.nv)
    difference = robot.with_armature(0.4).mass_matrix(q) - robot.mass_matrix(q)
    np.testing.assert_allclose(difference, 0.4 * np.eye(robot.nv), atol=1e-12)
    with refused(InputError, "armature"):
        robot.with_armature(-0.1)
