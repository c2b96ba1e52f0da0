"""From r to w in the modes of S^T S: a filter per mode and axis, its norms, and its free response.

With S^T S q_j = lambda_j q_j, w_j = sum_i q_ij w_i, likewise r_j and E_j, and a leak l, the law's

    r = w' + Lambda w + beta sigma + (Lambda - l) beta E,   E' = sigma - l E,   sigma = S^T S w,

falls apart into modes, because sigma_j = lambda_j w_j:

    w_j = [(p + l) (r_j + w_j(0)) - (Lambda - l) beta E_j(0)] / [(p + a) (p + b)],
    a = Lambda,   b = l + beta lambda_j.

Lambda, beta and the leak are diagonal, so axes do not mix. Robot i has w_i = sum_k g_ik * r_k beside the free
response, where g_ik = sum_j q_ij q_kj g_j and g_j is the impulse response of (p + l)/[(p + a) (p + b)]. With
another mode g', of c = l + beta lambda', residues give

    int g_j g' dt = (a b (a + c) + a c (a + b) + l^2 (2 a + b + c)) / (2 a (a + b) (a + c) (b + c)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..control.controller import Controller

#: share of the largest eigenvalue of S^T S up to which an eigenvalue counts as 0
ZERO = 1e-12
#: stands for a pole at 0, whose limit is meant: small against every rate, and far from what is too small
NEAR_ZERO = 1e-100


@dataclass(frozen=True, eq=False)
class ModalFilter:
    """The filters from r_j to w_j of all n modes and m axes.

    Attributes:
        eigenvalues: of S^T S, ascending, (n,); those that are 0 but for rounding are 0.
        vectors: q_j, as columns, (n, n).
        Lambda, beta, leak: gains, (m,), 1/s.
    """

    eigenvalues: np.ndarray
    vectors: np.ndarray
    Lambda: np.ndarray
    beta: np.ndarray
    leak: np.ndarray

    @classmethod
    def of(cls, controller: Controller) -> ModalFilter:
        """The filters of a controller whose law has that r, such as `SunMills`."""
        S = controller.cell.coupling.matrix
        return cls.from_matrix(S, controller.Lambda, controller.beta, controller.leak)

    @classmethod
    def from_matrix(
        cls, S: np.ndarray, Lambda: np.ndarray, beta: np.ndarray, leak: np.ndarray
    ) -> ModalFilter:
        """The filters of a coupling matrix S, (p, n), and gains, (m,), the leak at most Lambda."""
        values, vectors = np.linalg.eigh(S.T @ S)
        values = np.where(values > ZERO * values.max(initial=0.0), values, 0.0)
        return cls(values, vectors, Lambda, beta, leak)

    @property
    def pull(self) -> np.ndarray:
        """beta lambda_j, (n, m), 1/s: what beta adds to Lambda."""
        return self.beta * self.eigenvalues[:, None]

    @property
    def gain(self) -> np.ndarray:
        """H-infinity norm, (n, m), s: 1/(Lambda + beta lambda_j) without a leak.

        With one the largest value is 1/(sqrt(a^2 - l^2) + sqrt(b^2 - l^2)), at w^2 = -l^2 + sqrt((a^2 - l^2)
        (b^2 - l^2)), and where that is below 0 it is `static`.
        """
        l2 = self.leak**2
        first, second = self.Lambda**2 - l2, (self.leak + self.pull) ** 2 - l2
        peaks = (first * second > l2**2) | (l2 == 0)
        return np.where(peaks, 1 / np.where(peaks, np.sqrt(first) + np.sqrt(second), 1.0), self.static)

    @property
    def h2(self) -> np.ndarray:
        """H2 norm, (n, m), s^1/2: 1/sqrt(2 (Lambda + beta lambda_j)) without a leak."""
        return self._norm(np.ones(self.pull.shape), np.broadcast_to(self.leak, self.pull.shape))

    @property
    def static(self) -> np.ndarray:
        """What a constant r of 1 leaves of w_j, (n, m), s: l/(a b), and 1/Lambda where beta lambda_j = 0."""
        b = np.where(self.pull > 0, self.leak + self.pull, 1.0)
        return np.where(self.pull > 0, self.leak / (self.Lambda * b), 1 / self.Lambda)

    @property
    def sentence(self) -> str:
        """What beta does to the gains from r, in words."""
        pulled = self.pull > 0
        if not pulled.any():
            return (
                "without beta every mode has the gain of a robot alone, 1/Lambda, and r that is constant "
                "leaves r/Lambda in the differences too"
            )
        less = (1 / self.Lambda / self.gain)[pulled]
        even = np.ptp(less) < 1e-9 * less.max()
        span = f"{less.min():.3g}" if even else f"{less.min():.3g} to {less.max():.3g}"
        left = float(self.static[pulled].max())
        rest = "nothing" if left == 0 else f"at most {left:.3g} s times r"
        unchanged = ", and r/Lambda in the common mode, whose gain stays 1/Lambda"
        common = "" if self.eigenvalues.all() else unchanged
        return (
            f"beta makes the gain from r to the differences {span} times smaller than 1/Lambda; r that is "
            f"constant leaves {rest} in them{common}"
        )

    def to_modes(self, rows: np.ndarray) -> np.ndarray:
        """sum_i q_ij x_i of one row x per robot, (..., n, m)."""
        return self.vectors.T @ rows

    def free(self, t: np.ndarray, w0: np.ndarray, E0: np.ndarray) -> np.ndarray:
        """w_j(t) without r, of w_j(0) and E_j(0), (n, m) each, at times (T,), s: (T, n, m).

        n_1 e^-bt + (n_0 - a n_1) (e^-at - e^-bt)/(b - a) with n_1 = w_j(0), n_0 = l w_j(0) - (Lambda - l)
        beta E_j(0). With w_j(0) = 1 and E_j(0) = 0 it is the impulse response.
        """
        a, b = np.broadcast_arrays(self.Lambda, self.leak + self.pull)
        n0, t = self._rest(w0, E0), np.reshape(t, (-1, 1, 1))
        slow, apart = np.minimum(a, b), np.abs(b - a) * t
        share = -np.expm1(-apart) / np.where(apart > 0, apart, 1.0)
        both = np.exp(-slow * t) * t * np.where(apart > 0, share, 1.0)
        return w0 * np.exp(-b * t) + (n0 - a * w0) * both

    def free_norm(self, w0: np.ndarray, E0: np.ndarray) -> np.ndarray:
        """L2 norm of `free` over all times, (n, m)."""
        return self._norm(w0, self._rest(w0, E0))

    def free_rate_norm(self) -> np.ndarray:
        """The most that the L2 norm of w' without r can be of |w(0)| if E(0) is 0, (m,), 1/s^1/2.

        Of a mode it is the norm of p (p + l)/[(p + a) (p + b)] - 1.
        """
        a, b = np.broadcast_arrays(self.Lambda, self.leak + self.pull)
        return np.asarray(self._norm(a + b - self.leak, a * b).max(axis=0))

    def spread(self, axis: int) -> np.ndarray:
        """h^2, (n, n), s: |w_i| on an axis is at most sum_k h_ik |r_k|_L2, beside the free response."""
        a, l = self.Lambda[axis], self.leak[axis]
        b = c = np.maximum(l + self.pull[:, axis], NEAR_ZERO)
        b = b[:, None]
        inner = a * b * (a + c) + a * c * (a + b) + l * l * (2 * a + b + c)
        inner /= 2 * a * (a + b) * (a + c) * (b + c)
        pairs = self.vectors[:, None] * self.vectors[None]  # q_ij q_kj, (n, n, modes)
        return np.maximum(np.einsum("ikj,jl,ikl->ik", pairs, inner, pairs, optimize=True), 0.0)

    def _rest(self, w0: np.ndarray, E0: np.ndarray) -> np.ndarray:
        """n_0, (n, m): E_j is 0 in the modes of which S knows nothing, and unseen without beta."""
        return self.leak * w0 - np.where(self.pull > 0, (self.Lambda - self.leak) * self.beta * E0, 0.0)

    def _norm(self, n1: np.ndarray, n0: np.ndarray) -> np.ndarray:
        """L2 norm of the response (n_1 p + n_0)/((p + a) (p + b)), (n, m)."""
        a, b = np.broadcast_arrays(self.Lambda, self.leak + self.pull)
        slow = np.where(b > 0, n0**2 / np.where(b > 0, a * b, 1.0), 0.0)
        return np.sqrt((n1**2 + slow) / (2 * (a + b)))
