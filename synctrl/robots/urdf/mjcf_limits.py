"""Limits of the joints of a compiled MuJoCo model: their ranges, and what their actuators can do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .document import Limit
from .report import Notes


def joint_limits(mujoco: Any, model: Any, names: list[str], notes: Notes) -> list[Limit]:
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
        notes.add("assumed", f"joint '{name}', limit", text)
    return low
