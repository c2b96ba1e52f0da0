"""The rotation group: exponential, logarithm, and the Jacobians of the logarithm with their time derivatives.

All functions work on stacks: rotation vectors are (..., 3), in rad, rotation matrices (..., 3, 3).
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..errors import InputError

#: absolute values of the Bernoulli numbers B_2, B_4, ...; b(a) = sum_k |B_2k| a^(2k-2) / (2k)!
_BERNOULLI = (1/6, 1/30, 1/42, 1/30, 5/66, 691/2730, 7/6, 3617/510, 43867/798, 174611/330)  # fmt: skip
_POWERS = np.arange(len(_BERNOULLI))
_B = np.array([B / factorial(2 * k) for k, B in enumerate(_BERNOULLI, start=1)])
#: series of b and of b'/a in powers of a^2, one column each
_SERIES = np.stack((_B, np.append(2 * _POWERS[1:] * _B[1:], 0.0)), axis=1)
#: below this angle the closed forms lose digits and the series have them all, rad
_SMALL = 1.0
_EYE = np.eye(3)


def _quaternion_products(R: np.ndarray) -> list[list[float]]:
    """4 q q^T - 1 for the unit quaternion q = (x, y, z, w) of a rotation: linear in R."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R
    return [
        [xx - yy - zz, xy + yx, xz + zx, zy - yz],
        [xy + yx, yy - xx - zz, yz + zy, xz - zx],
        [xz + zx, yz + zy, zz - xx - yy, yx - xy],
        [zy - yz, xz - zx, yx - xy, xx + yy + zz],
    ]


# Both as matrices that act on flattened arrays: one product instead of an assignment per entry.
_SKEW = np.array([[[0, -z, y], [z, 0, -x], [-y, x, 0]] for x, y, z in np.eye(3)]).reshape(3, 9)
_QUATERNION = np.array([_quaternion_products(E) for E in np.eye(9).reshape(9, 3, 3)]).reshape(9, 16)


def skew(w: np.ndarray) -> np.ndarray:
    """The matrix [w] with [w] a = w x a, (..., 3, 3)."""
    return (w @ _SKEW).reshape(*w.shape, 3)


def exp(phi: np.ndarray) -> np.ndarray:
    """Rotation by |phi| about phi: I + sin(a)/a [phi] + (1 - cos(a))/a^2 [phi]^2 with a = |phi|."""
    half = 0.5 * np.sqrt((phi * phi).sum(-1))[..., None, None]
    K = skew(phi)
    s = np.sinc(half / np.pi)
    return _EYE + (s * np.cos(half)) * K + (0.5 * s * s) * (K @ K)


def log(R: np.ndarray) -> np.ndarray:
    """Rotation vector phi of length up to pi with exp(phi) = R.

    By way of the unit quaternion, which is accurate for every angle; at exactly pi one of the two signs.
    """
    q = quaternion(R)
    v, w = q[..., :3], q[..., 3]
    length = np.sqrt((v * v).sum(-1))
    small = length < 1e-12
    factor = np.where(small, 2.0, 2 * np.arctan2(length, w) / np.where(small, 1.0, length))
    return factor[..., None] * v


def quaternion(R: np.ndarray) -> np.ndarray:
    """Unit quaternion x, y, z, w with w >= 0, (..., 4).

    Each row of q q^T is a multiple of the quaternion; the one with the largest diagonal entry has the
    smallest rounding error.
    """
    rows = (R.reshape(-1, 9) @ _QUATERNION).reshape(-1, 4, 4) + np.eye(4)
    best = rows[:, range(4), range(4)].argmax(axis=1)
    q = rows[np.arange(len(rows)), best]
    q = q / np.sqrt((q * q).sum(-1))[:, None]
    return np.where(q[:, 3:] < 0, -q, q).reshape(*R.shape[:-2], 4)


def left_jacobian_inverse(phi: np.ndarray) -> np.ndarray:
    """Jl^-1(phi) = I - [phi]/2 + b [phi]^2 with b = 1/a^2 - cot(a/2)/(2a), a = |phi| < 2 pi.

    If E = exp(phi) and E' = [w] E then phi' = Jl^-1(phi) w. That of the right Jacobian is its transpose.
    """
    K = skew(phi)
    b = _coefficients((phi * phi).sum(-1))[..., :1, None]
    return _EYE - 0.5 * K + b * (K @ K)


def left_jacobian_inverse_dot(phi: np.ndarray, phi_dot: np.ndarray) -> np.ndarray:
    """Time derivative of `left_jacobian_inverse` while phi moves with phi_dot.

    -[phi']/2 + (b'/a)(phi . phi') [phi]^2 + b ([phi][phi'] + [phi'][phi])
    """
    K, K_dot = skew(phi), skew(phi_dot)
    b, slope = np.moveaxis(_coefficients((phi * phi).sum(-1)), -1, 0)[..., None, None]
    growth = slope * (phi * phi_dot).sum(-1)[..., None, None]
    product = K @ K_dot
    return -0.5 * K_dot + growth * (K @ K) + b * (product + np.swapaxes(product, -1, -2))


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


def _coefficients(square: np.ndarray) -> np.ndarray:
    """b of `left_jacobian_inverse` and (db/da)/a as functions of a^2, (..., 2)."""
    series = np.minimum(square, _SMALL**2)[..., None] ** _POWERS @ _SERIES
    large = square > _SMALL**2
    if not large.any():
        return series
    return np.where(large[..., None], _closed_form(np.maximum(square, _SMALL**2)), series)


def _closed_form(square: np.ndarray) -> np.ndarray:
    """`_coefficients` of large angles."""
    a = np.sqrt(square)
    sine = np.sin(0.5 * a)
    cotangent = 0.5 / (a * np.tan(0.5 * a))
    slope = (cotangent + 0.25 / (sine * sine) - 2 / square) / square
    return np.stack((1 / square - cotangent, slope), axis=-1)
