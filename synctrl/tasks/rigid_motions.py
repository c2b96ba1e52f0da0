"""Places that move together: which displacements of them are rigid motions, and which are deformations.

With G_i = [1; [r_i]] of places r_i, in a plane [1; (-y_i, x_i)], and G = [G_1 .. G_n], a rigid motion
displaces the places by G^T times its twist, and forces f at the places are a load G f. What is left of
displacements when rigid motions are taken out, and of forces when loads are, is N times them:

    N  = 1 - G^T (G G^T)^-1 G,   N = N^T = N^2,   G N = 0
    N' = -(A + A^T),             A = N G'^T (G G^T)^-1 G

Neither depends on the origin.
"""

from __future__ import annotations

import numpy as np

from .rotations import skew


def place_matrix(r: np.ndarray) -> np.ndarray:
    """G, (..., 3, 2 n) or (..., 6, 3 n), of places in a plane, (..., n, 2), or in space, (..., n, 3)."""
    d = r.shape[-1]
    turning = skew(r) if d == 3 else np.stack((-r[..., 1], r[..., 0]), axis=-1)[..., None, :]
    moving = np.broadcast_to(np.eye(d), (*r.shape[:-1], d, d))
    G = np.concatenate((moving, turning), axis=-2)
    return np.concatenate(np.moveaxis(G, -3, 0), axis=-1)


def deformation(r: np.ndarray) -> np.ndarray:
    """N of places r, (..., n, d), as a matrix of all their coordinates, (..., n d, n d).

    The places do not all lie in one point of a plane, or on one line in space.
    """
    G = place_matrix(_centred(r))
    return np.eye(G.shape[-1]) - G.mT @ np.linalg.solve(G @ G.mT, G)


def deformation_rate(r: np.ndarray, r_dot: np.ndarray) -> np.ndarray:
    """N' of places r that move with r', (..., n, d) each."""
    r, r_dot = _centred(r), _centred(r_dot)
    G, G_dot = place_matrix(r), place_matrix(r_dot)
    G_dot[..., : r.shape[-1], :] = 0.0  # of the part that does not change
    A = deformation(r) @ G_dot.mT @ np.linalg.solve(G @ G.mT, G)
    return -(A + A.mT)


def _centred(r: np.ndarray) -> np.ndarray:
    """Seen from their middle, from which G is best conditioned."""
    return r - r.mean(axis=-2, keepdims=True)
