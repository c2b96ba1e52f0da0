"""From r to the weighted errors w = c e: mode by mode of S^T S, and axis by axis, in closed form.

Integrals have r = w' + Lambda w + beta sigma + (Lambda - l) beta E and E' = sigma - l E, sigma = S^T S w.
For an eigenvector of S^T S with eigenvalue lambda, a = Lambda and b = l + beta lambda,

    w_j = G_j (r_j + w_j(0) delta),      G_j = (p + l) / ((p + a)(p + b)),      0 <= l <= a, b

if the integrals start at 0. So g_j(t) = e^(-a t) - (b - l) (e^(-b t) - e^(-a t)) / (a - b), which is between
-1 and 1, and with another mode of c = l + beta lambda', by residues,

    int g_j g_k dt = (a b (a + c) + a c (a + b) + l^2 (2 a + b + c)) / (2 a (a + b) (a + c) (b + c))

which for j = k is (l^2 + a b) / (2 a b (a + b)), at most 1 / (2 Lambda), and this for lambda = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..control.controller import Controller

#: stands for a pole at 0, whose limit is meant: small against every rate, and far from what is too small
NEAR_ZERO = 1e-100


@dataclass(frozen=True, eq=False)
class ErrorModes:
    """How r becomes w in a cell under the paper's law.

    Attributes:
        vectors: orthonormal eigenvectors of S^T S, (n, n), one per column.
        Lambda: a, (m,), 1/s.
        rates: b of every axis and mode, (m, n), 1/s.
        leak: l, (m,), 1/s.
    """

    vectors: np.ndarray
    Lambda: np.ndarray
    rates: np.ndarray
    leak: np.ndarray

    @classmethod
    def of(cls, controller: Controller) -> ErrorModes:
        """Those of a controller with the law `SunMills`."""
        S = controller.cell.coupling.matrix
        values, vectors = np.linalg.eigh(S.T @ S)
        values = np.where(values > 1e-12 * values[-1], values, 0.0)
        rates = controller.leak[:, None] + np.outer(controller.beta, values)
        return cls(vectors, controller.Lambda, rates, controller.leak)

    def free(self, w: np.ndarray, times: np.ndarray) -> np.ndarray:
        """w at some times, (T, n, m), of w(0), (n, m), if r is 0."""
        a, b, l = self.Lambda[:, None], self.rates, self.leak[:, None]
        t = times[:, None, None]
        apart, slow = np.abs(a - b), np.minimum(a, b)
        met = np.where(apart * t > 0, -np.expm1(-apart * t) / np.where(apart * t > 0, apart * t, 1.0), 1.0)
        g = np.exp(-a * t) - (b - l) * t * np.exp(-slow * t) * met  # (T, m, n)
        return np.einsum("ij,taj,kj,ka->tia", self.vectors, g, self.vectors, w)

    def free_rates(self) -> np.ndarray:
        """Bounds of |w'|_L2 / |w(0)| on every axis if r is 0, (m,), 1/s^1/2: norms of p G_j - 1."""
        a, b, l = self.Lambda[:, None], self.rates, self.leak[:, None]
        return np.asarray(np.sqrt(((a + b - l) ** 2 + a * b) / (2 * (a + b))).max(-1))

    def spread(self, axis: int) -> np.ndarray:
        """h^2, (n, n), s: |w_i| on an axis is at most sum_k h_ik |r_k|_L2, beside the free motion."""
        a, l, b = self.Lambda[axis], self.leak[axis], np.maximum(self.rates[axis], NEAR_ZERO)
        c, b = b, b[:, None]
        inner = a * b * (a + c) + a * c * (a + b) + l * l * (2 * a + b + c)
        inner /= 2 * a * (a + b) * (a + c) * (b + c)
        pairs = self.vectors[:, None] * self.vectors[None]  # q_ji q_jk, (n, n, modes)
        return np.maximum(np.einsum("ikj,jl,ikl->ik", pairs, inner, pairs, optimize=True), 0.0)
