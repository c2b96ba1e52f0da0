"""A compiled MuJoCo model: the limits of its joints, and that a document has the dynamics it computes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from .build import build_model
from .document import Document, Limit
from .report import Notes
from .xml import quoted


def read_limits(mujoco: Any, model: Any, names: list[str], notes: Notes) -> list[Limit]:
    """The limits of each joint. MJCF knows no limit of speed."""
    effort = _efforts(mujoco, model, names, notes)
    limits = []
    for joint, name in enumerate(names):
        limited = bool(model.jnt_actfrclimited[joint])
        most = _smaller(model.jnt_actfrcrange[joint], name, notes) if limited else math.inf
        ends = (float(end) for end in model.jnt_range[joint]) if model.jnt_limited[joint] else (None, None)
        limits.append(Limit(min(most, effort[joint]), math.inf, *ends))
    return limits


def _efforts(mujoco: Any, model: Any, names: list[str], notes: Notes) -> np.ndarray:
    """What all actuators of each joint can do together, N·m (N); infinite where nothing limits them."""
    effort, driven = np.zeros(len(names)), np.zeros(len(names), bool)
    direct = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    for k in range(model.nu):
        if model.actuator_trntype[k] in direct:
            joint = model.actuator_trnid[k, 0]
            driven[joint] = True
            effort[joint] += abs(model.actuator_gear[k, 0]) * _force(mujoco, model, k, names[joint], notes)
    effort[~driven | (effort == 0)] = math.inf
    return effort


def _force(mujoco: Any, model: Any, k: int, name: str, notes: Notes) -> float:
    """The largest force of an actuator before its gear."""
    if model.actuator_forcelimited[k]:
        return _smaller(model.actuator_forcerange[k], name, notes)
    fixed = model.actuator_gaintype[k] == int(mujoco.mjtGain.mjGAIN_FIXED)
    motor = fixed and model.actuator_biastype[k] == int(mujoco.mjtBias.mjBIAS_NONE)
    if motor and model.actuator_ctrllimited[k]:
        return abs(float(model.actuator_gainprm[k, 0])) * _smaller(model.actuator_ctrlrange[k], name, notes)
    return math.inf


def _smaller(ends: np.ndarray, name: str, notes: Notes) -> float:
    """The size that a range has to both sides; the smaller one where they differ."""
    low, high = sorted(float(end) for end in abs(ends))
    if low != high:
        text = f"the smaller limit of force, {low:g}, to both sides, where one side has {high:g}"
        notes.add("assumed", f"joint {quoted(name)}, limit", text)
    return low


SAMPLES = 3
SAME = 1e-9
"""Relative to the largest torque; rounding alone is some 1e-15."""


def check_dynamics(
    mujoco: Any, compiled: Any, names: list[str], document: Document, held: Mapping[str, float]
) -> None:
    """Compare inverse dynamics in a few states, the same in every run.

    Args:
        mujoco: the library.
        compiled: its model.
        names: what the document calls its joints; some have no name of their own.
        document: what was written of it.
        held: positions of the joints that are fixed in the document, rad or m.

    Raises:
        RobotError: they differ, so something acts in the file that is not read here.
    """
    if not document.moving_joints:
        return
    model = build_model(document)
    joints = [compiled.joint(names.index(name)) for name in list(model.names)[1:]]
    places = [(int(joint.qposadr[0]), int(joint.dofadr[0])) for joint in joints]
    compiled.opt.gravity[:], compiled.opt.disableflags = model.gravity.linear, 0
    rng = np.random.default_rng(0)
    for _ in range(SAMPLES):
        q, v, a = rng.uniform(-1, 1, (3, model.nv))
        data = mujoco.MjData(compiled)
        for name, position in held.items():
            data.joint(names.index(name)).qpos[0] = position
        expected = _torque(mujoco, compiled, data, places, (q, v, a))
        found = pin.rnea(model, model.createData(), pin.integrate(model, pin.neutral(model), q), v, a)
        if abs(found - expected).max() > SAME * max(abs(expected).max(), 1e-9):
            raise document.error(
                f"expected the torque that MuJoCo computes, {expected}, found {found}: something in the file "
                "acts on the joints that is not read here",
                found=found,
            )


def _torque(
    mujoco: Any, compiled: Any, data: Any, places: list[tuple[int, int]], state: tuple[np.ndarray, ...]
) -> np.ndarray:
    """M a and what gravity and velocity add, by MuJoCo, in our order of joints."""
    acceleration, torque = np.zeros((2, compiled.nv))
    for (position, dof), q, v, a in zip(places, *state, strict=True):
        data.qpos[position], data.qvel[dof], acceleration[dof] = q, v, a
    mujoco.mj_fwdPosition(compiled, data)
    mujoco.mj_fwdVelocity(compiled, data)
    mujoco.mj_mulM(compiled, data, torque, acceleration)
    return np.array(torque + data.qfrc_bias)[[dof for _, dof in places]]
