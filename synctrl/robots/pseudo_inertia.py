"""Pseudo-inertia: the ten inertial parameters of a body as one symmetric matrix.

    P = [[S, h], [h^T, m]],   S = tr(I)/2 1 - I,   h = m c

with I about the origin of the body's frame. P is positive definite exactly if some distribution of mass has
these parameters (Wensing, Kim and Slotine 2018). It is linear in them, so that theta_k = tr(D_k P) and
P = sum_k theta_k E_k. Functions take arrays of numbers or of symbols.
"""

from __future__ import annotations

import numpy as np


def _units() -> np.ndarray:
    """E_k, (10, 4, 4): P of every unit vector, in Pinocchio's order of parameters."""
    E = np.zeros((10, 4, 4))
    E[0, 3, 3] = 1.0
    for axis in range(3):
        E[1 + axis, axis, 3] = E[1 + axis, 3, axis] = 1.0
    for k, (i, j) in zip((4, 5, 6, 7, 8, 9), ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)), strict=True):
        inertia = np.zeros((3, 3))
        inertia[i, j] = inertia[j, i] = 1.0
        E[k, :3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return E


E = _units()
#: D_k = sum_l (G^-1)_kl E_l with G_kl = tr E_k E_l
D = np.tensordot(np.linalg.inv(np.tensordot(E, E, axes=([1, 2], [2, 1]))), E, axes=1)
_E_ROWS, _D_ROWS = E.reshape(10, 16), D.reshape(10, 16)


def pseudo_inertia(theta: np.ndarray) -> np.ndarray:
    """P, (..., 4, 4), of inertial parameters, (..., 10)."""
    return (theta @ _E_ROWS).reshape(*theta.shape[:-1], 4, 4)


def inertial_parameters(P: np.ndarray) -> np.ndarray:
    """Inertial parameters, (..., 10), of P, (..., 4, 4)."""
    return P.reshape(*P.shape[:-2], 16) @ _D_ROWS.T


def dual(gradient: np.ndarray) -> np.ndarray:
    """B = sum_k g_k D_k, (..., 4, 4), of a gradient g, (..., 10), so that g^T theta = tr(B P)."""
    return (gradient @ _D_ROWS).reshape(*gradient.shape[:-1], 4, 4)


def inverse_hessian(P: np.ndarray) -> np.ndarray:
    """tr(D_k P D_l P), (..., 10, 10): inverse of the Hessian of -log det P in inertial parameters."""
    moved = np.einsum("kij,...jm->...kim", D, P)
    return np.einsum("...kim,...lmi->...kl", moved, moved)


#: kg·m^2, that of 1 mg at 1 mm: what is smaller counts as no moment, whatever its sign
NO_MOMENT = 1e-12


def pullback(theta: np.ndarray) -> np.ndarray:
    """How far inertial parameters can well be from theta, squared: tr(D_k P D_k P), (..., 10 bodies).

    It is the diagonal of the inverse Hessian of -log det P, the metric of bodies that can exist: m^2 for the
    mass, (h_x^2 + S_xx m)/2 for m c_x, and so on. Of a body that cannot exist, its size is taken.

    Args:
        theta: inertial parameters, (..., 10 bodies).
    """
    P = pseudo_inertia(theta.reshape(*theta.shape[:-1], -1, 10))
    DP = D @ P[..., None, :, :]
    return np.abs(np.einsum("...kij,...kji->...k", DP, DP)).reshape(theta.shape)


def principal_moments(theta: np.ndarray) -> np.ndarray:
    """Moments of inertia of one body about its centre of mass, (3,), ascending, of its parameters, (10,)."""
    m, h = theta[0], theta[1:4]
    xx, xy, yy, xz, yz, zz = theta[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.linalg.eigvalsh(about_origin - (h @ h * np.eye(3) - np.outer(h, h)) / m)


def smallest_eigenvalues(theta: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of P per body, (..., bodies), of inertial parameters, (..., 10 bodies)."""
    return np.linalg.eigvalsh(pseudo_inertia(theta.reshape(*theta.shape[:-1], -1, 10)))[..., 0]
