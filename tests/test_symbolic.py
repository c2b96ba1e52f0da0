"""The recursions of the compiled engine against Pinocchio, for robots nobody chose."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import inertia, random_robot
from refusals import refused

from synctrl import Robot, load_robot
from synctrl.errors import RobotError
from synctrl.robots.articulated import accelerations
from synctrl.robots.base_parameters import BaseParameters
from synctrl.robots.lumped import bodies_of, lumped_bodies, lumping
from synctrl.robots.mechanism import mechanism
from synctrl.robots.symbolic import Symbols

ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


def evaluated(robot, gathered, q, v, v_ref, a_ref, s):
    """Torque, mass matrix, tip and adaptation of a robot, by the symbolic recursions."""
    fixed, base = mechanism(robot)
    n = robot.nv
    symbols = [ca.SX.sym(name, n) for name in ("q", "v", "v_ref", "a_ref", "s")]
    pi = ca.SX.sym("pi", 10 * n)
    recursion = Symbols(fixed, symbols[0], ca.sin(symbols[0]), ca.cos(symbols[0]))
    gravity = ca.SX(base.rotation.T @ robot.gravity_vector)
    bodies = gathered(fixed, pi)
    torque = recursion.torque(bodies, *symbols[1:4], gravity)
    tip = recursion.tip(symbols[1], ca.SX(base.rotation), ca.SX(base.translation))
    outputs = [torque, recursion.mass_matrix(bodies), *tip, ca.jtimes(torque, pi, symbols[4], True)]
    outputs.append(recursion.bias(bodies, symbols[1], gravity))
    function = ca.Function("f", [*symbols, pi], outputs)
    return [np.array(value) for value in function(q, v, v_ref, a_ref, s, robot.inertial_parameters)]


def serial_robot(seed):
    """A random robot with one joint on the base."""
    for attempt in range(100):
        robot = random_robot(1000 * seed + attempt)
        parents = list(robot.model.parents)[1:]
        if parents.count(0) == 1 and robot.model.frames[robot.tip_id].parentJoint > 0:
            return robot
    raise AssertionError("no such robot among a hundred")


def aligned_robot(seed):
    """A tree of joints along axes of coordinates, many of them parallel, some with rotors."""
    rng = np.random.default_rng(seed)
    model, turns = pin.Model(), [pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ]
    slides = [pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ]
    often, branch = rng.integers(3), [0]
    for k in range(5):
        if k > 1 and rng.random() < 0.3:
            branch.pop()
        axis = often if rng.random() < 0.6 else rng.integers(3)
        kind = (slides if rng.random() < 0.25 else turns)[axis]()
        turn = pin.utils.rotate("xyz"[rng.integers(3)], np.pi / 2)
        turn = np.linalg.matrix_power(turn, int(rng.integers(4) * rng.integers(2)))
        place = pin.SE3(turn, rng.normal(size=3) * rng.integers(0, 2, 3))
        branch.append(model.addJoint(branch[-1], kind, place, f"joint{k + 1}"))
        model.appendBodyToJoint(branch[-1], inertia(rng), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", 5, 0, pin.SE3(np.eye(3), rng.normal(size=3)), pin.FrameType.OP_FRAME))
    model.gravity.linear = -9.81 * np.eye(3)[rng.integers(3)]
    model.armature = rng.uniform(0, 1, 5) * rng.integers(0, 2, 5)
    return Robot(model, "tip")


def robots(seed):
    """Robots nobody chose: one of any axes, and one of axes along coordinates."""
    return serial_robot(seed).placed((0.3, -0.2, 0.5), (0.4, -1.0, 2.0)), aligned_robot(seed)


#: ways to make bodies of inertial parameters
GATHERED = {"as they are": lambda fixed, pi: bodies_of(pi), "lumped": lumped_bodies}


@pytest.mark.parametrize("way", GATHERED)
@settings(max_examples=15)
@given(seed=st.integers(0, 2**20))
def test_symbolic_recursions_agree_with_pinocchio(way, seed):
    for robot in robots(seed):
        agree_with_pinocchio(robot, GATHERED[way], np.random.default_rng(seed))


def agree_with_pinocchio(robot, gathered, rng):
    """That a robot's torques, matrices and tip at a random state are those of Pinocchio."""
    q, v, v_ref, a_ref, s = rng.uniform(-1.5, 1.5, (5, robot.nv))
    found = evaluated(robot, gathered, q, v, v_ref, a_ref, s)
    torque, M, x, R, J, J_dot, adaptation, bias = found
    Y = robot.regressor(q, v, v_ref, a_ref)
    pose = robot.tip_pose(q)
    expected = {
        "torque": (torque[:, 0], Y @ robot.inertial_parameters),
        "mass matrix": (M, robot.mass_matrix(q)),
        "position": (x[:, 0], pose.translation),
        "rotation": (R, pose.rotation),
        "Jacobian": (J, robot.jacobian(q)),
        "Jacobian's derivative": (J_dot, robot.jacobian_dot(q, v)),
        "Y^T s": (adaptation[:, 0], Y.T @ s),
        "bias": (bias[:, 0], robot.regressor(q, v, v, 0 * v) @ robot.inertial_parameters),
    }
    for name, (found, reference) in expected.items():
        np.testing.assert_allclose(found, reference, atol=1e-11 * (1 + np.abs(reference).max()), err_msg=name)


