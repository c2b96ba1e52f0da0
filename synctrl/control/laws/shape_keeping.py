"""Synchronization of robots that hold one object at pins: only errors that deform it are pulled together."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from ...tasks.rigid_motions import deformation, deformation_rate, place_matrix
from ..gains import Gains, spread
from .protocol import Along, Asked, Errors, Proof


class ShapeKeeping:
    """Every robot tracks, and errors that no rigid motion of the desired places explains vanish faster.

        xref' = xd' + Lambda e + beta N(t) e,   N = 1 - G^T (G G^T)^-1 G

    at the desired places of all robots, see `synctrl.tasks.rigid_motions`. Differences of errors, which the
    couplings of the package take, also resist when a whole object turns, for its pins are then displaced
    differently; N e does not. V' = -s_q^T K_r s_q, so s_q goes to zero; and with r = xref' - x'

        1/2 (|e|^2)' = -e^T Lambda e - beta e^T N e + e^T r

    in which N is not below 0, so e follows. Every robot has to know the errors of all. Of the gains the law
    takes Lambda and beta, one number; it has no place for K_eps and for a leak, which have to be zero.
    """

    statement = (
        "e goes to zero, parameters known or not; V' = -s_q^T K_r s_q; errors that deform what is held decay "
        "with Lambda + beta, others with Lambda"
    )

    def bind(self, cell: Cell, gains: Gains) -> BoundShapeKeeping:
        """This law for a cell of robots that are told positions of their tips.

        Raises:
            InputError: coordinates that are no positions in a plane or in space, places in one point or on
                one line, gains of another size, betas that differ, or K_eps or a leak that is not zero.
        """
        found = {name: spread(name, getattr(gains, name), (cell.m,)) for name in GAINS}
        for name in ("K_eps", "leak"):
            if found[name].any():
                raise InputError.expected("0, which ShapeKeeping has no place for", found[name], name)
        if np.ptp(found["beta"]) > 0:
            raise InputError.expected("one number for all axes", found["beta"], "beta")
        _check_places(cell)
        return BoundShapeKeeping(cell, found["Lambda"], float(found["beta"][0]))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "ShapeKeeping"}


#: gains that are looked at
GAINS = "Lambda", "beta", "K_eps", "leak"
#: how many instants are remembered, as methods ask for some of them again
ASKED_AGAIN = 4


class BoundShapeKeeping:
    """`ShapeKeeping` for the desired motions of a cell, with Lambda, (m,), and beta."""

    statement = ShapeKeeping.statement

    def __init__(self, cell: Cell, Lambda: np.ndarray, beta: float):
        self.Lambda, self.beta = Lambda, beta
        self._references = cell.references
        self._deformation = lru_cache(ASKED_AGAIN)(self._deformation_at)

    def command(self, errors: Errors) -> Asked:
        """The reference motion; no force."""
        (e, e_dot), (N, N_dot) = errors.error, self._deformation(float(errors.t))
        shares = N @ e.ravel(), N @ e_dot.ravel() + N_dot @ e.ravel()
        pulled = self.beta * np.reshape(shares, errors.error.shape)
        xref = errors.rates + self.Lambda * errors.error + pulled
        return Asked(xref[0], xref[1], np.zeros_like(e))

    def _deformation_at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """N and N' of the desired places at time t."""
        r, r_dot, _ = self._references(np.array([t]))[0].desired
        return deformation(r), deformation_rate(r, r_dot)

    def proof(self, along: Along) -> Proof:
        """No energy of its own, and no force: V' is that of tracking."""
        return Proof({}, {}, {})


def _check_places(cell: Cell) -> None:
    labels = cell.labels
    if labels not in (("x", "y"), ("x", "y", "z")):
        raise InputError.expected(
            "positions along x and y, or along x, y and z", labels, "ShapeKeeping, space"
        )
    G = place_matrix(cell.references(np.zeros(1))[0].desired[0])
    rank = int(np.linalg.matrix_rank(G))
    if rank < len(G):
        text = f"expected places that fix a body, G of rank {len(G)}, found rank {rank}"
        raise InputError(text, subject="ShapeKeeping, desired motions", found=rank)
