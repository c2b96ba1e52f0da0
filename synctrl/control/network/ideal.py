"""Ideal communication: everybody knows at once what the coupling compares, eqs. (7) and (28)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array
from ...coupling.cell import Cell
from ...coupling.coupling import Coupling
from ...errors import InputError
from ..gains import spread
from .protocol import Received


class Ideal:
    """Everybody knows at once what the coupling compares, as the paper assumes.

    Args:
        leak: rate at which integrals of synchronization errors are forgotten, a number or (m,), 1/s, that
            of the gains.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    def __init__(self, leak: ArrayLike = 0.0):
        self.leak = finite_array("leak", leak)
        if self.leak.min(initial=0.0) < 0:
            raise InputError.expected("rates of at least 0", float(self.leak.min()), "leak")

    def bind(self, cell: Cell) -> BoundIdeal:
        """This network for a cell.

        Raises:
            InputError: another number of leaks than task coordinates.
        """
        return BoundIdeal(cell.coupling, cell.m, spread("leak", self.leak, (cell.m,)))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Ideal", **({"leak": self.leak.tolist()} if self.leak.any() else {})}


class BoundIdeal:
    """`Ideal` between the robots of a cell: its memory are the integrals of epsilon, (p, m)."""

    def __init__(self, coupling: Coupling, m: int, leak: np.ndarray | None = None):
        self._shape = coupling.pairs, m
        self.leak = np.zeros(m) if leak is None else leak
        self._leaks = bool(self.leak.any())
        self._compare, self._distribute = coupling.products

    def start(self) -> np.ndarray:
        return np.zeros(self._shape)

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        epsilon, epsilon_dot = self._compare(w)  # (7), (28), and the derivative
        shares = self._distribute(np.array((memory, epsilon, epsilon_dot)))
        memory_dot = epsilon - self.leak * memory if self._leaks else epsilon
        return Received(epsilon, epsilon_dot, shares, memory_dot)

    def integral(self, memory: np.ndarray) -> np.ndarray:
        return memory

    def outside(self) -> str | None:
        return None
