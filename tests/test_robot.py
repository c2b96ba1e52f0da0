"""Robot: mechanics that hold for any fixed-base mechanism, and the two robots of the paper."""

from __future__ import annotations

import pickle

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import placement, random_robot, rate, seeds
from refusals import refused

from synctrl import Robot, load_robot
from synctrl.errors import FrameNotFound, InputError, RobotError
from synctrl.experiments.a460_pair import FINAL, INITIAL

ROBOTS = {"planar2r": load_robot("planar2r"), "a460": load_robot("a460")}
sizes = st.integers(1, 6)


def state(robot: Robot, seed: int, rows: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2, 2, (rows, robot.nv))


# -- dynamics ---------------------------------------------------------------------------------------------


@given(seeds, sizes)
@settings(max_examples=30)
def test_the_mass_matrix_is_symmetric_and_positive_definite(seed, joints):
    robot = random_robot(seed, joints)
    M = robot.mass_matrix(state(robot, seed)[0])
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0


@given(seeds, sizes)
@settings(max_examples=30)
def test_inverse_dynamics_is_m_a_plus_c_v_plus_g(seed, joints):
    robot = random_robot(seed, joints)
    q, v, a = state(robot, seed)
    torque = robot.mass_matrix(q) @ a + robot.coriolis_matrix(q, v) @ v + robot.gravity(q)
    np.testing.assert_allclose(robot.inverse_dynamics(q, v, a), torque, rtol=1e-11, atol=1e-11)


@given(seeds, sizes)
@settings(max_examples=30)
def test_forward_dynamics_undoes_inverse_dynamics(seed, joints):
    robot = random_robot(seed, joints)
    q, v, a = state(robot, seed)
    tau = robot.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(robot.forward_dynamics(q, v, tau), a, rtol=1e-7, atol=1e-7)


@given(seeds, st.integers(1, 4))
@settings(max_examples=15)
def test_the_coriolis_matrix_is_made_of_christoffel_symbols(seed, joints):
    robot = random_robot(seed, joints)
    q, v, _ = state(robot, seed)
    # dM[:, :, k] = d M / d q_k
    dM = np.stack([rate(lambda s, d=d: robot.mass_matrix(q + s * d)) for d in np.eye(joints)], axis=-1)
    christoffel = 0.5 * (dM + dM.swapaxes(1, 2) - dM.transpose(2, 1, 0))
    np.testing.assert_allclose(robot.coriolis_matrix(q, v), christoffel @ v, rtol=1e-8, atol=1e-8)


@given(seeds, sizes)
@settings(max_examples=30)
def test_m_dot_minus_two_c_is_skew_symmetric(seed, joints):
    robot = random_robot(seed, joints)
    q, v, _ = state(robot, seed)
    skew = rate(lambda s: robot.mass_matrix(q + s * v)) - 2 * robot.coriolis_matrix(q, v)
    np.testing.assert_allclose(skew, -skew.T, rtol=0, atol=1e-7 * (1 + np.abs(skew).max()))


@given(seeds, sizes)
@settings(max_examples=30)
def test_gravity_is_the_slope_of_the_potential_energy(seed, joints):
    robot = random_robot(seed, joints)
    q = state(robot, seed)[0]

    def energy(at: np.ndarray) -> float:
        data = robot.model.createData()
        return pin.computePotentialEnergy(robot.model, data, robot.configuration(at))

    slope = [rate(lambda s, d=d: energy(q + s * d)) for d in np.eye(joints)]
    np.testing.assert_allclose(robot.gravity(q), slope, rtol=1e-8, atol=1e-8)


# -- kinematics -------------------------------------------------------------------------------------------


