"""That a document has the dynamics of the MuJoCo model it was written from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from .build import build_model
from .document import Document

SAMPLES = 3
SAME = 1e-9
"""Relative to the largest torque; rounding alone is some 1e-15."""


def check_dynamics(mujoco: Any, compiled: Any, document: Document, held: Mapping[str, float]) -> None:
    """Compare inverse dynamics in a few states, the same in every run.

    Args:
        mujoco: the library.
        compiled: its model.
        document: what was written of it.
        held: positions of the joints that are fixed in the document, rad or m.

    Raises:
        RobotError: they differ, so something acts in the file that is not read here.
    """
    if not document.moving_joints:
        return
    model = build_model(document)
    joints = [compiled.joint(name) for name in list(model.names)[1:]]
    places = [(int(joint.qposadr[0]), int(joint.dofadr[0])) for joint in joints]
    compiled.opt.gravity[:], compiled.opt.disableflags = model.gravity.linear, 0
    rng = np.random.default_rng(0)
    for _ in range(SAMPLES):
        q, v, a = rng.uniform(-1, 1, (3, model.nv))
        data = mujoco.MjData(compiled)
        for name, position in held.items():
            data.joint(name).qpos[0] = position
        expected = _torque(mujoco, compiled, data, places, (q, v, a))
        found = pin.rnea(model, model.createData(), pin.integrate(model, pin.neutral(model), q), v, a)
        if abs(found - expected).max() > SAME * max(abs(expected).max(), 1e-9):
            raise document.error(
                f"expected the torque that MuJoCo computes, {expected}, found {found}: something in the file "
                "acts on the joints that is not read here"
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
