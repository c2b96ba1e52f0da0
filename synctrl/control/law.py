"""From errors to torque: what every law of the package has in common, to be read beside the paper.

Every function is plain array arithmetic on rows, one row per robot: e is (n, m) and c is (n, m, m). With the
leading axis left out they describe a single robot, and they never ask what their numbers are, so the same
lines can be traced with symbols: that is how the compiled engine makes C of them. Gains are diagonal, given
as vectors. A torque is computed in the order below, by `Controller.signals`; the right column says where each
line is. A prime is a derivative with respect to time, so w' is called `w_dot`.

    w, w'              weighted errors                            compute_weighted_errors
    E, sigma, sigma'   what a robot hears of the others           the network
    xref', xref'', f   reference motion and force, task space     the law, for example laws/sun_mills.py
    v_ref, a_ref, s_q  the same in joint space                    compute_joint_command
    tau                Y theta_hat + K_r s_q + J^T f              compute_joint_command, and the model
    theta_hat'         Gamma Y^T s_q                              the adaptation

`E`, `sigma`, `sigma_dot` are what the coupling hands to a robot: S^T times the integrals of epsilon, epsilon
itself, and its derivative. For a pair or ring these are the sums over the robot's synchronization errors.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..coupling.weights import Weights
from ..tasks.spaces import BoundSpace
from .laws import Asked

Array = np.ndarray


class JointCommand(NamedTuple):
    """What the joints are to do, one row per robot, (n, nv) each.

    Attributes:
        v_ref, a_ref: reference velocity and acceleration, rad/s and rad/s^2.
        s_q: velocity error v_ref - v, rad/s.
        feedback: torque beside that of the model: damping, and the force of the law, N·m.
    """

    v_ref: Array
    a_ref: Array
    s_q: Array
    feedback: Array


def compute_weighted_errors(weights: Weights, error: Array) -> Array:
    """w_i = c_i e_i, the error in the unit of the synchronization function, and w_i', (2, n, m)."""
    w = np.matvec(weights.c, error)
    if weights.move:
        w[1] += np.matvec(weights.c_dot, error[0])
    return w


def compute_joint_command(
    asked: Asked, task: Any, v: Array, space: BoundSpace, K_r: Array, k_r_space: str
) -> JointCommand:
    """Reference motion of the joints, and K_r s_q + J^T f, the last two terms of (13) and (32).

    Damping that acts in task space is J^T K_r c^-1 r, where c^-1 r = c^-1 u - x' = xref' - x'.

    Args:
        asked: what the law asks for in task space.
        task: where the robots are, as `space` measured it.
        v: joint velocities, (n, nv), rad/s.
        space: the way from task to joints.
        K_r: damping, (n, nv), or (n, m) in task space.
        k_r_space: "joint" or "task", where it acts.
    """
    v_ref, a_ref = space.to_joints(task, asked.xref_dot, asked.xref_ddot)
    s_q = v_ref - v
    if k_r_space == "joint":
        return JointCommand(v_ref, a_ref, s_q, K_r * s_q + space.to_torque(task, asked.force))
    slip = asked.xref_dot - task.x_dot
    return JointCommand(v_ref, a_ref, s_q, space.to_torque(task, K_r * slip + asked.force))