@pytest.mark.parametrize("way", GATHERED)
@settings(max_examples=15)
@given(seed=st.integers(0, 2**20))
def test_articulated_bodies_accelerate_as_those_of_pinocchio(way, seed):
    for robot in robots(seed):
        fixed, base = mechanism(robot)
        q, v, tau, pi = (
            ca.SX.sym(name, size * robot.nv) for name, size in zip("qvtp", (1, 1, 1, 10), strict=True)
        )
        recursion = Symbols(fixed, q, ca.sin(q), ca.cos(q))
        bodies = GATHERED[way](fixed, pi)
        forces = recursion.biased(bodies, v, ca.SX(base.rotation.T @ robot.gravity_vector))
        function = ca.Function("f", [q, v, tau, pi], [accelerations(recursion, bodies, forces, tau)])
        state = np.random.default_rng(seed).uniform(-1.5, 1.5, (3, robot.nv))
        found = np.array(function(*state, robot.inertial_parameters))[:, 0]
        expected = robot.forward_dynamics(*state)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * (1 + np.abs(expected).max()))


def test_mass_that_does_not_act_is_lumped_away():
    """Gautier and Khalil: 36 of 60 for an arm like the UR5, of which gravity is along the first axis."""
    counts = {name: lumping(mechanism(load_robot(name))[0]).size for name in ("planar2r", "ur5", "panda")}
    acting = {name: BaseParameters(load_robot(name)).grouping.rank for name in counts}
    for name, count in counts.items():
        assert acting[name] <= count <= acting[name] + 2  # gravity is not looked at: the first body's centre


def test_lumped_parameters_are_a_map_of_all():
    robot = aligned_robot(3)
    fixed, _ = mechanism(robot)
    lumps, pi = lumping(fixed), ca.SX.sym("pi", 10 * robot.nv)
    numbers = ca.SX.sym("numbers", lumps.size)
    ways = lumped_bodies(fixed, pi), lumps.bodies(numbers)
    packed = [ca.vertcat(*(ca.vec(part) for body in way for part in body)) for way in ways]
    theta = np.random.default_rng(0).normal(size=10 * robot.nv)
    expected = ca.Function("f", [pi], [packed[0]])(theta)
    found = ca.Function("f", [numbers], [packed[1]])(lumps.matrix @ theta)
    np.testing.assert_allclose(np.array(found), np.array(expected), atol=1e-12)


def test_a_mechanism_does_not_depend_on_where_the_robot_stands():
    robot = load_robot("a460")
    here, _ = mechanism(robot)
    there, base = mechanism(robot.placed((1, 2, 3), (0.1, 0.2, 0.3)))
    assert here.key() == there.key()
    np.testing.assert_allclose(base.translation[:2], (1, 2), atol=0.2)


def test_a_mechanism_is_found_once_for_as_long_as_its_robot_exists():
    robot = load_robot("planar2r")
    placed = [robot.placed((i, 0, 0)) for i in range(300)]
    found = [mechanism(each) for each in placed]
    assert all(mechanism(each) is kept for each, kept in zip(placed, found, strict=True))
    gone = weakref.ref(placed.pop())
    gc.collect()
    assert gone() is None


def test_a_tip_on_the_base_is_refused():
    robot = load_robot("a460")
    fixed = next(f.name for f in robot.model.frames if f.parentJoint == 0 and f.name != "universe")
    with refused(RobotError, "robot 'a460'"):
        mechanism(robot.with_tip(fixed))
