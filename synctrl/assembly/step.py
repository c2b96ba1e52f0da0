"""How long a step may be with fixtures: stiff ones on light hands make the explicit method unstable.

The limit is that of the linear system at the start, with arms, object, fixtures and the controller's damping:

    z' = [[0, 1], [-M^-1 J_c^T K J_c, -M^-1 (J_c^T D J_c + K_r)]] z

The classical Runge-Kutta method is stable while |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for z = lambda dt.
"""

from __future__ import annotations

import numpy as np

#: 1/s: slower eigenvalues are not those of fixtures
SLOW = 1e-3
#: between which steps the limit is looked for, s, and how many times the interval is halved
BETWEEN, HALVINGS = (1e-7, 1.0), 60
#: how far above 1 rounding may take the growth of a step
ROUNDING = 1e-12


def largest_step(M: np.ndarray, K: np.ndarray, D: np.ndarray) -> float:
    """The longest stable step of M x'' + D x' + K x = 0, s; 1 s if none up to that is unstable.

    Args:
        M, K, D: mass, stiffness and damping of all coordinates together, (N, N).
    """
    size = len(M)
    system = np.zeros((2 * size, 2 * size))
    system[:size, size:] = np.eye(size)
    system[size:] = -np.linalg.solve(M, np.hstack((K, D)))
    eigenvalues = np.linalg.eigvals(system)
    eigenvalues = eigenvalues[np.abs(eigenvalues) > SLOW]
    low, high = BETWEEN
    if _stable(high * eigenvalues):
        return high
    for _ in range(HALVINGS):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if _stable(middle * eigenvalues) else (low, middle)
    return float(low)


def _stable(z: np.ndarray) -> bool:
    """Whether the method lets none of these grow."""
    growth = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4))))
    return bool((growth <= 1 + ROUNDING).all())
