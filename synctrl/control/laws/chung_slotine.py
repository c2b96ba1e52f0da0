"""Damping between robots instead of springs, after Chung and Slotine (2009), for any coupling."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array
from ...coupling.cell import Cell
from ...coupling.coupling import Coupling
from ...errors import InputError
from ..gains import Gains, spread
from .classic import alone
from .protocol import Along, Asked, Errors, Proof
from .sun_mills import BoundSunMills


class ChungSlotine:
    """Every robot tracks, and differences between their velocity errors are damped.

        r = w' + Lambda w,  rho = S r,  xref' = c^-1 (c xd' + c' e + Lambda w),
        f_i = c_i^T K_2 sum_k S_ki rho_k,  so that  V' = -s_q^T K_r s_q - sum_k rho_k^T K_2 rho_k.

    Of the gains it takes Lambda; it has no place for beta and K_eps, which have to be zero.

    Args:
        K_2: damping between robots, a number or (m,), N·m·s/rad when c has no unit, not below 0.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    free_gain = "K_2"
    independent = True
    statement = (
        "e goes to zero, parameters known or not: V' = -s_q^T K_r s_q - rho^T K_2 rho; velocity errors of "
        "neighbours are damped, differences between position errors are not pulled together"
    )

    def __init__(self, K_2: ArrayLike):
        self.K_2 = finite_array("K_2", K_2)
        if self.K_2.size and self.K_2.min() < 0:
            raise InputError.expected("entries of at least 0", self.K_2.min(), "K_2")

    def scaled(self, factor: float) -> ChungSlotine:
        """This law with K_2 multiplied."""
        return ChungSlotine(factor * self.K_2)

    def bind(self, cell: Cell, gains: Gains) -> BoundChungSlotine:
        """This law for a cell.

        Raises:
            InputError: gains of another size, or beta or K_eps that are not zero.
        """
        return BoundChungSlotine(
            alone(self, gains, cell.m), spread("K_2", self.K_2, (cell.m,)), cell.coupling
        )

    def as_dict(self) -> dict[str, Any]:
        return {"name": "ChungSlotine", "K_2": self.K_2.tolist()}


class BoundChungSlotine:
    """`ChungSlotine` with gains, (m,), and the coupling that compares r."""

    statement = ChungSlotine.statement

    def __init__(self, Lambda: np.ndarray, K_2: np.ndarray, coupling: Coupling):
        none = np.zeros_like(Lambda)
        self.Lambda, self.K_2, self._coupling = Lambda, K_2, coupling
        self._tracking = BoundSunMills(Lambda, none, none, "exact")

    def command(self, errors: Errors) -> Asked:
        rho_shares = errors.sigma_dot + self.Lambda * errors.sigma
        return self._tracking.command(errors)._replace(force=np.matvec(errors.c.mT, self.K_2 * rho_shares))

    def proof(self, along: Along) -> Proof:
        """No energy of its own; it only takes."""
        rho = self._coupling.compare(along.r)
        return Proof({}, {}, {"mutual damping": -rho * self.K_2 * rho})
