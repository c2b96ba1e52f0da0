"""One robot leads and the others follow what it does, not what it should do."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from ..gains import Gains
from .classic import alone
from .protocol import Asked, Errors

#: relative size below which a singular value of S, or an entry of its null vector, counts as zero
ROUNDING = 1e-9


class MasterSlave:
    """Slotine and Li's law with slaves that track where the coupling wants them, given where the master is.

        e_j -> e_j - c_j^-1 n_j c_1 e_1,   S n = 0,  n_1 = 1

    The rate of the master's error is measured, its acceleration dropped. Every slave has to hear the master.

    Args:
        master: which robot leads, counted from 0.

    Raises:
        InputError: when it is bound, no such robot, a coupling that leaves more free than one common motion,
            or gains beta or K_eps that are not zero.
    """

    independent = True
    statement = (
        "the master's e goes to zero; slaves follow it but for the acceleration of its error, "
        "which is dropped"
    )

    def __init__(self, master: int = 0):
        self.master = master

    def bind(self, cell: Cell, gains: Gains) -> BoundMasterSlave:
        if isinstance(self.master, bool) or self.master not in range(cell.n):
            raise InputError.expected(f"a robot from 0 to {cell.n - 1}", self.master, "master")
        return BoundMasterSlave(alone(self, gains, cell.m), _common(cell, self.master), self.master)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "MasterSlave", "master": self.master}


class BoundMasterSlave:
    """`MasterSlave` with its gain, (m,), and n, (n, 1), without the master's entry."""

    statement = MasterSlave.statement

    def __init__(self, Lambda: np.ndarray, common: np.ndarray, master: int):
        self.Lambda, self._common, self._master = Lambda, common, master

    def command(self, errors: Errors) -> Asked:
        led = self._common * errors.weighted[:, self._master, None]  # n_j w_1 and its rate, (2, n, m)
        shift = np.matvec(errors.c_inv, led)
        shift[1] -= np.matvec(errors.c_inv, np.matvec(errors.c_dot, shift[0]))
        e, e_dot = errors.error - shift
        velocity = errors.xd_dot - shift[1] + self.Lambda * e
        acceleration = errors.xd_ddot + self.Lambda * e_dot
        return Asked(velocity, acceleration, np.zeros_like(velocity))


def _common(cell: Cell, master: int) -> np.ndarray:
    """n with S n = 0 and n_master = 1, (n, 1), its own entry zero: the master follows nobody."""
    _, sizes, rows = np.linalg.svd(cell.coupling.matrix)
    rank = int(np.sum(sizes > ROUNDING * sizes.max(initial=0.0)))
    vector = rows[-1]
    if rank != cell.n - 1 or abs(vector[master]) < ROUNDING:
        raise InputError(
            "MasterSlave expects a coupling that leaves one common motion, in which the master takes part, "
            f"found a matrix S of rank {rank} for {cell.n} robots",
            subject="coupling",
            found=rank,
        )
    common = (vector / vector[master])[:, None]
    common[master] = 0.0
    return common
