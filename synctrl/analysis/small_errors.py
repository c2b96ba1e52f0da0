"""Small errors of a closed loop: coordinates of them, and the linear system that they obey.

    M s' = -(C + K_r + F_v) s + Y_b t - J^T c^T K_eps sigma        s   velocity error s_q
    t'   = -K Gamma K^T Y_b^T s                                    t   error of base parameters, K tilde
    e*'  = -Lambda e* + c J s                                      e*  coupled error
    I'   = S e* - (beta S S^T + l) I,    sigma = S^T (S e* - beta S S^T I)

on z = (s, u, e*, i) with t = L u, where L L^T = K Gamma K^T, and I = B i, where B is an orthonormal basis of
the range of S. In u the adaptation is the transpose of what it learns from, u' = -(Y_b L)^T s. What is not
adapted at all is left out, and so are integrals of axes with beta = 0, which act on nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..control.controller import Controller
from ..robots.base_parameters import Grouping, grouping
from .base_storage import base_rate
from .on_motion import OnMotion

#: eigenvalues below this share of the largest count as 0
ZERO = 1e-10
#: square of the entries of Y, in SI units, below which a motion excites nothing at all
FAINT = 1e-14


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates z of the errors of a cell.

    Attributes:
        controller: of the cell.
        groupings: base parameters of every robot.
        L: t = L u, one matrix, (r, k), per robot; columns that the motion does not excite are the last ones.
        unexcited: how many these are, per robot.
        B: orthonormal basis of the range of S, (p, rank).
    """

    controller: Controller
    groupings: tuple[Grouping, ...]
    L: tuple[np.ndarray, ...]
    unexcited: tuple[int, ...]
    B: np.ndarray

    @cached_property
    def parts(self) -> dict[str, list[slice]]:
        """Where s, u and e* of every robot, and i, are in z."""
        cell = self.controller.cell
        sizes = {
            "s": [cell.nv] * cell.n,
            "u": [part.shape[1] for part in self.L],
            "e*": [cell.m] * cell.n,
            "i": [self.B.shape[1] * int(self.acting.sum())],
        }
        ends = np.cumsum([0, *(size for part in sizes.values() for size in part)]).tolist()
        slices = iter([slice(a, b) for a, b in pairwise(ends)])
        return {name: [next(slices) for _ in part] for name, part in sizes.items()}

    @cached_property
    def acting(self) -> np.ndarray:
        """Which task coordinates have integrals that act, (m,), bool."""
        return self.controller.beta > 0

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.parts["i"][0].stop

    @cached_property
    def excited(self) -> np.ndarray:
        """Which coordinates are not those of directions that are not excited, (size,), bool."""
        found = np.ones(self.size, bool)
        for part, count in zip(self.parts["u"], self.unexcited, strict=True):
            found[part.stop - count : part.stop] = False
        return found

    def of(
        self, s_q: np.ndarray, theta_hat: np.ndarray, e_star: np.ndarray, integral: np.ndarray
    ) -> np.ndarray:
        """z of velocity errors, (n, nv), estimates, (n, P), coupled errors, (n, m), and integrals, (p, m)."""
        tilde = self.controller.cell.theta - theta_hat
        u = [
            np.linalg.pinv(L) @ found.K @ tilde[i, : found.K.shape[1]]
            for i, (L, found) in enumerate(zip(self.L, self.groupings, strict=True))
        ]
        return np.concatenate(
            [s_q.ravel(), *u, e_star.ravel(), (self.B.T @ integral)[:, self.acting].ravel()]
        )

    def estimates(self, z: np.ndarray) -> list[np.ndarray]:
        """Estimates of every robot, (P,), with the smallest errors that have this z."""
        pairs = zip(self.controller.cell.parameters, self.groupings, self.L, self.parts["u"], strict=True)
        return [p.theta - np.linalg.pinv(found.K) @ L @ z[u] for p, found, L, u in pairs]

    def rows(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Velocity errors, (n, nv), and coupled errors, (n, m)."""
        s, e = (np.array([z[part] for part in self.parts[name]]) for name in ("s", "e*"))
        return s, e


def make_coordinates(controller: Controller, on: OnMotion) -> Coordinates:
    """Coordinates for the motion that these instants are of.

    Raises:
        RobotError: the rank of a regressor is not clear.
    """
    cell = controller.cell
    found = tuple(
        grouping(p, robot.nv, name)
        for p, robot, name in zip(cell.parameters, cell.robots, cell.names, strict=True)
    )
    Gamma = controller.adaptation.Gamma  # type: ignore[attr-defined]
    pairs = [_adapted(on.Y[:, i], each, Gamma[i]) for i, each in enumerate(found)]
    L, unexcited = zip(*pairs, strict=True)
    U, values, _ = np.linalg.svd(cell.coupling.matrix, full_matrices=False)
    return Coordinates(controller, found, L, unexcited, U[:, values > ZERO * values[0]])


def _adapted(Y: np.ndarray, found: Grouping, Gamma: np.ndarray) -> tuple[np.ndarray, int]:
    """L of one robot, with the directions that are not excited last, and how many there are."""
    values, vectors = np.linalg.eigh(base_rate(found, Gamma))
    used = values > ZERO * max(values[-1], np.finfo(float).tiny)
    L = vectors[:, used] * np.sqrt(values[used])
    Y_u = Y[:, :, found.columns] @ L
    power, turn = np.linalg.eigh(np.einsum("tja,tjb->ab", Y_u, Y_u) / len(Y))
    count = int((power <= max(ZERO * power.max(initial=0.0), FAINT * np.sum(L * L))).sum())
    return L @ turn[:, ::-1], count


def error_matrices(on: OnMotion, z: Coordinates, factor: float = 1.0) -> np.ndarray:
    """A of z' = A z at the instants, (T, size, size), with Gamma times a factor."""
    A = np.zeros((len(on.t), z.size, z.size))
    parts, gains, S = z.parts, z.controller, z.controller.cell.coupling.matrix
    e, (i,), one = slice(parts["e*"][0].start, parts["e*"][-1].stop), parts["i"], np.eye(len(z.acting))
    to_e, to_i = np.kron(S.T @ S, one), -np.kron(S.T @ S @ S.T @ z.B, np.diag(gains.beta)[:, z.acting])
    sigma = np.hstack([to_e, to_i]).reshape(len(S.T), len(one), -1)  # S^T S e* - beta S^T S S^T B i
    for k, (s, u, own) in enumerate(zip(parts["s"], parts["u"], parts["e*"], strict=True)):
        M_inv = np.linalg.inv(on.M[:, k])
        Y = np.sqrt(factor) * on.Y[:, k][:, :, z.groupings[k].columns] @ z.L[k]
        A[:, s, s] = -M_inv @ on.D[:, k]
        A[:, s, u], A[:, u, s] = M_inv @ Y, -Y.mT
        A[:, s, e.start :] = -M_inv @ on.J_c[:, k].mT @ (gains.K_eps[:, None] * sigma[k])
        A[:, own, s] = on.J_c[:, k]
    A[:, e, e] = -np.diag(np.tile(gains.Lambda, len(S.T)))
    A[:, i, e] = np.kron(z.B.T @ S, one[z.acting])
    A[:, i, i] = -np.kron(z.B.T @ S @ S.T @ z.B, np.diag(gains.beta[z.acting]))
    A[:, i, i] -= np.diag(np.tile(gains.leak[z.acting], z.B.shape[1]))
    return A
