"""The rotation group: exponential, logarithm, and the Jacobians of the logarithm with their time derivatives.

All functions work on stacks: rotation vectors are (..., 3), in rad, rotation matrices (..., 3, 3). None asks
what its numbers are or goes one of two ways, so the same lines are traced with symbols.
"""

from __future__ import annotations

import math

import numpy as np

from ..renamed import names_elsewhere

_EYE = np.eye(3)
#: nothing beside the square of any angle but zero, by which one must not divide
_TINY = 1e-300

# b(a) = 1/a^2 - cot(a/2)/(2a) is sum_k |B_2k| a^(2k-2) / (2k)! with the Bernoulli numbers B_2, B_4, ..., and
# it is sum_j 2 / ((2 pi j)^2 - a^2). With its first three poles taken out, ten terms of the series have all
# digits for every angle below 2 pi; the closed form loses them at small angles, the whole series at large.
_BERNOULLI = (1/6, 1/30, 1/42, 1/30, 5/66, 691/2730, 7/6, 3617/510, 43867/798, 174611/330)  # fmt: skip
_POLES = (2 * np.pi * np.arange(1, 4)) ** 2
_POWERS = np.arange(len(_BERNOULLI))
_SERIES = np.array([B / math.factorial(2 * k) for k, B in enumerate(_BERNOULLI, start=1)]) - 2 * sum(
    1 / pole ** (_POWERS + 1.0) for pole in _POLES
)
#: of the derivative with respect to a^2
_SLOPE_SERIES = np.append(_POWERS[1:] * _SERIES[1:], 0.0)


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
    half = 0.5 * np.sqrt(_dot(phi, phi) + _TINY)[..., None]
    K, s = skew(phi), np.sin(half) / half
    return _EYE + (s * np.cos(half)) * K + (0.5 * s * s) * (K @ K)


def log(R: np.ndarray) -> np.ndarray:
    """Rotation vector phi of length up to pi with exp(phi) = R.

    By way of the unit quaternion, which is accurate for every angle; at exactly pi one of the two signs.
    """
    q = quaternion(R)
    v, w = q[..., :3], q[..., 3:]
    length = np.sqrt(_dot(v, v) + _TINY)
    return 4 * np.arctan(length / (1 + w)) / length * v


def quaternion(R: np.ndarray) -> np.ndarray:
    """Unit quaternion x, y, z, w with w >= 0, (..., 4).

    Each row of q q^T is a multiple of the quaternion; the one with the largest diagonal entry has the
    smallest rounding error. It is found in two rounds, by pairs.
    """
    rows = (R.reshape(*R.shape[:-2], 9) @ _QUATERNION).reshape(*R.shape[:-2], 4, 4) + np.eye(4)
    sizes = rows[..., range(4), range(4)]
    for half in (2, 1):
        smaller = _less(sizes[..., :half], sizes[..., half:])
        rows = _where(smaller[..., None], rows[..., half:, :], rows[..., :half, :])
        sizes = _where(smaller, sizes[..., half:], sizes[..., :half])
    q = rows[..., 0, :] / np.sqrt(_dot(rows[..., 0, :], rows[..., 0, :]))
    return (1 - 2 * _less(q[..., 3:], 0.0)) * q


def from_quaternion(q: np.ndarray) -> np.ndarray:
    """Rotation matrix, (..., 3, 3), of a unit quaternion x, y, z, w, (..., 4)."""
    K, w = skew(q[..., :3]), q[..., 3:, None]
    return _EYE + 2 * w * K + 2 * K @ K


def left_jacobian_inverse(phi: np.ndarray) -> np.ndarray:
    """Jl^-1(phi) = I - [phi]/2 + b [phi]^2 with b = 1/a^2 - cot(a/2)/(2a), a = |phi| < 2 pi.

    If E = exp(phi) and E' = [w] E then phi' = Jl^-1(phi) w. That of the right Jacobian is its transpose.
    """
    K = skew(phi)
    b = _coefficients(phi)[0]
    return _EYE - 0.5 * K + b * (K @ K)


def left_jacobian_inverse_dot(phi: np.ndarray, phi_dot: np.ndarray) -> np.ndarray:
    """Time derivative of `left_jacobian_inverse` while phi moves with phi_dot.

    -[phi']/2 + (b'/a)(phi . phi') [phi]^2 + b ([phi][phi'] + [phi'][phi])
    """
    K, K_dot = skew(phi), skew(phi_dot)
    b, slope = _coefficients(phi)
    growth = slope * _dot(phi, phi_dot)[..., None]
    product = K @ K_dot
    return -0.5 * K_dot + growth * (K @ K) + b * (product + product.mT)


def _coefficients(phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """b of `left_jacobian_inverse` and (db/da)/a, each (..., 1, 1)."""
    square = _dot(phi, phi)
    poles, powers = 1 / (_POLES - square), square**_POWERS
    b = 2 * poles.sum(-1, keepdims=True) + (powers * _SERIES).sum(-1, keepdims=True)
    slope = 4 * (poles * poles).sum(-1, keepdims=True) + 2 * (powers * _SLOPE_SERIES).sum(-1, keepdims=True)
    return b[..., None], slope[..., None]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a . b, (..., 1)."""
    return (a * b).sum(-1, keepdims=True)


def _less(a: np.ndarray, b: np.ndarray | float) -> np.ndarray:
    """1 where a < b, else 0, for symbols too."""
    return np.less(a, b, dtype=object if a.dtype == object else bool)


def _where(condition: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """`one` where a condition is 1, `other` where it is 0, for symbols too; of finite numbers."""
    return condition * one + (1 - condition) * other


__getattr__ = names_elsewhere(__name__, "..checks", "rotation_matrix")
