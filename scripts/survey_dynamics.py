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

    Joints that the robot does not have are held there, too, at 0 or as near to it as they can go, or where
    the joint is that they follow.
    """
    model = _reduced(robot, model, followers)
    rng, order = np.random.default_rng(0), _order(robot, model)
    worst = dict.fromkeys(("M", "C", "g", "regressor"), 0.0)
    for _ in range(SAMPLES):
        q, v, v_ref, a_ref = rng.uniform(-1, 1, (4, robot.nv))
        ours = (
            robot.mass_matrix(q),
            robot.coriolis_matrix(q, v),
            robot.gravity(q),
            robot.regressor(q, v, v_ref, a_ref),
        )
        theirs = _theirs(model, order, q, v, v_ref, a_ref)
        for name, a, b in zip(worst, ours, theirs, strict=True):
            worst[name] = max(worst[name], float(abs(a - b).max() / max(abs(b).max(), 1e-9)))
    return worst


def _order(robot: Robot, model: pin.Model) -> np.ndarray:
    """Where each joint of the robot is in the velocities of a model."""
    return np.array([model.joints[model.getJointId(name)].idx_v for name in robot.joint_names])


def _reduced(robot: Robot, model: pin.Model, followers: Followers) -> pin.Model:
    held = [k for k, name in enumerate(model.names) if k and name not in robot.joint_names]
    q = pin.neutral(model)
    for joint in (joint for k in held if (joint := model.joints[k]).nq == 1):
        q[joint.idx_q] = _place(model, model.names[joint.id], followers)
    return pin.buildReducedModel(model, held, q)


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
    found = {}
    for joint in ElementTree.fromstring(text.encode()).findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            numbers = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
            found[joint.get("name", "")] = mimic.get("joint", ""), *numbers
    return found


def _theirs(
    model: pin.Model, order: np.ndarray, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray
) -> tuple[np.ndarray, ...]:
    """M, C, g and the Slotine-Li regressor by Pinocchio alone, in the robot's order of joints."""

    def sorted_in(vector: np.ndarray) -> np.ndarray:
        there = np.zeros(model.nv)
        there[order] = vector
        return there

    data, weightless = model.createData(), pin.Model(model)
    weightless.gravity.setZero()
    q, v, v_ref, a_ref = map(sorted_in, (q, v, v_ref, a_ref))
    q = pin.integrate(model, pin.neutral(model), q)
    M = pin.crba(model, data, q).copy()
    C = pin.computeCoriolisMatrix(model, data, q, v).copy()
    g = pin.computeGeneralizedGravity(model, data, q).copy()
    Y = pin.computeJointTorqueRegressor(model, data, q, (v + v_ref) / 2, a_ref).copy()
    Y -= pin.computeJointTorqueRegressor(weightless, weightless.createData(), q, (v - v_ref) / 2, 0 * v)
    columns = np.concatenate([np.arange(10 * k, 10 * k + 10) for k in order])
    grid = np.ix_(order, order)
    return M[grid], C[grid], g[order], np.atleast_2d(Y)[order][:, columns]


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
