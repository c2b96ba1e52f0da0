"""Cartesian position: measurement, redundant and mixed cells under control, singular configurations."""

from __future__ import annotations

import numpy as np
import pytest
from flows import derivative, desired_flow, joint_flow
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from theory_cells import planar_arm

from synctrl import (
    AxisRotation,
    CartesianSpace,
    Cell,
    Circle,
    Coupling,
    Cubic,
    Damping,
    Experiment,
    Gains,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    PoseTrajectory,
    Redundancy,
    Result,
    load_robot,
)
from synctrl.analysis.certify import certify
from synctrl.errors import InputError, OrientationError, SingularJacobianError

UR5, PANDA = load_robot("ur5"), load_robot("panda")
TWO, THREE = planar_arm(2, name="two joints"), planar_arm(3, gravity=9.81, name="three joints")
GAINS = Gains(Lambda=6.0, beta=4.0, K_r=4.0, K_eps=1.0, Gamma=0.1)
POSTURE = np.array([0.4, 0.9, -0.7])
seeds = st.integers(0, 10_000)


# -- what is measured -------------------------------------------------------------------------------------


def measurement(axes: str, seed: int):
    rng = np.random.default_rng(seed)
    robots = [UR5, PANDA]
    bound, q = CartesianSpace(axes).bind(robots), joint_flow(rng, robots)
    desired = [desired_flow(rng, len(axes)) for _ in robots]

    def measure(t: float):
        xd = [np.stack(part) for part in zip(*(d(t) for d in desired), strict=True)]
        return bound.measure(np.stack((q(t), q.dot(t))), np.stack(xd))

    return bound, measure, q


@pytest.mark.parametrize("axes", ["xyz", "zx", "y"])
@settings(max_examples=20)
@given(seed=seeds)
def test_positions_are_those_of_the_tips_and_their_derivatives_are_right(axes, seed):
    _, measure, q = measurement(axes, seed)
    task, rows = measure(1.0), ["xyz".index(a) for a in axes]
    for i, robot in enumerate((UR5, PANDA)):
        np.testing.assert_allclose(task.x[i], robot.tip_position(q(1.0)[i, : robot.nv])[rows], atol=1e-13)
    np.testing.assert_allclose(task.x_dot, derivative(lambda t: measure(t).x, 1.0), atol=1e-9)
    np.testing.assert_allclose(task.J_dot, derivative(lambda t: measure(t).J, 1.0), atol=1e-9)
    np.testing.assert_allclose(task.xd_dot - task.x_dot, derivative(lambda t: measure(t).e, 1.0), atol=1e-9)


@settings(max_examples=20)
@given(seed=seeds)
def test_joint_torques_do_the_work_of_the_task_force(seed):
    bound, measure, q = measurement("xyz", seed)
    force = np.random.default_rng(seed).standard_normal((2, 3))
    task = measure(0.0)
    power = (bound.to_torque(task, force) * q.dot(0.0)).sum(1)
    np.testing.assert_allclose(power, (force * task.x_dot).sum(1), atol=1e-12)


# -- redundant and mixed cells under control --------------------------------------------------------------


def mixed_planar(space: CartesianSpace | None = None, radius: float = 0.05) -> Experiment:
    """An arm with two joints and one with three, tips on circles, starting beside them."""
    members = []
    for robot, q in ((TWO, np.array([0.3, 1.2])), (THREE, POSTURE)):
        circle = Circle(robot.tip_position(q)[:2] - (radius, 0.03), radius, 2.0)
        members.append(Member(robot, circle, q, theta_hat0=0.7 * robot.inertial_parameters))
    space = CartesianSpace("xy", redundancy=Redundancy(posture(POSTURE))) if space is None else space
    return Experiment(Cell(members, Coupling.pair(), space), GAINS, 3.0)


def posture(q: np.ndarray) -> list[np.ndarray]:
    return [np.zeros(2), q]


@pytest.mark.parametrize("weights", [None, [np.ones(2), np.array([4.0, 1.0, 0.2])]])
def test_a_mixed_redundant_cell_converges_and_is_certified(weights):
    space = CartesianSpace("xy", redundancy=Redundancy(posture(POSTURE), weights=weights))
    result = mixed_planar(space).simulate(dt=2.5e-3)
    e = np.linalg.norm(result.tracking_error, axis=2)
    assert (e[-1] < 0.1 * e[0]).all()
    assert certify(result).verdict == "covered by the theorem"
    assert not result.q[:, 0, 2].any(), "the joint that robot 1 does not have moved"


def test_the_law_keeps_j_s_q_equal_to_the_coupled_velocity_error():
    loop = mixed_planar().closed_loop()
    reference = loop.cell.references(np.array([0.3]))[0]
    y = loop.initial_state() + 0.1 * np.random.default_rng(0).standard_normal(loop.size)
    y[2] = y[8] = 0  # position and velocity of the joint that robot 1 does not have
    s = loop.evaluate(reference, y, np.zeros((2, 3)))[1]
    np.testing.assert_allclose(np.matvec(s.task.J, s.s_q), np.matvec(reference.c_inv, s.r), atol=1e-12)