@given(seeds, sizes)
@settings(max_examples=30)
def test_the_jacobian_maps_joint_velocities_to_the_motion_of_the_tip(seed, joints):
    robot = random_robot(seed, joints)
    q, v, _ = state(robot, seed)
    R = robot.tip_pose(q).rotation
    linear = rate(lambda s: robot.tip_position(q + s * v))
    angular = rate(lambda s: pin.log3(robot.tip_pose(q + s * v).rotation @ R.T))
    np.testing.assert_allclose(robot.jacobian(q) @ v, [*linear, *angular], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", ROBOTS)
@given(seed=seeds)
@settings(max_examples=15)
def test_the_derivative_of_a_ready_robots_jacobian_is_its_rate_of_change(name, seed):
    robot = ROBOTS[name]
    q, v, _ = state(robot, seed)
    expected = rate(lambda s: robot.jacobian(q + s * v))
    np.testing.assert_allclose(robot.jacobian_dot(q, v), expected, rtol=1e-8, atol=1e-8)


@given(seeds, sizes)
@settings(max_examples=30)
def test_the_derivative_of_the_jacobian_is_its_rate_of_change(seed, joints):
    robot = random_robot(seed, joints)
    q, v, _ = state(robot, seed)
    expected = rate(lambda s: robot.jacobian(q + s * v))
    np.testing.assert_allclose(robot.jacobian_dot(q, v), expected, rtol=1e-8, atol=1e-8)


@given(seeds, sizes)
@settings(max_examples=20)
def test_one_pass_gives_what_the_single_functions_give(seed, joints):
    robot = random_robot(seed, joints)
    q, v, _ = state(robot, seed)
    pose, J, J_dot = robot.tip_kinematics(q, v)
    pose, J, J_dot = pose.homogeneous.copy(), J.copy(), J_dot.copy()
    np.testing.assert_allclose(pose, robot.tip_pose(q).homogeneous, atol=1e-13)
    np.testing.assert_allclose(J, robot.jacobian(q), atol=1e-13)
    np.testing.assert_array_equal(J_dot, robot.jacobian_dot(q, v))


def test_an_endless_joint_counts_angles_and_not_cosines():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "endless")
    model.appendBodyToJoint(1, pin.Inertia.Random(), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", 1, 0, pin.SE3(np.eye(3), np.array([1.0, 0, 0])), pin.FrameType.OP_FRAME))
    robot = Robot(model, "tip")
    for angle in (-7.0, -0.3, 0.0, 2.0, 11.0):
        np.testing.assert_allclose(robot.tip_position([angle]), [np.cos(angle), np.sin(angle), 0], atol=1e-14)


def test_results_of_one_call_survive_the_next():
    robot = ROBOTS["a460"]
    first, second = state(robot, 1, 4), state(robot, 2, 4)
    calls = {
        robot.mass_matrix: 1,
        robot.coriolis_matrix: 2,
        robot.gravity: 1,
        robot.inverse_dynamics: 3,
        robot.forward_dynamics: 3,
        robot.regressor: 4,
        robot.tip_position: 1,
        robot.jacobian: 1,
        robot.jacobian_dot: 2,
    }
    for call, count in calls.items():
        value = call(*first[:count])
        kept = value.copy()
        call(*second[:count])
        np.testing.assert_array_equal(value, kept, err_msg=call.__name__)
    pose = robot.tip_pose(first[0])
    kept = pose.homogeneous.copy()
    robot.tip_pose(second[0])
    np.testing.assert_array_equal(pose.homogeneous, kept)


# -- placing, changing ------------------------------------------------------------------------------------


@given(seeds, st.integers(1, 4))
@settings(max_examples=20)
def test_a_placed_robot_is_the_same_robot_seen_from_elsewhere(seed, joints):
    robot = random_robot(seed, joints)
    rng = np.random.default_rng(seed)
    xyz, rpy = rng.uniform(-2, 2, (2, 3))
    base = pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
    moved = robot.placed(xyz, rpy)
    q, v, _ = state(robot, seed)
    turn = np.kron(np.eye(2), base.rotation)
    np.testing.assert_allclose(
        moved.tip_pose(q).homogeneous, (base * robot.tip_pose(q)).homogeneous, atol=1e-12
    )
    np.testing.assert_allclose(moved.jacobian(q), turn @ robot.jacobian(q), atol=1e-12)
    np.testing.assert_allclose(moved.jacobian_dot(q, v), turn @ robot.jacobian_dot(q, v), atol=1e-11)
    np.testing.assert_allclose(moved.mass_matrix(q), robot.mass_matrix(q), atol=1e-12)
    np.testing.assert_allclose(moved.coriolis_matrix(q, v), robot.coriolis_matrix(q, v), atol=1e-11)
    np.testing.assert_array_equal(moved.inertial_parameters, robot.inertial_parameters)


def test_gravity_stays_down_when_the_base_is_turned():
    robot = ROBOTS["a460"]
    q = state(robot, 5)[0]
    about_z, upside_down = robot.placed((1, 2, 3), (0, 0, 1.2)), robot.placed(rpy=(np.pi, 0, 0))
    np.testing.assert_allclose(about_z.gravity(q), robot.gravity(q), atol=1e-12)
    np.testing.assert_allclose(upside_down.gravity(q), -robot.gravity(q), atol=1e-12)
    np.testing.assert_array_equal(upside_down.gravity_vector, [0, 0, -9.81])


def test_placing_leaves_the_original_where_it_was():
    robot = random_robot(8, 3)
    q = state(robot, 8)[0]
    before = robot.tip_pose(q).homogeneous
    moved = robot.placed((1, 2, 3), (0.1, 0.2, 0.3), name="moved")
    np.testing.assert_array_equal(robot.tip_pose(q).homogeneous, before)
    assert (robot.name, moved.name) == ("random 8", "moved")


@given(seeds)
@settings(max_examples=10)
def test_placements_add_up(seed):
    rng = np.random.default_rng(seed)
    robot, first, second = random_robot(seed, 3), placement(rng), placement(rng)

    def put(robot: Robot, base: pin.SE3) -> Robot:
        return robot.placed(base.translation, pin.rpy.matrixToRpy(base.rotation))

    q = state(robot, seed)[0]
    twice, once = put(put(robot, first), second), put(robot, second * first)
    np.testing.assert_allclose(twice.tip_pose(q).homogeneous, once.tip_pose(q).homogeneous, atol=1e-12)


@given(seeds, sizes)
@settings(max_examples=20)
def test_a_robot_rebuilt_from_its_own_parameters_is_itself(seed, joints):
    robot = random_robot(seed, joints)
    rebuilt = robot.with_parameters(robot.inertial_parameters)
    q, v, a = state(robot, seed)
    np.testing.assert_allclose(rebuilt.inverse_dynamics(q, v, a), robot.inverse_dynamics(q, v, a), atol=1e-10)


def test_torque_grows_in_step_with_all_parameters():
    robot = random_robot(4, 4)
    q, v, a = state(robot, 4)
    doubled = robot.with_parameters(2 * robot.inertial_parameters)
    np.testing.assert_allclose(
        doubled.inverse_dynamics(q, v, a), 2 * robot.inverse_dynamics(q, v, a), atol=1e-11
    )


def test_a_payload_in_the_hand_needs_more_torque_than_none():
    robot = ROBOTS["a460"]
    loaded = robot.inertial_parameters
    loaded[20] += 5.0  # a point mass in the origin of the third joint
    q = np.array([0.0, 0.2, -1.0])
    assert np.linalg.norm(robot.with_parameters(loaded).gravity(q)) > np.linalg.norm(robot.gravity(q))


@pytest.mark.parametrize(
    ("index", "value", "joint"),
    [(0, 0.0, "joint1"), (0, -1.0, "joint1"), (19, 0.0, "joint2"), (11, 50.0, "joint2")],
)
def test_parameters_of_no_real_body_are_refused(index, value, joint):
    robot = ROBOTS["planar2r"]
    pi = robot.inertial_parameters
    pi[index] = value
    with refused(RobotError, f"robot 'planar2r', body of '{joint}'") as caught:
        robot.with_parameters(pi)
    assert caught.value.found <= 0


def test_an_unknown_frame_is_named_with_those_there_are():
    robot = ROBOTS["planar2r"]
    with refused(FrameNotFound, robot="planar2r", frame="tipp") as caught:
        robot.with_tip("tipp")
    assert {"tip", "link1", "link2"} <= set(caught.value.available)


def test_the_tip_can_be_any_frame():
    robot = ROBOTS["planar2r"]
    elbow = robot.with_tip("link2")
    np.testing.assert_allclose(
        elbow.tip_position([0.5, 1.0]), [0.3 * np.cos(0.5), 0.3 * np.sin(0.5), 0], atol=1e-15
    )


@pytest.mark.parametrize(
    "joint", [pin.JointModelFreeFlyer(), pin.JointModelPlanar(), pin.JointModelSpherical()]
)
def test_a_joint_with_several_velocities_is_refused(joint):
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "loose")
    model.appendBodyToJoint(1, pin.Inertia.Random(), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with refused(RobotError, "robot ''", found="loose"):
        Robot(model, "tip")


def test_joints_that_are_not_numbered_branch_after_branch_are_refused():
    model = pin.Model()
    for name, parent in (("trunk", 0), ("left", 1), ("right", 1), ("left hand", 2)):
        joint = model.addJoint(parent, pin.JointModelRY(), pin.SE3.Random(), name)
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    with refused(RobotError, "robot ''", found="left"):
        Robot(model, "left hand")


def test_matrices_of_a_single_joint_are_still_matrices():
    robot = random_robot(0, joints=1)
    q, v, v_ref, a_ref = state(robot, 0, 4)
    assert robot.mass_matrix(q).shape == robot.coriolis_matrix(q, v).shape == (1, 1)
    assert robot.jacobian(q).shape == robot.jacobian_dot(q, v).shape == (6, 1)
    assert robot.regressor(q, v, v_ref, a_ref).shape == (1, 10)


# -- the robots of the paper ------------------------------------------------------------------------------


def test_the_planar_arm_is_table_three():
    robot = ROBOTS["planar2r"]
    rng = np.random.default_rng(0)
    for q1, q2 in rng.uniform(-3, 3, (20, 2)):
        x, y = 0.3 * (np.cos(q1) + np.cos(q1 + q2)), 0.3 * (np.sin(q1) + np.sin(q1 + q2))
        np.testing.assert_allclose(robot.tip_position([q1, q2]), [x, y, 0], atol=1e-15)
    assert [inertia.mass for inertia in robot.model.inertias.tolist()[1:]] == [1.0, 1.0]


def test_gravity_does_no_work_on_the_planar_arms():
    robot = ROBOTS["planar2r"].placed((1, 2, 0), (0, 0, 0.7))
    for q in np.random.default_rng(0).uniform(-3, 3, (20, 2)):
        np.testing.assert_allclose(robot.gravity(q), 0, atol=1e-13)


@pytest.mark.parametrize(
    ("angles", "wrist"),
    [
        (INITIAL[0], (0.1325, 0.4427, 0.4849)),
        (INITIAL[1], (0.3912, 0.1067, 0.5050)),
        (FINAL[0], (0.0, 0.4435, 0.4843)),
        (FINAL[1], (0.3912, -0.0203, 0.5050)),
    ],
    ids=["robot 1 initial", "robot 2 initial", "robot 1 final", "robot 2 final"],
)
def test_the_wrist_centres_of_table_one(angles, wrist):
    np.testing.assert_allclose(ROBOTS["a460"].tip_position(angles), wrist, rtol=0, atol=1e-4)


def test_the_wrist_centre_follows_from_the_dh_lengths():
    for q1, q2, q3 in np.random.default_rng(1).uniform(-3, 3, (20, 3)):
        forearm = q2 + q3 + np.pi / 2
        reach = 0.3048 * np.cos(q2) + 0.3302 * np.cos(forearm)
        height = 0.3302 + 0.3048 * np.sin(q2) + 0.3302 * np.sin(forearm)
        expected = [reach * np.cos(q1), reach * np.sin(q1), height]
        np.testing.assert_allclose(ROBOTS["a460"].tip_position([q1, q2, q3]), expected, atol=1e-12)


def test_the_a460_has_the_masses_of_its_description():
    # link 1, link 2, link 3 with the lumped wrist
    masses = ROBOTS["a460"].inertial_parameters[::10]
    np.testing.assert_allclose(masses, [9.0, 6.0, 6.0], atol=1e-12)


def test_numbers_that_are_not_finite_are_refused_where_a_robot_is_made():
    robot = ROBOTS["planar2r"]
    for bad in ((np.nan, 0, 0), (0, 0), "here", (0, np.inf, 0)):
        with refused(InputError, "xyz"):
            robot.placed(bad)


@pytest.mark.parametrize("name", ["planar2r", "panda"])
@pytest.mark.parametrize("bad", [[1.0], "ab", np.full(9, np.nan), None, np.zeros((9, 1))])
def test_states_that_do_not_fit_are_refused_with_their_name(name, bad):
    robot = load_robot(name)
    bad = bad[: robot.nv] if isinstance(bad, np.ndarray) else bad
    good = np.zeros(robot.nv)
    for method in (robot.mass_matrix, robot.gravity, robot.tip_pose, robot.jacobian, robot.configuration):
        with refused(InputError, "q"):
            method(bad)
    for method in (robot.coriolis_matrix, robot.jacobian_dot):
        with refused(InputError, "v"):
            method(good, bad)
    with refused(InputError, "a"):
        robot.inverse_dynamics(good, good, bad)
    with refused(InputError, "tau"):
        robot.forward_dynamics(good, good, bad)


def test_a_frame_that_is_missing_is_the_same_error_in_another_process():
    error = pickle.loads(pickle.dumps(FrameNotFound("arm", "tipp", ["tip", "base"])))
    assert (error.robot, error.frame, error.available) == ("arm", "tipp", ("tip", "base"))
    assert "did you mean 'tip'" in str(error)


@pytest.mark.parametrize("armature", [[0.1], [0.1, 0.1, 0.1], np.zeros((2, 2)), -0.1, [0.1, np.nan], None])
def test_rotors_are_one_number_or_one_per_joint_of_at_least_0(armature):
    robot = load_robot("planar2r")
    with refused(InputError, "armature"):
        robot.with_armature(armature)
    assert (robot.with_armature(0.1).armature == robot.with_armature([0.1, 0.1]).armature).all()
