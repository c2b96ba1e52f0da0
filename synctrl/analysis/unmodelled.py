"""Torques that the proof does not know, along a run, by what they come from.

With s = s_q, what the law's f asks for, and Y tilde less its part that no adaptation changes, a run obeys

    M s' + C s = Y tilde - K_r s - J^T f - F_v s + d,    d = sum of all torques here,

whatever acts: "other" is d less what has a name, found from the accelerations of the plant.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .lyapunov import reference_gap
from .replay import Replay


def unmodelled(run: Replay, further: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Torques d by source, (R, n, nv) each, N·m, with the sign that they have beside -K_r s_q.

    "friction", "disturbance" and "saturation" are what they say; "model error" what wrong parameters with
    Gamma = 0 do, "weight rate" what the paper's reference acceleration leaves out, and "network" what the
    reference acceleration does not know of the network. Under sampled control, whose torques are `further`,
    that is part of "sampling".

    Args:
        run: instants of the run.
        further: torques that have a name already.
    """
    x = run.rows
    named = {
        "friction": x.friction,
        "disturbance": -x.disturbance,
        "saturation": x.cut_off,
        "model error": x.frozen,
        "weight rate": np.matvec(x.M, reference_gap(run)),
        **(further or {"network": np.matvec(x.M, x.gap)}),
    }
    s_q_dot = x.a_ref + x.gap + reference_gap(run) - x.v_dot
    adapted = x.lacking - x.frozen - x.friction_damping
    total = np.matvec(x.M, s_q_dot) + x.C_s - adapted + feedback(run)
    named["other" if run.loop.chain is None else "what is held"] = total - sum(named.values())
    return named


def feedback(run: Replay) -> np.ndarray:
    """K_r s_q + J^T f, (R, n, nv), N·m, what the law adds to the torque of its model."""
    x, controller = run.rows, run.loop.controller
    if controller.k_r_space == "joint":
        return controller.K_r * x.s_q + np.vecmat(x.force, x.J)
    return np.vecmat(controller.K_r * np.matvec(x.c_inv, x.r) + x.force, x.J)
