"""A tare of the grasps: at closure all arms take over where one of them believes the object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held import carried_along
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl.assembly.tare import believed_poses, disagreement, tared
from synctrl.coupling.cell import Cell
from synctrl.errors import InputError
from synctrl.experiments import carry_ur5
from synctrl.tasks.pose import PoseSpace
from synctrl.tasks.rotations import log

ERRORS = st.lists(st.floats(-0.02, 0.02), min_size=6, max_size=6)


def first_epsilon(**options) -> np.ndarray:
    run = carry_ur5(**options).simulate(0.01, dt=1e-3)
    return run.sync_error[0, 0]


def test_arms_disagree_by_the_geometric_error_and_with_a_tare_not_at_all():
    error = np.array([1e-3, 0.0, 0.0, 0.0, np.deg2rad(0.5), 0.0])
    apart = disagreement(carry_ur5(geometric_error=True).cell)[1]
    np.testing.assert_allclose(np.linalg.norm(apart[:3]), np.linalg.norm(error[:3]), rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(apart[3:]), np.linalg.norm(error[3:]), rtol=1e-5)
    assert np.abs(disagreement(carry_ur5(geometric_error=True, tare=True).cell)).max() < 1e-12
    assert np.abs(first_epsilon(geometric_error=True)).max() > 5e-4
    assert np.abs(first_epsilon(geometric_error=True, tare=True)).max() < 1e-12


@settings(max_examples=5)
@given(ERRORS, ERRORS)
def test_after_a_tare_beliefs_agree_wherever_hands_carry_the_object_rigidly(error, moved):
    """A constant error of a grasp vanishes for good, for the hands move as one."""
    experiment = carry_ur5(geometric_error=np.array(error), tare=True)
    q, _ = carried_along(experiment, np.repeat([1.0, 10.0], 3) * moved, np.zeros(6))
    tips = [robot.tip_pose(q_i).homogeneous for robot, q_i in zip(experiment.cell.robots, q, strict=True)]
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-11)


def test_a_base_that_is_thought_to_stand_turned_is_wrong_again_as_the_object_turns():
    """Turned by b, it believes b t b^T of every turn t: off by 2 |b| sin(|t| / 2) if the axes are square."""
    experiment, off = carry_ur5(), 0.01
    first, second = experiment.cell.members
    thought = second.robot.placed(rpy=(0.0, 0.0, off))
    cell = tared(Cell([first, replace(second, robot=thought)], experiment.cell.coupling, PoseSpace()))
    assert np.abs(disagreement(cell)).max() < 1e-12
    turn = 0.3
    q, _ = carried_along(experiment, np.array([0.0, 0.0, 0.0, turn, 0.0, 0.0]), np.zeros(6))
    R = [robot.tip_pose(q_i).rotation for robot, q_i in zip(cell.robots, q, strict=True)]
    assert np.linalg.norm(log(R[0] @ R[1].T)) == pytest.approx(2 * off * np.sin(turn / 2), rel=1e-3)


def test_whose_belief_is_taken_over_can_be_said():
    cell = carry_ur5(geometric_error=True).cell
    before = believed_poses(cell)
    for by in range(2):
        places, turns = believed_poses(tared(cell, by))
        np.testing.assert_allclose(places, [before[0][by]] * 2, atol=1e-12)
        np.testing.assert_allclose(turns, [before[1][by]] * 2, atol=1e-12)


def test_a_tare_of_exact_grasps_changes_what_rounding_may():
    runs = [carry_ur5(tare=tare).simulate(0.05, dt=1e-3) for tare in (False, True)]
    np.testing.assert_allclose(runs[1].q, runs[0].q, atol=1e-9)


def test_with_a_tare_the_force_inside_is_that_of_exact_geometry():
    """What is left of a millimetre is where the payload is led, which is the same for both hands."""

    def force(**options) -> np.ndarray:
        run = carry_ur5(**options).simulate(0.4, dt=2e-3, log_dt=0.02)
        return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)

    error = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    exact, wrong, tare = force(), force(geometric_error=error), force(geometric_error=error, tare=True)
    assert np.abs(tare - exact).max() < 0.1 * np.abs(wrong - exact).max()


def test_what_cannot_be_tared_is_refused():
    cell = carry_ur5().cell
    with refused(InputError, "cell"):
        tared(cell.members)
    with refused(InputError, "by", found=2):
        tared(cell, 2)
    with refused(InputError, "tare"):
        carry_ur5(tare=1)


@pytest.mark.parametrize("by", [0, 1])
def test_a_tare_leaves_loads_starts_and_names_as_they_are(by):
    cell = carry_ur5(geometric_error=True).cell
    after = tared(cell, by)
    assert np.array_equal(after.q0, cell.q0) and after.names == cell.names and after.name == cell.name
    np.testing.assert_allclose(after.theta, cell.theta, atol=1e-12)
    assert np.array_equal(after.theta_hat0, cell.theta_hat0)
