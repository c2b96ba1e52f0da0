"""The momentum of a robot, p = M v, and what changes it: both are linear in what is adapted.

    Y_p theta = M v,   Y_h theta = g - C^T v + friction,   p' = tau - Y_h theta.

No acceleration is in them. They are made of Y alone, Y theta = M a_ref + C v_ref + g + friction, so that they
exist for parameters of every kind: C^T v has the entries v^T C e_k, and of all that Y may have, C e_k alone
is linear in v_ref and odd in v. From M' = C + C^T follows Y_h theta = C v + g + friction - M' v.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .parameters import Parameters
from .robot import Robot


def momentum_regressors(
    parameters: Parameters, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Y_p and Y_h of one robot, (nv, P) each: Y_p theta is in N·m·s (N·s), Y_h theta in N·m (N).

    Args:
        parameters: what is adapted.
        q, v: joint positions and velocities, (nv,), rad and rad/s (m and m/s).
    """
    Y, still, units = parameters.regressor, np.zeros_like(v), np.eye(len(v))
    rest, back = Y(q, v, still, still), Y(q, -v, still, still)
    C = 0.5 * np.array([Y(q, v, e, still) - rest - Y(q, -v, e, still) + back for e in units])  # of C e_k
    return Y(q, v, still, v) - rest, Y(q, v, v, still) - np.tensordot(v, C, 1) - v @ C


def momentum_of_all(
    robots: Sequence[Robot], parameters: Sequence[Parameters], q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Y_p and Y_h of n robots, (n, nv, P) each; rows and columns that a robot does not have are zero.

    Args:
        robots: the robots.
        parameters: what is adapted, one entry per robot.
        q, v: joint positions and velocities, (n, nv).
    """
    found = np.zeros((2, *q.shape, max(len(one.theta) for one in parameters)))
    for i, (robot, one) in enumerate(zip(robots, parameters, strict=True)):
        nv, P = robot.nv, len(one.theta)
        found[:, i, :nv, :P] = momentum_regressors(one, q[i, :nv], v[i, :nv])
    return found[0], found[1]
