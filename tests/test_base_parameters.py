"""Base parameters: the fewest numbers that determine a robot's torque, and what a run learns of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from machines import random_robot, rod_arm, seeds
from refusals import refused

from synctrl import (
    BaseParameters,
    Cell,
    Coupling,
    Experiment,
    Friction,
    FrictionParameters,
    FullParameters,
    FunctionTrajectory,
    Gains,
    Member,
    Robot,
    load_robot,
)
from synctrl.analysis.convergence import LEFT, identify
from synctrl.errors import InputError, RobotError
from synctrl.experiments import a460_pair
from synctrl.robots.base_parameters import group_columns, grouping, parameters_of
from synctrl.robots.parameters import planar_two_link_parameters

RANKS = {"planar2r": 4, "ur5": 36, "panda": 43, "kinova": 36, "xarm7": 43, "a460_full": 36}


@pytest.mark.parametrize("name", RANKS)
def test_the_number_of_base_parameters_is_the_known_one(name: str) -> None:
    robot = load_robot(name)
    found = BaseParameters(robot)
    values = found.grouping.singular_values
    assert found.theta.size == found.grouping.rank == RANKS[name]
    assert values[RANKS[name] - 1] > 1e6 * values[RANKS[name] :].max(), "the gap is not clean"


def test_those_of_the_planar_arm_are_the_paper_s_up_to_its_symmetry() -> None:
    robot, l_1 = load_robot("planar2r"), 0.3
    found, paper = BaseParameters(robot), planar_two_link_parameters(robot)
    assert found.names == ("joint1.Izz + 0.09 joint2.m", "joint2.mx", "joint2.my", "joint2.Izz")
    theta_1, theta_2, theta_3 = paper.theta
    np.testing.assert_allclose(found.theta, [theta_1, theta_3 / l_1, 0.0, theta_2], atol=1e-15)


def check_same_torques(robot: Robot, rng: np.random.Generator) -> None:
    full, base = FullParameters(robot), BaseParameters(robot)
    theta_hat = rng.normal(size=full.theta.size)
    for q, v, v_ref, a_ref in rng.normal(size=(5, 4, robot.nv)):
        expected = full.regressor(q, v, v_ref, a_ref) @ theta_hat
        found = base.regressor(q, v, v_ref, a_ref) @ base.grouped(theta_hat)
        np.testing.assert_allclose(found, expected, atol=1e-8 * (1 + np.abs(expected).max()))
    np.testing.assert_allclose(base.grouped(full.theta), base.theta, atol=1e-14)


@settings(max_examples=15)
@given(seed=seeds)
def test_they_give_the_same_torque_as_all_parameters_whatever_these_are(seed: int) -> None:
    check_same_torques(random_robot(seed), np.random.default_rng(seed))


@pytest.mark.parametrize("name", ["ur5", "panda", "a460"])
def test_they_give_the_same_torque_for_real_arms(name: str) -> None:
    check_same_torques(load_robot(name).placed(rpy=(0.3, 0.2, 0.1)), np.random.default_rng(0))


@settings(max_examples=15)
@given(seed=seeds)
def test_no_number_of_them_can_be_left_out(seed: int) -> None:
    robot = random_robot(seed)
    base = BaseParameters(robot)
    again = grouping(base, robot.nv)
    np.testing.assert_array_equal(again.K, np.eye(base.theta.size))
    assert base.grouping.condition < 1e8


def test_rows_of_the_map_are_combinations_of_the_columns_of_y() -> None:
    rng = np.random.default_rng(0)
    basis = rng.normal(size=(40, 3))
    Y = np.column_stack([basis[:, 0], 2 * basis[:, 0], np.zeros(40), basis[:, 1:] @ [1, -3], basis[:, 1:]])
    found = group_columns(Y)
    np.testing.assert_array_equal(found.columns, [0, 3, 4])
    np.testing.assert_allclose(Y[:, found.columns] @ found.K, Y, atol=1e-12)
    assert found.names(["a", "b", "c", "d", "e", "f"]) == ("a + 2 b", "d - 0.3333 f", "e + 0.3333 f")


def test_a_rank_that_is_not_clear_is_refused() -> None:
    rng = np.random.default_rng(0)
    Y = rng.normal(size=(40, 4)) @ np.diag([1, 1, 1, 1.0])
    Y[:, 3] = Y[:, 0] + 3e-9 * rng.normal(size=40)
    Y[:, 2] = Y[:, 1] + 3e-6 * rng.normal(size=40)
    with refused(RobotError, "robot 'wobbly'"):
        group_columns(Y, "wobbly")


def test_rotors_are_no_part_of_them() -> None:
    robot = load_robot("a460")
    np.testing.assert_array_equal(BaseParameters(robot.with_armature(0.5)).theta, BaseParameters(robot).theta)


def test_parameters_by_name() -> None:
    robot = load_robot("a460")
    assert isinstance(parameters_of("full", robot), FullParameters)
    assert isinstance(parameters_of("base", robot), BaseParameters)
    with refused(InputError, "parameters"):
        parameters_of("few", robot)


# -- in the closed loop ------------------------------------------------------------------------------------


def with_base(experiment: Experiment) -> Experiment:
    """The experiment with base parameters, adapted as the full ones would move them where it is diagonal."""
    members = []
    for member in experiment.cell.members:
        base = BaseParameters(member.robot)
        members.append(replace(member, parameters=base, theta_hat0=base.grouped(member.theta_hat0)))
    cell = experiment.cell
    return replace(experiment, cell=Cell(members, cell.coupling, cell.space))


def test_the_controller_works_with_them() -> None:
    full = a460_pair(friction=False)
    frozen = replace(full, gains=full.gains.replace(Gamma=0.0))
    expected, found = frozen.simulate(0.3), with_base(frozen).simulate(0.3)
    np.testing.assert_allclose(found.tau, expected.tau, rtol=1e-9)
    assert found.theta_hat.shape[2] == 15
    adapted = with_base(full).simulate(0.5)
    assert np.abs(adapted.tracking_error).max() < np.abs(found.tracking_error).max()


def test_the_compiled_engine_knows_them() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = with_base(a460_pair())
    expected, found = experiment.simulate(0.2), experiment.simulate(0.2, engine="compiled")
    np.testing.assert_allclose(found.theta_hat, expected.theta_hat, atol=1e-9)


# -- what a run learns -------------------------------------------------------------------------------------


def swinging(amplitude: float, duration: float, Gamma: float = 0.1) -> Experiment:
    """Two planar arms of rods that swing with several frequencies, and know a third of their masses."""
    robot = rod_arm((1.0, 0.8), (0.4, 0.3))
    base = BaseParameters(robot)
    members = []
    for i in range(2):
        w = np.array([2.0 + i, 3.7])
        path = FunctionTrajectory(
            lambda t, w=w: amplitude * np.sin(np.multiply.outer(t, w)),
            lambda t, w=w: amplitude * w * np.cos(np.multiply.outer(t, w)),
            lambda t, w=w: -amplitude * w**2 * np.sin(np.multiply.outer(t, w)),
        )
        members.append(Member(robot, path, parameters=base, v0=amplitude * w, theta_hat0=0.3 * base.theta))
    gains = Gains(Lambda=6.0, beta=2.0, K_r=0.2, K_eps=0.2, Gamma=Gamma)
    return Experiment(Cell(members, Coupling.pair()), gains, duration)


def test_a_run_that_excites_everything_learns_everything() -> None:
    result = swinging(0.8, 16.0).simulate(dt=2e-3, engine="compiled", log_dt=2e-2)
    for found in identify(result):
        assert found.grouping.rank == 4
        assert found.all_learned and found.learned == 3  # the fourth, a moment that is 0, was known
        assert found.left.max() <= LEFT
        assert np.linalg.norm(found.base_error[-1]) < 0.2 * np.linalg.norm(found.base_error[0])
        assert np.abs(found.torque_error[-100:]).max() < 0.1 * np.abs(found.torque_error).max()


def test_a_run_that_barely_moves_learns_nothing() -> None:
    result = swinging(0.01, 3.0).simulate(dt=2e-3, engine="compiled")
    for found in identify(result):
        assert found.learned == 0
        assert found.as_dict()["all_learned"] is False
        assert np.linalg.norm(found.base_error[-1]) > 0.8 * np.linalg.norm(found.base_error[0])


def test_what_adaptation_had_the_time_for_is_not_said_to_be_learned() -> None:
    """A loop that learns so fast that it rings keeps its errors, for many times 1 / (Gamma Y^T D^-1 Y)."""
    result = swinging(0.5, 0.5, Gamma=100.0).simulate(dt=2.5e-4, engine="compiled")
    for found in identify(result):
        assert found.left.max() > 0.2
        assert found.learned < found.wrong.sum() == 3
        assert not found.all_learned


def test_what_was_right_from_the_start_is_not_learned() -> None:
    experiment = swinging(0.5, 0.1)
    known = [replace(m, theta_hat0=m.parameters.theta) for m in experiment.cell.members]
    known[0] = replace(known[0], theta_hat0=known[0].theta_hat0 * np.array([0.5, 1, 1, 1]))
    cell = Cell(known, experiment.cell.coupling)
    first, second = identify(replace(experiment, cell=cell).simulate(dt=2e-3))
    assert (first.wrong.sum(), second.wrong.sum()) == (1, 0)
    assert second.learned == 0 and not second.all_learned


def test_errors_converge_on_the_a460_without_its_parameters() -> None:
    result = a460_pair(friction=False).simulate(3.0, dt=2e-3)
    for found in identify(result):
        assert (found.grouping.rank, found.grouping.K.shape[1]) == (15, 30)
        assert found.learned < 15
        assert not found.all_learned
        assert found.as_dict()["base_error_end"] > 0.3 * found.as_dict()["base_error_start"]
        assert np.abs(found.torque_error[-1]).max() < 0.2 * np.abs(found.torque_error).max()


def test_torque_and_base_errors_are_those_of_the_estimates() -> None:
    result = a460_pair().simulate(0.2)
    cell = result.experiment.cell
    for i, found in enumerate(identify(result)):
        base = BaseParameters(cell.robots[i])
        for k in (0, 100, 200):
            error = base.theta - base.grouped(result.theta_hat[k, i])
            np.testing.assert_allclose(found.base_error[k], error, atol=1e-9)
        assert found.names == base.names
        # at rest at t = 0 only gravity is missing: a share of it is known
        robot = cell.robots[i]
        missing = 0.3 * robot.inverse_dynamics(result.q[0, i], np.zeros(3), _start(result, i))
        np.testing.assert_allclose(found.torque_error[0], missing, rtol=1e-6)


def _start(result, i: int) -> np.ndarray:
    """a_ref at t = 0 on the path: the desired acceleration."""
    return result.experiment.cell.members[i].trajectory(0.0).x_ddot


def test_friction_is_among_what_can_be_identified() -> None:
    robot = load_robot("a460")
    found = grouping(FrictionParameters(robot, Friction(1.0, 1.0), armature=True), robot.nv)
    names = found.names(FrictionParameters(robot, Friction(), armature=True).names)
    assert found.rank == 15 + 3 + 3 + 1
    assert names[0].endswith("joint3.Iyy + joint1.armature")
    assert "joint3.armature" in names or names[14].endswith("joint3.armature")


def test_a_member_may_name_what_it_adapts() -> None:
    experiment = a460_pair()
    members = [replace(m, parameters="base", theta_hat0=None) for m in experiment.cell.members]
    cell = Cell(members, experiment.cell.coupling)
    np.testing.assert_array_equal(cell.theta[0], BaseParameters(members[0].robot).theta)
    with refused(InputError, "robot 1, parameters", found="bases"):
        Cell([replace(m, parameters="bases") for m in members], experiment.cell.coupling)
