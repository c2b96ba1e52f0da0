"""A law of one's own: every robot tracks, and a force k sigma pulls it towards the others.

It says nothing of its part in V, so that certificates call its runs outside the theorem.
"""

import numpy as np

from synctrl import Cell, Gains
from synctrl.control.laws import Asked, Errors


class Pulling:
    def __init__(self, k: float):
        self.k = k

    def bind(self, cell: Cell, gains: Gains) -> "BoundPulling":
        return BoundPulling(self.k, gains.Lambda)

    def as_dict(self) -> dict:
        return {"name": "Pulling", "k": self.k}


class BoundPulling:
    def __init__(self, k: float, Lambda: np.ndarray):
        self.k, self.Lambda = k, Lambda

    def command(self, errors: Errors) -> Asked:
        xref_dot = errors.xd_dot + self.Lambda * errors.e
        xref_ddot = errors.xd_ddot + self.Lambda * errors.e_dot
        return Asked(xref_dot, xref_ddot, self.k * errors.sigma)
