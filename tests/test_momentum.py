"""The momentum of robots is linear in what is adapted, and so is what changes it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl import load_robot
from synctrl.experiments import a460_pair, mixed_four, planar_four
from synctrl.robots.base_parameters import BaseParameters
from synctrl.robots.friction import Friction
from synctrl.robots.momentum import momentum_of_all, momentum_regressors
from synctrl.robots.parameters import FrictionParameters, FullParameters
from synctrl.robots.robot import Robot

SEEDS = st.integers(0, 2**32 - 1)
ROBOTS = {
    name: load_robot(name).placed(rpy=(0.3, -0.4, 0.5)) for name in ("planar2r", "a460", "ur5", "panda")
}


def rubbing(robot: Robot) -> Friction:
    return Friction(np.linspace(0.1, 1, robot.nv), np.linspace(0.5, 0.2, robot.nv), smoothing=0.3)


def with_rotors(robot: Robot) -> FrictionParameters:
    robot = robot.with_armature(0.1)
    return FrictionParameters(robot, rubbing(robot), armature=True)


KINDS = {
    "full": FullParameters,
    "base": BaseParameters,
    "friction": lambda robot: FrictionParameters(robot, rubbing(robot)),
    "friction of base": lambda robot: FrictionParameters(robot, rubbing(robot), BaseParameters(robot)),
    "rotors": with_rotors,
}
PARAMETERS = {(name, kind): make(robot) for name, robot in ROBOTS.items() for kind, make in KINDS.items()}


def some_motion(nv: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((2, nv))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=5)
@given(seed=SEEDS)
def test_they_give_the_momentum_and_what_changes_it_by_pinocchio(name, kind, seed):
    parameters = PARAMETERS[name, kind]
    robot = parameters.robot
    q, v = some_motion(robot.nv, seed)
    Y_p, Y_h = momentum_regressors(parameters, q, v)
    changing = robot.gravity(q) - robot.coriolis_matrix(q, v).T @ v
    if isinstance(parameters, FrictionParameters):
        changing += rubbing(robot).torque(v)
    np.testing.assert_allclose(Y_p @ parameters.theta, robot.mass_matrix(q) @ v, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(Y_h @ parameters.theta, changing, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=5)
@given(seed=SEEDS)
def test_they_are_what_the_momenta_of_the_bodies_do_along_the_axes_of_the_joints(name, seed):
    """J_k^T A(nu) and J_k'^T A(nu) in the world's axes, with A(nu) = `bodyRegressor(0, nu)` of a body."""
    robot = ROBOTS[name]
    q, v = some_motion(robot.nv, seed)
    Y_p, Y_h = momentum_regressors(PARAMETERS[name, "full"], q, v)
    model = pin.Model(robot.model)
    data, still = model.createData(), pin.Motion.Zero()
    pin.computeJointJacobiansTimeVariation(model, data, robot.configuration(q), v)
    pin.forwardKinematics(model, data, robot.configuration(q), v)
    for body in range(1, model.njoints):
        columns = slice(10 * (body - 1), 10 * body)
        J, J_dot = (
            of(model, data, body, pin.WORLD).reshape(6, -1)
            for of in (pin.getJointJacobian, pin.getJointJacobianTimeVariation)
        )
        place, weight = data.oMi[body], pin.Motion(-robot.gravity_vector, np.zeros(3))
        twists = data.v[body], place.actInv(weight)
        moving, falling = (place.toDualActionMatrix() @ pin.bodyRegressor(still, nu) for nu in twists)
        np.testing.assert_allclose(Y_p[:, columns], J.T @ moving, atol=1e-12)
        np.testing.assert_allclose(Y_h[:, columns], J.T @ falling - J_dot.T @ moving, atol=1e-11)


@pytest.mark.parametrize("make", [planar_four, mixed_four])
def test_of_all_robots_they_are_those_of_each_with_zeros_beyond(make):
    cell = make().cell
    q, v = np.random.default_rng(0).standard_normal((2, cell.n, cell.nv))
    together = momentum_of_all(cell.robots, cell.parameters, q, v)
    for i, (robot, parameters) in enumerate(zip(cell.robots, cell.parameters, strict=True)):
        alone = momentum_regressors(parameters, q[i, : robot.nv], v[i, : robot.nv])
        for whole, part in zip(together, alone, strict=True):
            expected = np.zeros((cell.nv, cell.theta.shape[1]))
            expected[: part.shape[0], : part.shape[1]] = part
            np.testing.assert_array_equal(whole[i], expected)


@pytest.mark.parametrize("make", [planar_four, mixed_four, a460_pair, lambda: a460_pair(adapt_friction=True)])
def test_symbols_give_the_same_regressors_as_numbers(make):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    from synctrl.compiled.kind import classify
    from synctrl.compiled.momentum import momentum_function

    experiment = make()
    cell = experiment.cell
    found = classify(experiment.closed_loop())
    q, v = np.random.default_rng(0).standard_normal((2, cell.n, cell.nv))
    for i, robot in enumerate(cell.robots):
        function = momentum_function(found.kinds[found.kind_of[i]], found.bases[i].rotation)
        motion = q[i, : robot.nv], v[i, : robot.nv]
        expected = momentum_regressors(cell.parameters[i], *motion)
        for traced, numeric in zip(function(*motion), expected, strict=True):
            np.testing.assert_allclose(np.array(traced), numeric, rtol=1e-11, atol=1e-11)
