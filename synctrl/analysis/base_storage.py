"""The energy of what can be learned: 1/2 t^T (K Gamma K^T)^+ t, with t = K tilde, errors of base parameters.

The regressor is Y = Y_b K, so that (14) moves the base parameters by t' = -K Gamma K^T Y_b^T s_q, and

    d/dt 1/2 t^T G^+ t = - s_q^T Y tilde + s_q^T Y_b (1 - G G^+) t,      G = K Gamma K^T

This is a storage as good as 1/2 tilde^T Gamma^+ tilde, and smaller: of errors that no torque shows nothing
is left. The last term is the torque of what cannot be learned, (1 - G G^+) t, which is constant; it is zero
where G has an inverse, which may be so although entries of Gamma are zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..control.adaptation.metric import FullMetric
from ..coupling.cell import Cell
from ..robots.base_parameters import Grouping, grouping


@dataclass(frozen=True, eq=False)
class BaseStorage:
    """Base parameters of one robot with P adapted ones, r of them, and their errors' energy.

    Attributes:
        grouping: which combinations of the adapted parameters they are, K (r, P).
        metric: that of G = K Gamma K^T, (1, r, r), and of its generalized inverse.
    """

    grouping: Grouping
    metric: FullMetric

    def errors(self, tilde: np.ndarray) -> np.ndarray:
        """t = K tilde, (..., r), of tilde, (..., P or more, padded)."""
        K = self.grouping.K
        return np.asarray(tilde[..., : K.shape[1]] @ K.T)

    def energy(self, tilde: np.ndarray) -> np.ndarray:
        """1/2 t^T G^+ t, (...), N·m, of tilde, (..., P or more, padded)."""
        t = self.errors(tilde)
        return np.asarray(0.5 * (t * self._of(self.metric.lowered, t)).sum(-1))

    def frozen(self, tilde: np.ndarray) -> np.ndarray:
        """(1 - G G^+) t, (..., r), of tilde, (..., P or more, padded): what of t is never learned.

        Its torque is Y[:, grouping.columns] times it.
        """
        return self._of(self.metric.frozen, self.errors(tilde))

    @staticmethod
    def _of(function: Callable[[np.ndarray], np.ndarray], t: np.ndarray) -> np.ndarray:
        """A function of rows of one robot."""
        return np.asarray(function(t[..., None, :])[..., 0, :])


def base_storages(cell: Cell, Gamma: np.ndarray) -> tuple[BaseStorage, ...]:
    """The base parameters of every robot of a cell, and their errors' energy.

    Args:
        cell: the robots with what is adapted of them.
        Gamma: of (14), diagonals, (n, P), or matrices, (n, P, P), padded; `MetricGradient` has it.

    Raises:
        RobotError: the rank of a regressor is not clear.
    """
    return tuple(_base_storage(cell, i, Gamma[i]) for i in range(cell.n))


def _base_storage(cell: Cell, i: int, Gamma: np.ndarray) -> BaseStorage:
    parameters = cell.parameters[i]
    found = grouping(parameters, cell.robots[i].nv, cell.names[i])
    return BaseStorage(found, FullMetric(base_rate(found, Gamma)[None]))


def base_rate(found: Grouping, Gamma: np.ndarray) -> np.ndarray:
    """G = K Gamma K^T of one robot, (r, r), of its diagonal, (P or more, padded), or its padded matrix."""
    P = found.K.shape[1]
    G = found.K @ (np.diag(Gamma[:P]) if Gamma.ndim == 1 else Gamma[:P, :P]) @ found.K.T
    return np.asarray(0.5 * (G + G.T))
