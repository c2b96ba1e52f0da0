"""The paper's law: coupled errors, and a force on synchronization errors, eqs. (7)-(13) and (28)-(32).

What comes before this law, (7) and (28), is in `control/network/ideal.py`; what comes after it, the torque
(13) and (32) in joint space, in `control/law.py` and `control/controller.py`; the adaptation (14) is
`control/adaptation/gradient.py`. The theory page in `docs` has the way through all of the paper's equations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import boolean, choice, finite_array
from ...coupling.cell import Cell
from ...coupling.coupling import Coupling
from ...errors import InputError
from ..gains import Gains, spread
from .protocol import DIFFUSION, Along, Asked, Errors, Proof

#: what xref'' may be: the derivative of xref', or what (13) prints
REFERENCE_ACCELERATIONS = "exact", "paper"
#: where the damping K_r may act
K_R_SPACES = "joint", "task"


class SunMills:
    """The law of the paper, with the gains Lambda, beta and K_eps, eqs. (7)-(13) and (28)-(32).

    Args:
        reference_acceleration: "exact", the derivative of xref', or "paper", as (13) prints it.
        k_r_space: "joint" for damping K_r s_q, or "task" for J^T K_r c^-1 r.
        injection: whether the torque has a/(4 Lambda) J^T c^T K_eps r as well, a the largest entry of the
            diagonal of S^T S: as much damping as any constant delay between robots may take.
        diffusion: K_2, a number or (m,), N·m·s if weights have no unit: the torque has
            J^T c^T K_2 sum_j |A_ij| (r_i + sgn(A_ij) r_j) as well, with r_j as the network brings it, and A
            what S^T S has beside its diagonal. It needs a `Network`.

    Raises:
        InputError: an unknown word, no bool, or gains that are not finite or below 0.
    """

    statement = (
        "e and epsilon go to zero, parameters known or not; with xref'' of (13) under the gain condition"
    )

    def __init__(
        self,
        reference_acceleration: str = "exact",
        k_r_space: str = "joint",
        injection: bool = False,
        diffusion: ArrayLike = 0.0,
    ):
        self.reference_acceleration = choice(
            "reference_acceleration", reference_acceleration, REFERENCE_ACCELERATIONS
        )
        self.k_r_space = choice("k_r_space", k_r_space, K_R_SPACES)
        self.injection = boolean("injection", injection)
        self.diffusion = finite_array("diffusion", diffusion)
        if self.diffusion.min(initial=0.0) < 0:
            raise InputError.expected("gains of at least 0", float(self.diffusion.min()), "diffusion")

    def bind(self, cell: Cell, gains: Gains) -> BoundSunMills | BoundInjection | BoundDiffusion:
        """This law for a cell.

        Raises:
            InputError: gains of another size.
        """
        Lambda, beta, K_eps, leak = (
            spread(name, getattr(gains, name), (cell.m,)) for name in ("Lambda", "beta", "K_eps", "leak")
        )
        if (leak > Lambda).any():
            found = float(leak[leak > Lambda][0])
            raise InputError.expected("rates up to Lambda, beyond which nothing is proved", found, "leak")
        law: Any = BoundSunMills(Lambda, beta, K_eps, self.reference_acceleration, leak)
        if self.injection:
            law = BoundInjection(law, delay_damping(cell.coupling, Lambda, K_eps))
        K_2 = spread("diffusion", self.diffusion, (cell.m,))
        return BoundDiffusion(law, K_2) if K_2.any() else law

    def as_dict(self) -> dict[str, Any]:
        return {
            "name": "SunMills",
            "reference_acceleration": self.reference_acceleration,
            "k_r_space": self.k_r_space,
            **({"injection": True} if self.injection else {}),
            **({"diffusion": self.diffusion.tolist()} if self.diffusion.any() else {}),
        }


def delay_damping(coupling: Coupling, Lambda: np.ndarray, K_eps: np.ndarray) -> np.ndarray:
    """a/(4 Lambda) K_eps, a = max (S^T S)_ii: how much of the damping of r delays may take, (m,), K_eps s.

    Args:
        coupling: which robots are compared, S.
        Lambda: (m,), 1/s.
        K_eps: (m,).
    """
    return coupling.degree / (4 * Lambda) * K_eps


class BoundSunMills:
    """`SunMills` with gains, (m,)."""

    statement = SunMills.statement

    def __init__(
        self,
        Lambda: np.ndarray,
        beta: np.ndarray,
        K_eps: np.ndarray,
        reference_acceleration: str,
        leak: np.ndarray | None = None,
    ):
        self.Lambda, self.beta, self.K_eps = Lambda, beta, K_eps
        self.leak = np.zeros_like(Lambda) if leak is None else leak
        self.reference_acceleration = reference_acceleration
        self._leaks = self.leak.dtype == object or bool(self.leak.any())  # symbols may be anything

    def command(self, errors: Errors) -> Asked:
        """e*, u, the reference motion and the force; e* and u have two rows, the quantity and its derivative.

            e* = c e + beta E                      e*' = (c e)' + beta sigma
            u  = c xd' + c' e + beta sigma + Lambda e*
            u' = c xd'' + c' (xd' + e') + c'' e + beta sigma' + Lambda e*'
            xref' = c^-1 u                         xref'' = c^-1 (u' - c' xref')

        With `reference_acceleration="paper"` x' stands for xref' in the last of these.
        """
        Lambda, beta_shares = self.Lambda, self.beta * errors.shares  # beta E, beta sigma, beta sigma'
        c, c_dot, c_ddot, c_inv = errors.weights
        e, e_dot = errors.error
        if self._leaks:  # E' = sigma - l E, and its rate
            beta_shares = self._leaked(beta_shares)
        e_star = errors.weighted + beta_shares[:2]  # (10), (29), and the derivative
        u = np.matvec(c, errors.rates) + beta_shares[1:] + Lambda * e_star  # (11), (30), and the derivative
        if errors.weights.move:
            u += np.matvec(c_dot, np.array((e, errors.rates[0] + e_dot)))
            u[1] += np.matvec(c_ddot, e)
        xref = np.matvec(c_inv, u)
        if errors.weights.move:
            velocity = xref[0] if self.reference_acceleration == "exact" else errors.x_dot  # (13) prints x'
            xref[1] -= np.matvec(c_inv, np.matvec(c_dot, velocity))
        force = np.matvec(c.mT, self.K_eps * errors.shares[1])  # the last term of (13) and (32)
        return Asked(xref[0], xref[1], force, e_star[0], u)

    def _leaked(self, shares: np.ndarray) -> np.ndarray:
        """E, E', E'' of integrals that leak, where shares are E, sigma and sigma'."""
        E, sigma, sigma_dot = shares
        E_dot = sigma - self.leak * E
        return np.stack((E, E_dot, sigma_dot - self.leak * E_dot))

    def proof(self, along: Along) -> Proof:
        """Springs on epsilon and E, and what they lose, (19), (24), (34) and (39).

        With a leak l the spring on E has K_eps (Lambda - l) beta, and loses l E^T K_eps (Lambda - l) beta E.
        """
        K_eps, beta, Lambda, leak = self.K_eps, self.beta, self.Lambda, self.leak
        spring = K_eps * (Lambda - leak) * beta
        lost = {"leak": -along.E * leak * spring * along.E} if self._leaks else {}
        epsilon, E, sigma = along.epsilon, along.E, along.sigma
        return Proof(
            {
                "synchronization": 0.5 * epsilon * K_eps * epsilon,
                "integral": 0.5 * E * spring * E,
            },
            {
                "synchronization": epsilon * K_eps * along.epsilon_dot,
                "integral": E * spring * (sigma - leak * E),
            },
            {
                "synchronization rate": -epsilon * K_eps * Lambda * epsilon,
                "coupling": -sigma * K_eps * beta * sigma,
                **lost,
            },
        )


def coupled_velocity_error(asked: Asked, errors: Errors) -> np.ndarray:
    """r = u - c x', eqs. (12) and (31), (n, m), unit of c e per s, of a law that says what u is."""
    return asked.u[0] - np.matvec(errors.c, errors.x_dot)


