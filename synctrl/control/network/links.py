"""Who hears whom, and what a robot makes of it: the W form of the paper's integrals.

With w_i = c_i e_i, W_i' = w_i - leak W_i and the entries L_ii and A_ij of S^T S, a robot's shares are

    E_i      = L_ii W_i  + sum_j A_ij W_j,
    sigma_i  = L_ii w_i  + sum_j A_ij w_j,
    sigma_i' = L_ii w_i' + sum_j A_ij w_j'.

These are S^T times the integrals of epsilon, epsilon and its rate: W = int w gives I = S W, so nothing is new
where everybody knows everything. But every robot integrates its own error alone, and tells the result. After
any message was lost the next one restores all of E. Two robots that each integrate the epsilon of their pair
from what they hear would disagree for ever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import copy
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...coupling.coupling import Coupling


class Links:
    """The links i <- j of a coupling, where A_ij is not 0, sorted by who hears, then by who is heard.

    Args:
        coupling: which robots are compared.

    Attributes:
        own: L_ii, (n, 1).
        hearer, sender: i and j of every link, (l,).
        weight: A_ij, (l,).
    """

    def __init__(self, coupling: Coupling):
        from scipy.sparse import csr_array

        starts, columns, entries = coupling.incidence
        S_T = csr_array((entries, columns, starts), (coupling.robots, coupling.pairs))
        L = (S_T @ S_T.T).tocoo()
        order = np.lexsort((L.col, L.row))
        i, j, A = L.row[order], L.col[order], L.data[order]
        apart = (i != j) & (A != 0)
        self._set(np.asarray(L.diagonal())[:, None], i[apart], j[apart], A[apart])

    def _set(self, own: np.ndarray, hearer: np.ndarray, sender: np.ndarray, weight: np.ndarray) -> None:
        from scipy.sparse import csr_array

        self.own, self.hearer, self.sender, self.weight = own, hearer, sender, weight
        self._A = csr_array((weight, (hearer, np.arange(self.count))), (len(own), self.count))

    def of_robot(self, i: int) -> Links:
        """The links on which robot i hears, as it knows them: `own` is (1, 1), and `hearer` is 0."""
        mine, alone = self.hearer == i, copy(self)
        alone._set(self.own[i : i + 1].copy(), 0 * self.hearer[mine], self.sender[mine], self.weight[mine])
        return alone

    @property
    def count(self) -> int:
        """Number of links, l."""
        return len(self.hearer)

    def shares(self, own: np.ndarray, heard: np.ndarray) -> np.ndarray:
        """E, sigma and sigma', (3, n, m), or some of them.

        Args:
            own: W, w and w' of every robot, as it knows them, (3, n, m).
            heard: the same of who is heard, as the one who hears believes it, (3, l, m).
        """
        told = self._A @ heard.transpose(1, 0, 2).reshape(self.count, -1)
        return self.own * own + told.reshape(own.shape[1], *own.shape[::2]).transpose(1, 0, 2)

    def slips(self, told: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Sums of |A_ij| and of A_ij r_j over the links that count, (2, n, m), the first in all columns.

        Args:
            told: r of who is heard, (l, m).
            counts: 1 for links that count, 0 for others, (l,).
        """
        weight, heard = abs(self._A) @ counts, self._A @ (counts[:, None] * told)
        return np.stack((np.broadcast_to(weight[:, None], heard.shape), heard))

    @property
    def share(self) -> float:
        """How much a robot hears of others beside what it hears of itself.

        With D the diagonal of S^T S it is the largest eigenvalue of D^-1/2 |A| D^-1/2. It is at most 1 in a
        coupling of pairs, because 2 |S_ki x_i S_kj x_j| <= (S_ki x_i)^2 + (S_kj x_j)^2.
        """
        n = len(self.own)
        A, scale = np.zeros((n, n)), 1 / np.sqrt(self.own[:, 0])
        A[self.hearer, self.sender] = np.abs(self.weight)
        return float(np.linalg.eigvalsh(scale[:, None] * A * scale)[-1])

    def of(self, matrix: np.ndarray) -> np.ndarray:
        """The entries of a setting, a number or (n, n), for every link, (l,)."""
        return np.broadcast_to(matrix, (len(self.own),) * 2)[self.hearer, self.sender]


class Parts:
    """Where the parts of a memory are in one flat vector.

    Args:
        shapes: of the parts, by name.

    Attributes:
        size: of the vector.
        starts: where each part begins, by name.
    """

    def __init__(self, shapes: Mapping[str, tuple[int, ...]]):
        sizes = [math.prod(shape) for shape in shapes.values()]
        ends = np.cumsum(sizes).tolist()
        self.size = ends[-1]
        self.starts = {name: end - size for name, size, end in zip(shapes, sizes, ends, strict=True)}
        self._parts = [
            (name, slice(end - size, end), shape)
            for (name, shape), size, end in zip(shapes.items(), sizes, ends, strict=True)
        ]

    def __call__(self, flat: np.ndarray) -> Any:
        """Views of the parts, as attributes under their names; flat may have a leading axis of time."""
        lead = flat.shape[:-1]
        return SimpleNamespace(
            **{name: flat[..., part].reshape(*lead, *shape) for name, part, shape in self._parts}
        )
