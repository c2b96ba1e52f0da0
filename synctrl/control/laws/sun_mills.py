"""The paper's law: coupled errors, and a force on synchronization errors, eqs. (7)-(13) and (28)-(32)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...checks import choice
from ...coupling.cell import Cell
from ..gains import Gains, spread
from .protocol import Along, Asked, Errors, Proof

#: what xref'' may be: the derivative of xref', or what (13) prints
REFERENCE_ACCELERATIONS = "exact", "paper"
#: where the damping K_r may act
K_R_SPACES = "joint", "task"


class SunMills:
    """The law of the paper, with the gains Lambda, beta and K_eps, eqs. (7)-(13) and (28)-(32).

    Args:
        reference_acceleration: "exact", the derivative of xref', or "paper", as (13) prints it.
        k_r_space: "joint" for damping K_r s_q, or "task" for J^T K_r c^-1 r.

    Raises:
        InputError: an unknown word.
    """

    def __init__(self, reference_acceleration: str = "exact", k_r_space: str = "joint"):
        self.reference_acceleration = choice(
            "reference_acceleration", reference_acceleration, REFERENCE_ACCELERATIONS
        )
        self.k_r_space = choice("k_r_space", k_r_space, K_R_SPACES)

    def bind(self, cell: Cell, gains: Gains) -> BoundSunMills:
        """This law for a cell.

        Raises:
            InputError: gains of another size.
        """
        Lambda, beta, K_eps = (
            spread(name, getattr(gains, name), (cell.m,)) for name in ("Lambda", "beta", "K_eps")
        )
        return BoundSunMills(Lambda, beta, K_eps, self.reference_acceleration)

    def as_dict(self) -> dict[str, Any]:
        return {
            "name": "SunMills",
            "reference_acceleration": self.reference_acceleration,
            "k_r_space": self.k_r_space,
        }


class BoundSunMills:
    """`SunMills` with gains, (m,)."""

    def __init__(self, Lambda: np.ndarray, beta: np.ndarray, K_eps: np.ndarray, reference_acceleration: str):
        self.Lambda, self.beta, self.K_eps = Lambda, beta, K_eps
        self.reference_acceleration = reference_acceleration

    def command(self, errors: Errors) -> Asked:
        x, Lambda, beta = errors, self.Lambda, self.beta
        c, c_dot, c_ddot, c_inv = x.weights
        e, shares = x.error[0], beta * x.shares
        e_star = x.weighted + shares[:2]  # (10), (29), and the derivative
        u = np.matvec(c, x.rates) + shares[1:] + Lambda * e_star  # (11), (30), and the derivative
        u += np.matvec(c_dot, np.array((e, x.rates[0] + x.error[1])))
        u[1] += np.matvec(c_ddot, e)
        xref_dot = np.matvec(c_inv, u[0])
        turned = xref_dot if self.reference_acceleration == "exact" else x.x_dot  # (13) prints x'
        xref_ddot = np.matvec(c_inv, u[1] - np.matvec(c_dot, turned))
        force = np.matvec(c.mT, self.K_eps * x.shares[1])  # the last term of (13) and (32)
        return Asked(xref_dot, xref_ddot, force, e_star[0], u)

    def proof(self, along: Along) -> Proof:
        """Springs on epsilon and E, and what they lose, (19), (24), (34) and (39)."""
        K_eps, beta, Lambda = self.K_eps, self.beta, self.Lambda
        epsilon, E, sigma = along.epsilon, along.E, along.sigma
        return Proof(
            {
                "synchronization": 0.5 * epsilon * K_eps * epsilon,
                "integral": 0.5 * E * K_eps * Lambda * beta * E,
            },
            {
                "synchronization": epsilon * K_eps * along.epsilon_dot,
                "integral": E * K_eps * Lambda * beta * sigma,
            },
            {
                "synchronization rate": -epsilon * K_eps * Lambda * epsilon,
                "coupling": -sigma * K_eps * beta * sigma,
            },
        )
