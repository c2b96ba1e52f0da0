"""What composite adaptation remembers: all that was ever predicted, in the size of theta.

Q' = R W^T W - mu Q and b' = R W^T y - mu b keep y = W theta as b = Q theta, so that what was once excited
goes on pulling until it has faded: as a stack of old data would, without choosing what to keep.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np


class Symmetric:
    """Symmetric matrices, (n, P, P), as rows of the entries on and above their diagonals."""

    def __init__(self, P: int):
        self._rows, self._columns = np.triu_indices(P)
        self.size = len(self._rows)
        self._index = np.zeros((P, P), dtype=int)
        self._index[self._rows, self._columns] = self._index[self._columns, self._rows] = range(self.size)

    def pack(self, matrices: np.ndarray) -> np.ndarray:
        """(n, P, P) -> (n, size)."""
        return matrices[:, self._rows, self._columns]

    def gram(self, W: np.ndarray) -> np.ndarray:
        """W^T W of matrices, (n, k, P) -> (n, size)."""
        return (W[..., self._rows] * W[..., self._columns]).sum(axis=1)

    def unpack(self, rows: np.ndarray) -> np.ndarray:
        """(n, size) -> (n, P, P)."""
        return rows[:, self._index]


class Remembering(Protocol):
    """What is remembered of n robots, as a state with a row per robot, (n, size)."""

    size: int
    fade: float

    def pull(self, state: np.ndarray, theta_hat: np.ndarray) -> np.ndarray:
        """kappa (b - Q theta_hat), (n, P)."""

    def rate(self, state: np.ndarray, W: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Of the state, for a regressor (n, nv, P) and what it predicts, (n, nv)."""


class Memory:
    """Q and b.

    Args:
        P: number of parameters.
        prediction: R, 1/(N·m·s).
        strength: kappa, 1/s.
        fade: mu, 1/s.
    """

    def __init__(self, P: int, prediction: float, strength: float, fade: float):
        self._form, self._R, self._kappa, self.fade = Symmetric(P), prediction, strength, fade
        self.size = self._form.size + P

    def pull(self, state: np.ndarray, theta_hat: np.ndarray) -> np.ndarray:
        Q, b = self._split(state)
        return self._kappa * (b - np.matvec(Q, theta_hat))

    def rate(self, state: np.ndarray, W: np.ndarray, y: np.ndarray) -> np.ndarray:
        gained = self._form.gram(W), np.matvec(W.mT, y)
        return self._R * np.concatenate(gained, axis=1) - self.fade * state

    def _split(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._form.unpack(state[:, : self._form.size]), state[:, self._form.size :]


class Nothing:
    """No memory."""

    size, fade = 0, 0.0

    def pull(self, state: np.ndarray, theta_hat: np.ndarray) -> np.ndarray:
        return np.zeros_like(theta_hat)

    def rate(self, state: np.ndarray, W: np.ndarray, y: np.ndarray) -> np.ndarray:
        return state
