"""From errors to reference motion in task space: the lines of the law in order, and the coupling in between.

Everything is a pair, a quantity and its derivative. Constant weights have a way of their own, because every
line then serves quantity and derivative at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from ..tasks.cell import Cell, Reference
from ..tasks.coupling import Coupling
from ..tasks.spaces import Measurement
from . import law
from .structure import ABSENT, structured

REFERENCE_ACCELERATIONS = {
    "exact": law.reference_acceleration_exact,
    "paper": law.reference_acceleration_paper,
}


class Command(Protocol):
    """What the law wants in task space."""

    @property
    def epsilon(self) -> np.ndarray:
        """epsilon, (p, m)."""

    @property
    def epsilon_dot(self) -> np.ndarray:
        """epsilon', (p, m)."""

    @property
    def shares(self) -> np.ndarray:
        """E, sigma, sigma', (3, n, m)."""

    @property
    def e_star(self) -> np.ndarray:
        """e*, (n, m)."""

    @property
    def u(self) -> np.ndarray:
        """u, u', (2, n, m)."""

    @property
    def xref(self) -> tuple[np.ndarray, np.ndarray]:
        """xref' and xref'', each (n, m)."""

    @property
    def force(self) -> np.ndarray:
        """The synchronizing force, (n, m)."""


class Lines(NamedTuple):
    """A `Command`, as the lines of the law make it."""

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    shares: np.ndarray
    e_star: np.ndarray
    u: np.ndarray
    xref: tuple[np.ndarray, np.ndarray]
    force: np.ndarray


Law = Callable[[Measurement, Reference, np.ndarray], Command]
"""Measurement, what is desired, and the integrals of the synchronization errors, (p, m) -> `Command`."""


class ConstantWeights:
    """The law for weights that do not change.

    Args:
        cell: the cell, with constant weights.
        Lambda, beta, K_eps: gains, (m,).
    """

    def __init__(self, cell: Cell, Lambda: np.ndarray, beta: np.ndarray, K_eps: np.ndarray):
        rows = (2, cell.n, cell.m)
        weights = cell.coupling.weights(np.zeros(1), cell.m)
        c, c_inv = weights.c[0], weights.c_inv[0]
        self._c, self._c_inv, self._c_single = (
            structured(c, rows), structured(c_inv, rows), structured(c, rows[1:]),
        )  # fmt: skip
        self._Lambda, self._beta = (np.broadcast_to(gain, rows).copy() for gain in (Lambda, beta))
        self._K_eps, self._coupling = np.broadcast_to(K_eps, rows[1:]).copy(), cell.coupling

    def __call__(self, task: Measurement, reference: Reference, integral: np.ndarray) -> Lines:
        return self.of(task.error, task.rates, integral)

    def of(self, error: np.ndarray, rates: np.ndarray, integral: np.ndarray) -> Lines:
        """The law for e and e', xd' and xd'', (2, n, m), and the integrals of epsilon, (p, m)."""
        c, Lambda, beta = self._c, self._Lambda, self._beta
        w = law.weighted_error(c, error)
        compared, shares = couple(self._coupling, w, integral)
        sigma = shares[1:]
        e_star = law.coupled_error(w, shares[:2], beta)
        u = law.command(c, ABSENT, rates, error, sigma, e_star, beta, Lambda)
        xref = law.reference_velocity(self._c_inv, u)
        force = law.synchronizing_force(self._c_single, sigma[0], self._K_eps)
        return Lines(compared[0], compared[1], shares, e_star[0], u, (xref[0], xref[1]), force)


class MovingWeights:
    """The law for weights that change with time.

    Args:
        cell: the cell.
        Lambda, beta, K_eps: gains, (m,).
        reference_acceleration: "exact" or "paper".
    """

    def __init__(
        self,
        cell: Cell,
        Lambda: np.ndarray,
        beta: np.ndarray,
        K_eps: np.ndarray,
        reference_acceleration: str,
    ):
        self._Lambda, self._beta, self._K_eps, self._coupling = Lambda, beta, K_eps, cell.coupling
        self._reference_acceleration = REFERENCE_ACCELERATIONS[reference_acceleration]

    def __call__(self, task: Measurement, reference: Reference, integral: np.ndarray) -> Lines:
        Lambda, beta = self._Lambda, self._beta
        c, c_dot, c_ddot, c_inv = reference.weights
        (e, e_dot), (xd_dot, xd_ddot) = task.error, task.rates
        w, w_dot = law.weighted_error(c, e), law.weighted_error_dot(c, c_dot, e, e_dot)
        compared, shares = couple(self._coupling, np.stack((w, w_dot)), integral)
        E, sigma, sigma_dot = shares
        e_star = law.coupled_error(w, E, beta)
        u = law.command(c, c_dot, xd_dot, e, sigma, e_star, beta, Lambda)
        u_dot = law.command_dot(
            c, c_dot, c_ddot, xd_dot, xd_ddot, e, e_dot, w_dot, sigma, sigma_dot, beta, Lambda
        )
        xref_dot = law.reference_velocity(c_inv, u)
        xref_ddot = self._reference_acceleration(c_inv, c_dot, u_dot, xref_dot, task.x_dot)
        force = law.synchronizing_force(c, sigma, self._K_eps)
        u = np.stack((u, u_dot))
        return Lines(compared[0], compared[1], shares, e_star, u, (xref_dot, xref_ddot), force)


def couple(coupling: Coupling, w: np.ndarray, integral: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """epsilon and epsilon', (2, p, m), of w and w'; then E, sigma and sigma', (3, n, m)."""
    compared = coupling.compare(w)
    return compared, coupling.distribute(np.concatenate((integral[None], compared)))
