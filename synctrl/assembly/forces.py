"""Internal forces: what hands do to an object beyond carrying it.

With G = [G_1 .. G_k] any G^+ with G G^+ = 1 splits wrenches h of the hands into a load G^+ G h that moves the
object and internal ones (1 - G^+ G) h that squeeze it; which is a convention. Of Erhart and Hirche (2015) is
the one that lets free virtual bodies of mass m_i and radius of gyration k at the hands move as one:

    G^+ = W G^T (G W G^T)^-1,   W = diag(m_i 1, m_i k^2 1)

It depends neither on the origin nor on units. The virtual stick of Uchiyama and Dauchez, G^+_i = G_i^-1 / n,
calls the moments of a beam that two pure forces hold internal ones.
"""

from __future__ import annotations

import numpy as np

from .grasp import grasp_matrix

#: radius of gyration of the virtual bodies, m
GYRATION = 0.1


def internal_wrenches(h: np.ndarray, arms: np.ndarray, gyration: float = GYRATION) -> np.ndarray:
    """Internal wrenches at the hands, (..., k, 6), by the split of Erhart and Hirche with equal masses.

    Args:
        h: wrenches of the hands on the object, (..., k, 6), N and N·m, in world axes, each at its hand.
        arms: from the object's origin to the hands, (..., k, 3), m, in world axes.
        gyration: radius of the virtual bodies, m, above 0.

    Returns:
        N and N·m, of the shape of h: in world axes, each at its hand.
    """
    G = grasp_matrix(arms)
    weight = np.array([1.0] * 3 + [gyration**2] * 3)
    GW = G * weight
    load = np.linalg.solve((GW @ G.mT).sum(axis=-3), np.matvec(G, h).sum(axis=-2)[..., None])[..., 0]
    return h - weight * np.vecmat(load[..., None, :], G)


def stick_wrenches(h: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """Internal wrenches, (..., k, 6), by the virtual stick; arguments as in `internal_wrenches`."""
    G = grasp_matrix(arms)
    share = np.matvec(G, h).sum(axis=-2) / arms.shape[-2]
    return h - np.linalg.solve(G, np.broadcast_to(share[..., None, :], h.shape)[..., None])[..., 0]
