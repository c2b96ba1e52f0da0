"""The recursions of the compiled engine against Pinocchio, for robots nobody chose."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import random_robot
from refusals import refused

from synctrl import load_robot
from synctrl.errors import RobotError
from synctrl.robots.mechanism import mechanism
from synctrl.robots.symbolic import Symbols

ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


def evaluated(robot, q, v, v_ref, a_ref, s):
    """Torque, mass matrix, tip and adaptation of a robot, by the symbolic recursions."""
    fixed, base = mechanism(robot)
    n = robot.nv
    symbols = [ca.SX.sym(name, n) for name in ("q", "v", "v_ref", "a_ref", "s")]
    pi = ca.SX.sym("pi", 10 * n)
    recursion = Symbols(fixed, symbols[0], ca.sin(symbols[0]), ca.cos(symbols[0]))
    gravity = ca.SX(base.rotation.T @ robot.gravity_vector)
    torque = recursion.torque(pi, *symbols[1:4], gravity)
    tip = recursion.tip(symbols[1], ca.SX(base.rotation), ca.SX(base.translation))
    outputs = [torque, recursion.mass_matrix(pi), *tip, ca.jtimes(torque, pi, symbols[4], True)]
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


@settings(max_examples=15)
@given(st.integers(0, 2**20))
def test_symbolic_recursions_agree_with_pinocchio(seed):
    robot = serial_robot(seed).placed((0.3, -0.2, 0.5), (0.4, -1.0, 2.0))
    rng = np.random.default_rng(seed)
    q, v, v_ref, a_ref, s = rng.uniform(-1.5, 1.5, (5, robot.nv))
    torque, M, x, R, J, J_dot, adaptation = evaluated(robot, q, v, v_ref, a_ref, s)
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
    }
    for name, (found, reference) in expected.items():
        np.testing.assert_allclose(found, reference, atol=1e-11 * (1 + np.abs(reference).max()), err_msg=name)


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