class BoundInjection:
    """`BoundSunMills` with damping of r beside its force, J^T c^T B r.

    Args:
        law: the law.
        injection: B, (m,), N·m·s if weights have no unit.
    """

    statement = SunMills.statement

    def __init__(self, law: BoundSunMills, injection: np.ndarray):
        self.law, self.injection = law, injection

    def command(self, errors: Errors) -> Asked:
        asked = self.law.command(errors)
        injected = self.injection * coupled_velocity_error(asked, errors)
        return asked._replace(force=asked.force + np.matvec(errors.c.mT, injected))

    def proof(self, along: Along) -> Proof:
        """That of the law, and what B takes of the kinetic energy."""
        proof = self.law.proof(along)
        return proof._replace(powers={**proof.powers, "injection": -along.r * self.injection * along.r})


class BoundDiffusion:
    """`BoundSunMills` with diffusive coupling, J^T c^T K_2 sum_j |A_ij| (r_i + sgn(A_ij) r_j).

    With r_j of a constant delay d ago, V and 1/2 sum_i sum_j |A_ij| int_{t-d}^t r_j^T K_2 r_j fall by
    1/2 sum_i sum_j |A_ij| x^T K_2 x, x = r_i + sgn(A_ij) r_j(t - d), more than without it. V has no such
    integral.

    Args:
        law: the law, with or without injection.
        diffusion: K_2, (m,), N·m·s if weights have no unit.
    """

    statement = SunMills.statement
    needs_slips = True

    def __init__(self, law: BoundSunMills | BoundInjection, diffusion: np.ndarray):
        self.law, self.diffusion = law, diffusion
        self.injection = getattr(law, "injection", 0.0)

    def command(self, errors: Errors) -> Asked:
        asked, (weight, heard) = self.law.command(errors), errors.slips
        r = coupled_velocity_error(asked, errors)
        pulled = self.diffusion * (weight * r + heard)
        return asked._replace(force=asked.force + np.matvec(errors.c.mT, pulled))

    def proof(self, along: Along) -> Proof:
        """That of the law, and the power of its coupling, which takes and gives."""
        proof, (weight, heard) = self.law.proof(along), along.slips.swapaxes(0, 1)
        power = -along.r * self.diffusion * (weight * along.r + heard)
        return proof._replace(powers={**proof.powers, DIFFUSION: power})
