"""The classic laws that know nothing of neighbours: what synchronization is compared with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array
from ...coupling.cell import Cell
from ...errors import InputError
from ..gains import Gains, spread
from .protocol import Along, Asked, Errors, Proof


class SlotineLi:
    """Every robot tracks alone, after Slotine and Li (1987).

        xref' = xd' + Lambda e,  so that  V' = -s_q^T K_r s_q  with (14).

    It is the paper's law with beta = K_eps = 0 and weights of one.

    Raises:
        InputError: when it is bound, gains beta or K_eps that are not zero.
    """

    independent = True
    statement = "e goes to zero, with unknown parameters too: V' = -s_q^T K_r s_q"

    def bind(self, cell: Cell, gains: Gains) -> BoundSlotineLi:
        return BoundSlotineLi(alone(self, gains, cell.m))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "SlotineLi"}


class BoundSlotineLi:
    """`SlotineLi` with its gain, (m,)."""

    statement = SlotineLi.statement

    def __init__(self, Lambda: np.ndarray):
        self.Lambda = Lambda

    def command(self, errors: Errors) -> Asked:
        velocity, acceleration = errors.rates + self.Lambda * errors.error
        return Asked(velocity, acceleration, np.zeros_like(velocity))

    def proof(self, along: Along) -> Proof:
        """No energy of its own, and nothing taken."""
        return Proof({}, {}, {})


class ComputedTorque:
    """The dynamics inverted: tau = M_hat a + C_hat v + g_hat,  xref'' = xd'' + 2 Lambda e' + Lambda^2 e.

    The reference velocity is the measured one, so that s_q is zero: nothing is damped, or learned from
    errors; `Composite` learns from predictions all the same. An arm with spare joints damps what its task
    does not see.

    Raises:
        InputError: when it is bound, gains beta or K_eps that are not zero.
    """

    independent = True
    statement = (
        "with exact parameters e'' + 2 Lambda e' + Lambda^2 e = 0; with others e is bounded as long as "
        "|1 - M^-1 M_hat| < 1"
    )

    def bind(self, cell: Cell, gains: Gains) -> BoundComputedTorque:
        return BoundComputedTorque(alone(self, gains, cell.m))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "ComputedTorque"}


class BoundComputedTorque:
    """`ComputedTorque` with its gain, (m,)."""

    statement = ComputedTorque.statement

    def __init__(self, Lambda: np.ndarray):
        self.Lambda = Lambda

    def command(self, errors: Errors) -> Asked:
        Lambda = self.Lambda
        acceleration = errors.xd_ddot + 2 * Lambda * errors.e_dot + Lambda**2 * errors.e
        return Asked(errors.x_dot, acceleration, np.zeros_like(acceleration))


class PDGravity:
    """A spring to where the robot should be, a damper, and gravity (Takegaki and Arimoto 1981).

        tau = g_hat + J^T K_p e - K_r v

    In joint space with K_p = K_r Lambda it is K_r (e' + Lambda e) + g_hat for a target that stands still.
    s_q is -v, from which (14) would learn away from exact gravity: it wants Gamma = 0. `compare` sees to it.

    Args:
        K_p: stiffness, a number or (m,), N/m or N·m/rad, above 0.

    Raises:
        InputError: not numbers, not finite, or not above 0; when it is bound, gains beta or K_eps that
            are not zero.
    """

    independent = True
    adaptive = False
    statement = (
        "e goes to zero for a target that stands still, with gravity that is exact and not adapted; moving "
        "targets are followed late"
    )

    free_gain = "K_p"

    def __init__(self, K_p: ArrayLike):
        self.K_p = finite_array("K_p", K_p)
        if not self.K_p.size or not self.K_p.min() > 0:
            raise InputError.expected("entries above 0", self.K_p.tolist(), "K_p")

    def scaled(self, factor: float) -> PDGravity:
        """This law with K_p multiplied."""
        return PDGravity(factor * self.K_p)

    def bind(self, cell: Cell, gains: Gains) -> BoundPDGravity:
        alone(self, gains, cell.m)
        return BoundPDGravity(spread("K_p", self.K_p, (cell.m,)))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "PDGravity", "K_p": self.K_p.tolist()}


class BoundPDGravity:
    """`PDGravity` with its stiffness, (m,)."""

    statement = PDGravity.statement

    def __init__(self, K_p: np.ndarray):
        self.K_p = K_p

    def command(self, errors: Errors) -> Asked:
        none = np.zeros_like(errors.e)
        return Asked(none, none, self.K_p * errors.e)


def alone(law: Any, gains: Gains, m: int) -> np.ndarray:
    """Lambda, (m,), of a law that has no place for beta and K_eps.

    Raises:
        InputError: they are not zero, or Lambda has another size.
    """
    name = type(law).__name__
    for gain in ("beta", "K_eps"):
        found = getattr(gains, gain)
        if found.any():
            raise InputError(
                f"expected {gain} = 0 with the law {name}, which has no place for it, found "
                f"{found.tolist()}; gains.independent() sets beta and K_eps to zero",
                subject="gains",
                found=found.tolist(),
            )
    return spread("Lambda", gains.Lambda, (m,))
