"""Full pose with symbols: what tasks/pose.py and tasks/rotations.py do with numbers."""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

#: absolute values of the Bernoulli numbers B_2, B_4, ...; b(a) = sum_k |B_2k| a^(2k-2) / (2k)!
_BERNOULLI = (1/6, 1/30, 1/42, 1/30, 5/66, 691/2730, 7/6, 3617/510, 43867/798, 174611/330)  # fmt: skip
B_SERIES = tuple(B / factorial(2 * k) for k, B in enumerate(_BERNOULLI, start=1))
B_SLOPE_SERIES = tuple(2 * k * coefficient for k, coefficient in enumerate(B_SERIES))[1:]
#: below this angle the closed forms lose digits and the series have them all, rad
SMALL_ANGLE = 1.0


def pose_task(ca: Any, v: Any, x: Any, R: Any, J: Any, J_dot: Any, desired: Any) -> tuple:
    """x, e, x', xd', xd'', J and J' of a pose, as arrays of symbols, see `BoundPoseSpace.measure`.

    Args:
        ca: the CasADi module.
        v: joint velocities.
        x, R, J, J_dot: position, rotation, Jacobian and its derivative of the tip, in world axes.
        desired: desired pose, velocity and acceleration one after another, (18, 1).
    """
    xd, xd_dot, xd_ddot = desired[:6], desired[6:12], desired[12:]
    e_o = log(ca, ca.mtimes(exp(ca, xd[3:]), R.T))
    left = left_jacobian_inverse(ca, e_o)
    J_task = ca.vertcat(J[:3, :], ca.mtimes(left.T, J[3:, :]))
    x_dot = ca.mtimes(J_task, v)
    turning = ca.mtimes(left, xd_dot[3:])
    left_dot = left_jacobian_inverse_dot(ca, e_o, turning - x_dot[3:])
    turning_dot = ca.mtimes(left_dot, xd_dot[3:]) + ca.mtimes(left, xd_ddot[3:])
    J_o_dot = ca.mtimes(left_dot.T, J[3:, :]) + ca.mtimes(left.T, J_dot[3:, :])
    parts = (
        ca.vertcat(x, log(ca, R)),
        ca.vertcat(xd[:3] - x, e_o),
        x_dot,
        ca.vertcat(xd_dot[:3], turning),
        ca.vertcat(xd_ddot[:3], turning_dot),
        J_task,
        ca.vertcat(J_dot[:3, :], J_o_dot),
    )
    return tuple(_array(part) for part in parts)


def exp(ca: Any, phi: Any) -> Any:
    """Rotation by |phi| about phi."""
    square = ca.sumsqr(phi)
    angle = ca.sqrt(ca.fmax(square, 1e-12))
    first = ca.if_else(square < 1e-12, 1 - square / 6, ca.sin(angle) / angle)
    half = ca.if_else(square < 1e-12, 1 - square / 24, ca.sin(angle / 2) / (angle / 2))
    K = ca.skew(phi)
    return ca.SX.eye(3) + first * K + 0.5 * half * half * ca.mtimes(K, K)


def log(ca: Any, R: Any) -> Any:
    """Rotation vector of R, by way of its unit quaternion."""
    q = _quaternion(ca, R)
    square = ca.sumsqr(q[1:])
    length = ca.sqrt(ca.fmax(square, 1e-300))
    return ca.if_else(square < 1e-24, 2.0, 2 * ca.atan2(length, q[0]) / length) * q[1:]


def left_jacobian_inverse(ca: Any, phi: Any) -> Any:
    """Jl^-1(phi) = I - [phi]/2 + b [phi]^2."""
    K = ca.skew(phi)
    return ca.SX.eye(3) - 0.5 * K + _b(ca, ca.sumsqr(phi)) * ca.mtimes(K, K)


def left_jacobian_inverse_dot(ca: Any, phi: Any, phi_dot: Any) -> Any:
    """Time derivative of `left_jacobian_inverse`."""
    K, K_dot = ca.skew(phi), ca.skew(phi_dot)
    square = ca.sumsqr(phi)
    growth = _b_slope(ca, square) * ca.dot(phi, phi_dot)
    product = ca.mtimes(K, K_dot)
    return -0.5 * K_dot + growth * ca.mtimes(K, K) + _b(ca, square) * (product + product.T)


def _b(ca: Any, square: Any) -> Any:
    large = ca.fmax(square, SMALL_ANGLE**2)
    a = ca.sqrt(large)
    closed = 1 / large - 0.5 / (a * ca.tan(0.5 * a))
    return ca.if_else(square < SMALL_ANGLE**2, _polynomial(B_SERIES, square), closed)


def _b_slope(ca: Any, square: Any) -> Any:
    large = ca.fmax(square, SMALL_ANGLE**2)
    a = ca.sqrt(large)
    sine = ca.sin(0.5 * a)
    closed = (0.5 / (a * ca.tan(0.5 * a)) + 0.25 / (sine * sine) - 2 / large) / large
    return ca.if_else(square < SMALL_ANGLE**2, _polynomial(B_SLOPE_SERIES, square), closed)


def _polynomial(coefficients: tuple[float, ...], x: Any) -> Any:
    value = 0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def _quaternion(ca: Any, R: Any) -> Any:
    """Unit quaternion w, x, y, z with w >= 0; of four multiples of it the one with the largest own entry."""
    xx, yy, zz = R[0, 0], R[1, 1], R[2, 2]
    wx, wy, wz = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    xy, xz, yz = R[1, 0] + R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2]
    columns = [
        ca.vertcat(1 + xx + yy + zz, wx, wy, wz),
        ca.vertcat(wx, 1 + xx - yy - zz, xy, xz),
        ca.vertcat(wy, xy, 1 - xx + yy - zz, yz),
        ca.vertcat(wz, xz, yz, 1 - xx - yy + zz),
    ]
    best, size = columns[0], columns[0][0]
    for k in range(1, 4):
        better = columns[k][k] > size
        best, size = ca.if_else(better, columns[k], best), ca.if_else(better, columns[k][k], size)
    best = best / ca.norm_2(best)
    return ca.if_else(best[0] < 0, -best, best)


def _array(symbols: Any) -> np.ndarray:
    rows, columns = symbols.shape
    array = np.empty((rows, columns), dtype=object)
    for i in range(rows):
        for j in range(columns):
            array[i, j] = symbols[i, j]
    return array[:, 0] if columns == 1 else array
