"""The rotation group: exponential, logarithm, and the Jacobians of the logarithm with their time derivatives.

All functions work on stacks: rotation vectors are (..., 3), in rad, rotation matrices (..., 3, 3).
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import InputError

#: absolute values of the Bernoulli numbers B_2, B_4, ...; b(phi) = sum_k |B_2k| phi^(2k-2) / (2k)!
_BERNOULLI = (1/6, 1/30, 1/42, 1/30, 5/66, 691/2730, 7/6, 3617/510, 43867/798, 174611/330)  # fmt: skip
B_SERIES = tuple(B / factorial(2 * k) for k, B in enumerate(_BERNOULLI, start=1))
B_SLOPE_SERIES = tuple(2 * k * coefficient for k, coefficient in enumerate(B_SERIES))[1:]
#: below this angle the closed forms lose digits and the series have them all, rad
SMALL_ANGLE = 1.0
_EYE = np.eye(3)


def skew(w: np.ndarray) -> np.ndarray:
    """The matrix [w] with [w] a = w x a, (..., 3, 3)."""
    matrix = np.zeros((*w.shape, 3))
    matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    return matrix - np.swapaxes(matrix, -1, -2)


def exp(phi: np.ndarray) -> np.ndarray:
    """Rotation by |phi| about phi: I + sin(a)/a [phi] + (1 - cos(a))/a^2 [phi]^2 with a = |phi|."""
    angle = np.sqrt((phi * phi).sum(-1))[..., None, None]
    K = skew(phi)
    half = np.sinc(angle / (2 * np.pi))
    return _EYE + np.sinc(angle / np.pi) * K + 0.5 * half * half * (K @ K)


def log(R: np.ndarray) -> np.ndarray:
    """Rotation vector phi of length up to pi with exp(phi) = R.

    By way of the unit quaternion, which is accurate for every angle; at exactly pi one of the two signs.
    """
    q = _quaternion(R)
    w, v = q[..., 0], q[..., 1:]
    length = np.sqrt((v * v).sum(-1))
    small = length < 1e-12
    factor = np.where(small, 2.0, 2 * np.arctan2(length, w) / np.where(small, 1.0, length))
    return factor[..., None] * v


def left_jacobian_inverse(phi: np.ndarray) -> np.ndarray:
    """Jl^-1(phi) = I - [phi]/2 + b [phi]^2 with b = 1/a^2 - cot(a/2)/(2a), a = |phi| < 2 pi.

    If E = exp(phi) and E' = [w] E then phi' = Jl^-1(phi) w. That of the right Jacobian is its transpose.
    """
    K = skew(phi)
    square = (phi * phi).sum(-1)
    return _EYE - 0.5 * K + _b(square)[..., None, None] * (K @ K)


def left_jacobian_inverse_dot(phi: np.ndarray, phi_dot: np.ndarray) -> np.ndarray:
    """Time derivative of `left_jacobian_inverse` while phi moves with phi_dot.

    -[phi']/2 + (b'/a)(phi . phi') [phi]^2 + b ([phi][phi'] + [phi'][phi])
    """
    K, K_dot = skew(phi), skew(phi_dot)
    square = (phi * phi).sum(-1)
    growth = _b_slope(square) * (phi * phi_dot).sum(-1)
    product = K @ K_dot
    mixed = product + np.swapaxes(product, -1, -2)
    return -0.5 * K_dot + growth[..., None, None] * (K @ K) + _b(square)[..., None, None] * mixed


def rotation_from_rpy(rpy: ArrayLike) -> np.ndarray:
    """Rotation about the fixed axes x, y, z in that order, (3, 3), from three angles, rad."""
    x, y, z = finite_array("rpy", rpy, (3,))[:, None] * _EYE
    return exp(z) @ exp(y) @ exp(x)


def rotation_matrix(name: str, value: ArrayLike) -> np.ndarray:
    """`value` if it is a rotation matrix.

    Raises:
        InputError: another shape, not orthonormal to 1e-6, or a reflection.
    """
    R = finite_array(name, value, (3, 3))
    off = float(np.abs(R @ R.T - _EYE).max())
    if off > 1e-6 or np.linalg.det(R) < 0:
        kind = "a reflection" if off <= 1e-6 else f"one whose R R^T differs from 1 by {off:.2g}"
        raise InputError(f"{name}: expected a rotation matrix, found {kind}")
    return R


def _b(square: np.ndarray) -> np.ndarray:
    """b of `left_jacobian_inverse` as a function of a^2."""
    large = np.maximum(square, SMALL_ANGLE**2)
    a = np.sqrt(large)
    closed = 1 / large - 0.5 / (a * np.tan(0.5 * a))
    return np.where(square < SMALL_ANGLE**2, _polynomial(B_SERIES, square), closed)


def _b_slope(square: np.ndarray) -> np.ndarray:
    """(db/da)/a as a function of a^2."""
    large = np.maximum(square, SMALL_ANGLE**2)
    a = np.sqrt(large)
    sine, tangent = np.sin(0.5 * a), np.tan(0.5 * a)
    closed = (0.5 / (a * tangent) + 0.25 / (sine * sine) - 2 / large) / large
    return np.where(square < SMALL_ANGLE**2, _polynomial(B_SLOPE_SERIES, square), closed)


def _polynomial(coefficients: tuple[float, ...], x: np.ndarray) -> np.ndarray:
    value = np.zeros_like(x)
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def _quaternion(R: np.ndarray) -> np.ndarray:
    """Unit quaternion w, x, y, z with w >= 0, (..., 4).

    Each column of the matrix built here is a multiple of the quaternion; the one with the largest diagonal
    entry has the smallest rounding error.
    """
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    Q = np.empty((*R.shape[:-2], 4, 4))
    Q[..., 0, 0] = 1 + xx + yy + zz
    Q[..., 1, 1] = 1 + xx - yy - zz
    Q[..., 2, 2] = 1 - xx + yy - zz
    Q[..., 3, 3] = 1 - xx - yy + zz
    Q[..., 0, 1] = Q[..., 1, 0] = R[..., 2, 1] - R[..., 1, 2]
    Q[..., 0, 2] = Q[..., 2, 0] = R[..., 0, 2] - R[..., 2, 0]
    Q[..., 0, 3] = Q[..., 3, 0] = R[..., 1, 0] - R[..., 0, 1]
    Q[..., 1, 2] = Q[..., 2, 1] = R[..., 1, 0] + R[..., 0, 1]
    Q[..., 1, 3] = Q[..., 3, 1] = R[..., 0, 2] + R[..., 2, 0]
    Q[..., 2, 3] = Q[..., 3, 2] = R[..., 2, 1] + R[..., 1, 2]
    best = np.argmax(np.einsum("...ii->...i", Q), axis=-1)
    q = np.take_along_axis(Q, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.sqrt((q * q).sum(-1))[..., None]
    return np.where(q[..., :1] < 0, -q, q)
