"""The law, one function per line of the paper.

Every function is plain array arithmetic on rows, one row per robot: e is (n, m) and c is (n, m, m). With the
leading axis left out they describe a single robot, and they never ask what their numbers are, so the same
lines can be traced with symbols. Gains are diagonal, given as vectors.

While c is constant every line is linear with constant coefficients: of a quantity and its derivative,
(2, n, m), it makes the result and its derivative. Moving weights need the lines that end in `_dot` as well.

`E`, `sigma`, `sigma_dot` are what the coupling hands to a robot: S^T times the integrals of epsilon, epsilon
itself, and its derivative. For a pair or ring these are the sums over the robot's synchronization errors.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray
Matrices = Any
"""(..., m, m), or with a known structure, see structure.py."""


def times(A: Matrices, x: Array) -> Any:
    """A x, row by row."""
    return np.matvec(A, x) if isinstance(A, np.ndarray) else A.times(x)


def transposed_times(A: Matrices, x: Array) -> Any:
    """A^T x, row by row."""
    return np.matvec(A.mT, x) if isinstance(A, np.ndarray) else A.transposed_times(x)


def weighted_error(c: Matrices, e: Array) -> Array:
    """w_i = c_i e_i, the error in the unit of the synchronization function."""
    return times(c, e)


def weighted_error_dot(c: Matrices, c_dot: Matrices, e: Array, e_dot: Array) -> Array:
    """w_i' = c_i e_i' + c_i' e_i."""
    return times(c, e_dot) + times(c_dot, e)


def coupled_error(w: Array, E: Array, beta: Array) -> Array:
    """e*_i = c_i e_i + beta sum_k S[k,i] int epsilon_k, eqs. (10) and (29)."""
    return w + beta * E


def command(
    c: Matrices,
    c_dot: Matrices,
    xd_dot: Array,
    e: Array,
    sigma: Array,
    e_star: Array,
    beta: Array,
    Lambda: Array,
) -> Array:
    """u_i = c_i xd_i' + c_i' e_i + beta sum_k S[k,i] epsilon_k + Lambda e*_i, eqs. (11) and (30)."""
    return times(c, xd_dot) + times(c_dot, e) + beta * sigma + Lambda * e_star


def command_dot(
    c: Matrices,
    c_dot: Matrices,
    c_ddot: Matrices,
    xd_dot: Array,
    xd_ddot: Array,
    e: Array,
    e_dot: Array,
    w_dot: Array,
    sigma: Array,
    sigma_dot: Array,
    beta: Array,
    Lambda: Array,
) -> Array:
    """u_i', the derivative of `command`."""
    return (
        times(c, xd_ddot)
        + times(c_dot, xd_dot + e_dot)
        + times(c_ddot, e)
        + beta * sigma_dot
        + Lambda * (w_dot + beta * sigma)
    )


def coupled_velocity_error(u: Array, c: Matrices, x_dot: Array) -> Array:
    """r_i = u_i - c_i x_i' = (e*_i)' + Lambda e*_i, eqs. (12) and (31)."""
    return u - times(c, x_dot)


def reference_velocity(c_inv: Matrices, u: Array) -> Array:
    """xref_i' = c_i^-1 u_i."""
    return times(c_inv, u)


def reference_acceleration_exact(
    c_inv: Matrices, c_dot: Matrices, u_dot: Array, xref_dot: Array, x_dot: Array
) -> Array:
    """xref_i'' = c_i^-1 (u_i' - c_i' xref_i'), the derivative of xref_i'."""
    return times(c_inv, u_dot - times(c_dot, xref_dot))


def reference_acceleration_paper(
    c_inv: Matrices, c_dot: Matrices, u_dot: Array, xref_dot: Array, x_dot: Array
) -> Array:
    """c_i^-1 (u_i' - c_i' x_i'), as (13) prints it; the proof then needs condition (18)."""
    return times(c_inv, u_dot - times(c_dot, x_dot))


def synchronizing_force(c: Matrices, sigma: Array, K_eps: Array) -> Array:
    """c_i^T k_eps sum_k S[k,i] epsilon_k, the last term of (13) and (32), in task space."""
    return transposed_times(c, K_eps * sigma)


def torque(Y: Matrices, theta_hat: Array, damping: Array, coupling_torque: Array) -> Array:
    """tau_i = Y_i theta_hat_i + (K_r term) + (synchronizing force as torque), eqs. (13) and (32)."""
    return times(Y, theta_hat) + damping + coupling_torque


def gradient(Y: Matrices, s_q: Array) -> Array:
    """Y_i^T s_q, the part of (14) that every adaptation learns from."""
    return transposed_times(Y, s_q)


def adaptation(gradient: Array, Gamma: Array) -> Array:
    """theta_hat_i' = Gamma Y_i^T s_q, eq. (14), of the gradient Y_i^T s_q."""
    return Gamma * gradient