def test_a_redundant_arm_at_rest_finds_the_nearest_configuration_to_its_posture():
    wish = np.array([-0.5, 1.5, 0.3])
    members = [
        Member(THREE, Hold(THREE.tip_position(POSTURE)[:2]), POSTURE, theta_hat0=THREE.inertial_parameters)
    ] * 2
    space = CartesianSpace("xy", redundancy=Redundancy(wish, gain=4.0))
    cell = Cell(members, Coupling.pair(), space)
    q = Experiment(cell, GAINS, 3.0).simulate(dt=5e-3).q[-1, 0]
    null = np.linalg.svd(THREE.jacobian(q)[:2])[2][2]
    assert np.linalg.norm(q - POSTURE) > 0.05
    np.testing.assert_allclose(THREE.tip_position(q)[:2], THREE.tip_position(POSTURE)[:2], atol=5e-4)
    np.testing.assert_allclose(null @ (wish - q), 0, atol=1e-3)


# -- singular configurations ------------------------------------------------------------------------------


def through_the_base(singularity: str | Damping, gains: Gains = GAINS) -> Experiment:
    """Two arms, of which the second is sent past its base, where its Jacobian is singular."""
    q = np.array([0.0, 2.2])
    start = TWO.tip_position(q)[:2]
    motions = (Hold(start), Cubic(start, -0.8 * start, 2.0))
    known = 0.7 * TWO.inertial_parameters
    members = [Member(TWO, motion, q, theta_hat0=known) for motion in motions]
    space = CartesianSpace("xy", singularity=singularity)
    return Experiment(Cell(members, Coupling.pair(), space), gains, 3.0)


def test_a_run_stops_at_a_singular_jacobian_and_says_where():
    with refused(SingularJacobianError, robot=1, cause="singular") as caught:
        through_the_base("stop", GAINS.independent()).simulate(dt=5e-3)
    assert caught.value.subject in ("condition", "side") and 0 < caught.value.time < 2
    assert caught.value.result.t[-1] < caught.value.time + 1e-9


def test_a_damped_run_goes_on_and_says_when_and_how_much():
    result = through_the_base(Damping(0.08, 0.03)).simulate(dt=5e-3)
    report = result.info["damping"]
    assert result.status == "completed" and report
    assert {entry["robot"] for entry in report} == {1}
    smallest = np.array([np.linalg.svd(TWO.jacobian(q)[:2], compute_uv=False)[-1] for q in result.q[:, 1]])
    inside = np.zeros(len(result.t), bool)
    for entry in report:
        inside |= (result.t >= entry["start"]) & (result.t <= entry["stop"])
        assert 0 < entry["largest_damping"] <= 0.03 and entry["largest_velocity_lost"] > 0
    np.testing.assert_array_equal(inside, smallest < 0.08)
    deepest = max(entry["largest_damping"] for entry in report)
    np.testing.assert_allclose(deepest, 0.03 * (1 - smallest.min() ** 2 / 0.08**2), rtol=1e-9)
    assert certify(result).verdict == "outside the theorem"


def test_the_report_of_damping_is_saved_with_the_result(tmp_path):
    result = through_the_base("damped").simulate(2.0, dt=1e-2)
    assert result.info["damping"]
    assert Result.load(result.save(tmp_path / "run.npz")).info["damping"] == result.info["damping"]


def test_far_from_singular_configurations_damping_changes_nothing():
    redundancy = Redundancy(posture(POSTURE))
    plain = mixed_planar(CartesianSpace("xy", redundancy=redundancy)).simulate(1.0, dt=2.5e-3)
    space = CartesianSpace("xy", singularity=Damping(1e-3, 0.1), redundancy=redundancy)
    damped = mixed_planar(space).simulate(1.0, dt=2.5e-3)
    assert damped.info["damping"] == plain.info["damping"] == []
    np.testing.assert_allclose(damped.q, plain.q, atol=1e-9)
    assert certify(damped).verdict == "covered by the theorem"


def test_a_redundant_arm_at_the_border_of_its_workspace_stops_the_run():
    stretched = np.array([0.3, 1e-5, 1e-5])
    member = Member(THREE, Hold(THREE.tip_position(stretched)[:2]), stretched)
    cell = Cell([member, member], Coupling.pair(), CartesianSpace("xy"))
    with refused(SingularJacobianError, robot=0, time=0.0):
        Experiment(cell, GAINS, 1.0).simulate()


def test_an_orientation_error_near_half_a_turn_stops_the_run_and_names_the_robot():
    q = np.array([0.1, -1.4, 1.8, -0.6, 1.2, 0.2])
    pose = UR5.tip_pose(q)
    turned = pose.rotation @ np.diag([-1.0, -1.0, 1.0])
    motions = [PoseTrajectory(Hold(pose.translation), AxisRotation.fixed(R)) for R in (pose.rotation, turned)]
    cell = Cell([Member(UR5, motion, q) for motion in motions], Coupling.pair(), PoseSpace())
    with refused(OrientationError, "orientation", robot=1, time=0.0) as caught:
        Experiment(cell, GAINS, 1.0).simulate()
    assert caught.value.found == pytest.approx(np.pi)


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"axes": "xw"},
        {"axes": ""},
        {"axes": "xx"},
        {"singularity": "ignore"},
        {"max_condition": 0},
        {"redundancy": 3},
    ],
)
def test_options_that_mean_nothing_are_refused_by_name(options):
    with refused(InputError, *options):
        CartesianSpace(**options)


def test_robots_of_different_kinds_are_sent_to_cartesian_space():
    with refused(InputError, "joint space"):
        JointSpace().bind([UR5, PANDA])
