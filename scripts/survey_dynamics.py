"""A robot as it was loaded against plain Pinocchio on its file, and one engine against the other."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from synctrl import Cell, Coupling, Gains, Hold, Member, Robot, simulate
from synctrl.errors import SimulationError

SAMPLES = 5
MOVED = 1e-3

Followers = Mapping[str, tuple[str, float, float]]
"""By joint: the joint that it mimics, multiplier and offset."""


def differences(
    robot: Robot, model: pin.Model, followers: Followers = MappingProxyType({})
) -> dict[str, float]:
    """Largest relative differences of a robot from Pinocchio's own model of its file.

    Joints that the robot does not have stand there at 0, or as near to it as they can go, or where the joint
    is that they follow. The regressor is compared by the torque that it gives with the true parameters.
    """
    rng, order = np.random.default_rng(0), _order(robot, model)
    worst = dict.fromkeys(("M", "C", "g", "regressor"), 0.0)
    for _ in range(SAMPLES):
        q, v, v_ref, a_ref = rng.uniform(-1, 1, (4, robot.nv))
        ours = (
            robot.mass_matrix(q),
            robot.coriolis_matrix(q, v),
            robot.gravity(q),
            robot.regressor(q, v, v_ref, a_ref) @ robot.inertial_parameters,
        )
        at = _configuration(model, followers, dict(zip(robot.joint_names, q, strict=True)))
        moving = [_all_joints(model, order, vector) for vector in (v, v_ref, a_ref)]
        for name, a, b in zip(worst, ours, _theirs(model, order, at, *moving), strict=True):
            worst[name] = max(worst[name], float(abs(a - b).max() / max(abs(b).max(), 1e-9)))
    return worst


def _order(robot: Robot, model: pin.Model) -> np.ndarray:
    """Where each joint of the robot is in the velocities of a model."""
    return np.array([model.joints[model.getJointId(name)].idx_v for name in robot.joint_names])


def _all_joints(model: pin.Model, order: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Velocities of all joints of a model, those of the robot given and others 0."""
    there = np.zeros(model.nv)
    there[order] = vector
    return there


def _configuration(model: pin.Model, followers: Followers, moving: Mapping[str, float]) -> np.ndarray:
    angles = np.zeros(model.nv)
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        angles[joint.idx_v] = moving[name] if name in moving else _place(model, name, followers)
    return pin.integrate(model, pin.neutral(model), angles)


def _place(model: pin.Model, name: str, followers: Followers) -> float:
    if name in followers:
        leader, multiplier, offset = followers[name]
        return offset + multiplier * (
            _place(model, leader, followers) if model.existJointName(leader) else 0.0
        )
    joint = model.joints[model.getJointId(name)]
    if joint.nq != 1:
        return 0.0
    return float(np.clip(0, model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]))


def followers_in(text: str) -> Followers:
    """The joints of a URDF that mimic another."""
    found = {}
    for joint in parse(text).findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            numbers = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
            found[joint.get("name", "")] = mimic.get("joint", ""), *numbers
    return found


def parse(text: str) -> ElementTree.Element:
    """The root of a URDF that has been decoded, whatever encoding it declares."""
    return ElementTree.fromstring(text.encode(), ElementTree.XMLParser(encoding="utf-8"))


def _theirs(
    model: pin.Model, order: np.ndarray, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray
) -> tuple[np.ndarray, ...]:
    """M, C, g and torque by the Slotine-Li regressor, by Pinocchio alone, in the robot's order of joints."""
    data, weightless, grid = model.createData(), pin.Model(model), np.ix_(order, order)
    weightless.gravity.setZero()
    M = pin.crba(model, data, q).copy()
    C = pin.computeCoriolisMatrix(model, data, q, v).copy()
    g = pin.computeGeneralizedGravity(model, data, q).copy()
    Y = pin.computeJointTorqueRegressor(model, data, q, (v + v_ref) / 2, a_ref).copy()
    Y -= pin.computeJointTorqueRegressor(weightless, weightless.createData(), q, (v - v_ref) / 2, 0 * v)
    parameters = np.concatenate([inertia.toDynamicParameters() for inertia in list(model.inertias)[1:]])
    return M[grid], C[grid], g[order], (np.atleast_2d(Y) @ parameters)[order]


def loop_difference(robot: Robot, duration: float = 0.1) -> float:
    """How far the two engines are from each other when two of the robot are brought in step, rad or m."""
    start = np.full(robot.nv, 0.1)
    members = [Member(robot, Hold(start), start + shift) for shift in (0.1, -0.2)]
    inertia = np.diag(robot.mass_matrix(start))
    gains = Gains(Lambda=5.0, beta=1.0, K_r=10 * inertia, K_eps=10 * float(inertia.min()), Gamma=0.0)
    cell = Cell(members, Coupling.pair())
    runs = [simulate(cell, gains, duration, engine=engine) for engine in ("pinocchio", "compiled")]
    if not abs(runs[0].q[-1] - runs[0].q[0]).max() > MOVED:
        raise SimulationError("expected robots that move, found that they stand still")
    return float(abs(runs[0].q - runs[1].q).max())
