"""One robot's share of the closed loop, traced with symbols into three functions.

`measure` finds out where the robot is, `control` is the law, `plant` is its true dynamics. Between the first
two the driver lets the coupling exchange what neighbours need. The law itself is not written again here: the
functions of `control/law.py` run on symbols.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control import law
from ..control.laws import Asked, Errors
from ..control.laws.protocol import ROWS
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.weights import Weights
from ..robots.friction_parameters import friction_diagonals
from ..robots.symbolic import Symbols
from .kind import Kind


class Trace:
    """CasADi functions of one kind of robot.

    Args:
        kind: the kind.
        name: prefix of the generated names.
    """

    def __init__(self, kind: Kind, name: str):
        import casadi as ca

        self.ca, self.kind, self.name = ca, kind, name
        nv, m = kind.nv, kind.m
        sym = ca.SX.sym
        self.q, self.v = sym("q", nv), sym("v", nv)
        self.sine, self.cosine = sym("sine", nv), sym("cosine", nv)
        self.base = sym("base", 12)  # rotation row by row, translation, of the first joint's placement
        self.posture = [sym(name, nv) for name in ("W_inv", "posture", "gain")]
        self.desired, self.weights = sym("desired", 3 * m), sym("weights", 4 * m * m)
        tasks = 0 if kind.space == "joint" else 1
        self.J, self.J_dot = sym("J", tasks * m * nv), sym("J_dot", tasks * m * nv)
        self.J_inv, self.G = sym("J_inv", tasks * nv * m), sym("G", m * m if kind.redundant else 0)

    # -- where the robot is -------------------------------------------------------------------------------

    def measure(self) -> Any:
        """q, v, base, desired, weights, W^-1 -> x, e, x', xd', xd'', w, w', sine, cosine, J, J', J^-1, G."""
        ca, kind = self.ca, self.kind
        W_inv = ca.SX.sym("W_inv", kind.nv)
        sine, cosine = ca.sin(self.q), ca.cos(self.q)
        x, e, x_dot, xd_dot, xd_ddot, J, J_dot = self._task(sine, cosine)
        J_inv, G = self._inverse(J, W_inv)
        c, c_dot = self._weights()[:2]
        w, w_dot = law.compute_weighted_errors(c, c_dot, np.array((e, xd_dot - x_dot)))
        outputs = [x, e, x_dot, xd_dot, xd_ddot, w, w_dot]
        inputs = [self.q, self.v, self.base, self.desired, self.weights, W_inv]
        flat = [*map(self._flat, outputs), sine, cosine, *map(self._flat, (J, J_dot, J_inv, G))]
        return self._function("measure", inputs, flat)

    def _task(self, sine: Any, cosine: Any) -> tuple:
        kind, m = self.kind, self.kind.m
        xd, xd_dot, xd_ddot = self._array(self.desired, 3, m)
        empty = np.empty((0, 0), dtype=object)
        if kind.space == "joint":
            q, v = self._array(self.q, m), self._array(self.v, m)
            return q, xd - q, v, xd_dot, xd_ddot, empty, empty
        x, R, J, J_dot = Symbols(kind.fixed, self.q, sine, cosine).tip(self.v, *self._base())
        if kind.space == "pose":
            from .pose import pose_task

            return pose_task(self.ca, self.v, x, R, J, J_dot, self.desired)
        rows = list(kind.rows)
        x, J, J_dot = (self._matrix(part[rows, :]) for part in (x, J, J_dot))
        return x[:, 0], xd - x[:, 0], np.matvec(J, self._array(self.v, kind.nv)), xd_dot, xd_ddot, J, J_dot

    def _inverse(self, J: np.ndarray, W_inv: Any) -> tuple[np.ndarray, np.ndarray]:
        """J^-1, or W^-1 J^T G with G = (J W^-1 J^T)^-1."""
        empty = np.empty((0, 0), dtype=object)
        if self.kind.space == "joint":
            return empty, empty
        if not self.kind.redundant:
            return self._inverted(J), empty
        W_inv_JT = self._array(W_inv, self.kind.nv)[:, None] * J.T
        G = self._inverted(J @ W_inv_JT)
        return W_inv_JT @ G, G

    def _inverted(self, A: np.ndarray) -> np.ndarray:
        """Inverse by minors up to three rows, by an unrolled QR factorization above."""
        ca, rows = self.ca, len(A)
        symbols = ca.SX.sym("A", rows, rows)
        small = rows <= 3
        inverse = ca.inv_minor(symbols) if small else ca.solve(symbols, ca.SX.eye(rows))
        function = ca.Function("inverse", [symbols], [inverse])
        return self._matrix(function(self._back(A)))

    # -- the law ------------------------------------------------------------------------------------------

    def control(self) -> Any:
        """The law: torque, z' of the adaptation, e*, s_q."""
        ca, kind = self.ca, self.kind
        nv, m, P = kind.nv, kind.m, kind.parameters
        sym = ca.SX.sym
        shares = [sym(name, m) for name in ("E", "sigma", "sigma_dot")]
        task = [sym(name, m) for name in ("e", "x_dot", "xd_dot", "xd_ddot", "w", "w_dot")]
        gains = [sym(name, m) for name in ("Lambda", "beta", "K_eps")]
        K_r = sym("K_r", nv if kind.k_r_space == "joint" else m)
        Gamma = sym("Gamma", P)
        e, x_dot, xd_dot, xd_ddot, w, w_dot = (self._array(part, m) for part in task)
        heard = np.array([self._array(part, m) for part in shares])
        errors = Errors(
            None, np.array((e, xd_dot - x_dot)), x_dot, np.array((xd_dot, xd_ddot)), np.array((w, w_dot)),
            heard, Weights(*self._weights()),
        )  # fmt: skip
        asked = self._asked(errors, gains)
        v = self._array(self.v, nv)
        v_ref, a_ref, s_q, feedback = law.compute_joint_command(
            asked, errors, v, self, self._array(K_r, K_r.numel()), kind.k_r_space
        )
        z, model_torque, z_dot = self._adaptive(Gamma, v_ref, a_ref, s_q)
        tau, e_star = model_torque + feedback, asked.e_star
        inputs = [
            self.q, self.v, self.sine, self.cosine, z, *shares, *task, self.J, self.J_dot, self.J_inv,
            self.G, self.weights, *gains, K_r, Gamma, *self.posture, self.base,
        ]  # fmt: skip
        outputs = [self._flat(tau), z_dot, self._flat(e_star), self._flat(s_q)]
        return self._function("control", inputs, outputs)

    def _asked(self, errors: Errors, gains: list) -> Asked:
        """What the law asks of one robot."""
        kind, m = self.kind, self.kind.m
        if kind.law is None:
            Lambda, beta, K_eps = (self._array(part, m) for part in gains)
            return BoundSunMills(Lambda, beta, K_eps, kind.reference_acceleration).command(errors)
        parts = kind.law.command(*(self._back(getattr(errors, name)) for name in ROWS), self.weights)
        return Asked(*(self._array(part, m) for part in parts))

    def to_joints(self, task: Any, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> tuple:
        """v_ref and a_ref, by the formulas of `Inverse` and `Pseudoinverse` in tasks/redundancy.py."""
        kind = self.kind
        if kind.space == "joint":
            return xref_dot, xref_ddot
        J, J_dot, J_inv = self._jacobians()
        if not kind.redundant:
            v_ref = np.matvec(J_inv, xref_dot)
            return v_ref, np.matvec(J_inv, xref_ddot - np.matvec(J_dot, v_ref))
        W_inv, preferred, gain = (self._array(part, kind.nv) for part in self.posture)
        q, v = self._array(self.q, kind.nv), self._array(self.v, kind.nv)
        zeta, zeta_dot = gain * (preferred - q), -gain * v
        gap = xref_dot - np.matvec(J, zeta)
        mu = np.matvec(self._array(self.G, kind.m, kind.m), gap)
        v_ref = zeta + np.matvec(J_inv, gap)
        h = zeta_dot + W_inv * np.matvec(J_dot.T, mu)
        return v_ref, h + np.matvec(J_inv, xref_ddot - np.matvec(J_dot, v_ref) - np.matvec(J, h))

    def to_torque(self, task: Any, force: np.ndarray) -> np.ndarray:
        """J^T f."""
        return force if self.kind.space == "joint" else np.matvec(self._jacobians()[0].T, force)

    def estimate(self) -> Any:
        """z -> theta_hat, of an adaptation whose state is something else."""
        z = self.ca.SX.sym("z", self.kind.learned)
        return self._function("estimate", [z], [self.kind.learning.estimate(z)])  # type: ignore[union-attr]

    def _adaptive(
        self, Gamma: Any, v_ref: np.ndarray, a_ref: np.ndarray, s_q: np.ndarray
    ) -> tuple[Any, np.ndarray, Any]:
        """State z of the adaptation, Y theta_hat, and z'; with (14) z is theta_hat."""
        ca, kind = self.ca, self.kind
        theta_hat, motion = (
            ca.SX.sym("theta_hat", kind.parameters),
            tuple(map(self._back, (v_ref, a_ref, s_q))),
        )
        torque, gradient = self._model(theta_hat, *motion)
        if kind.learning is None:
            return theta_hat, self._array(torque, kind.nv), Gamma * gradient
        z = ca.SX.sym("z", kind.learned)
        torque, gradient = ca.substitute([torque, gradient], [theta_hat], [kind.learning.estimate(z)])
        return z, self._array(torque, kind.nv), kind.learning.rate(z, self.q, self.v, *motion, gradient)

    def _model(self, theta_hat: Any, v_ref: Any, a_ref: Any, s_q: Any) -> tuple[Any, Any]:
        """Y theta_hat, and Y^T s_q as the derivative of s_q^T Y theta_hat with respect to theta_hat."""
        ca, kind = self.ca, self.kind
        rigid = theta_hat[: kind.rigid_parameters]
        pi = rigid if kind.matrix is None else ca.mtimes(ca.SX(kind.matrix), rigid)
        symbols = Symbols(kind.fixed, self.q, self.sine, self.cosine)
        torque = symbols.torque(pi, self.v, v_ref, a_ref, self._gravity())
        if kind.smoothing is not None:
            rubbing = theta_hat[kind.rigid_parameters :]
            v, v_ref, a_ref = (self._array(part, kind.nv) for part in (self.v, v_ref, a_ref))
            diagonals = friction_diagonals(v, v_ref, a_ref, kind.smoothing, kind.rotors)
            torque += self._back(sum(self._array(rubbing, len(diagonals), kind.nv) * np.stack(diagonals)))
        return torque, ca.jtimes(torque, theta_hat, s_q, True)

    # -- the plant ----------------------------------------------------------------------------------------

    def plant(self) -> Any:
        """q, v, sine, cosine, tau, pi, base -> v' = M^-1 (tau - C v - g), through a Cholesky factor of M."""
        ca, nv = self.ca, self.kind.nv
        tau, pi = ca.SX.sym("tau", nv), ca.SX.sym("pi", 10 * nv)
        symbols = Symbols(self.kind.fixed, self.q, self.sine, self.cosine)
        still = ca.SX.zeros(nv)
        bias = symbols.torque(pi, self.v, self.v, still, self._gravity())
        v_dot = _solve_positive(ca, symbols.mass_matrix(pi), tau - bias)
        inputs = [self.q, self.v, self.sine, self.cosine, tau, pi, self.base]
        return self._function("plant", inputs, [v_dot])

    # -- symbols and arrays -------------------------------------------------------------------------------

    def _function(self, name: str, inputs: list, outputs: list) -> Any:
        """A function in which nothing is computed twice."""
        return self.ca.Function(f"{self.name}_{name}", inputs, self.ca.cse(outputs))

    def _base(self) -> tuple[Any, Any]:
        ca, shared = self.ca, self.kind.base_rotation
        rotation = ca.reshape(self.base[:9], 3, 3).T if shared is None else ca.SX(shared)
        return rotation, self.base[9:]

    def _gravity(self) -> Any:
        """Gravity in the frame of the first joint's placement."""
        return self.ca.mtimes(self._base()[0].T, self.ca.SX(self.ca.DM(self.kind.gravity)))

    def _weights(self) -> np.ndarray:
        m = self.kind.m
        return self._array(self.weights, 4, m, m)

    def _jacobians(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        nv, m = self.kind.nv, self.kind.m
        return (
            self._array(self.J, m, nv),
            self._array(self.J_dot, m, nv),
            self._array(self.J_inv, nv, m),
        )

    def _array(self, vector: Any, *shape: int) -> np.ndarray:
        """A column of symbols as an array of single symbols, row by row."""
        array = np.empty(int(np.prod(shape)), dtype=object)
        for k in range(array.size):
            array[k] = vector[k]
        return array.reshape(shape)

    def _matrix(self, A: Any) -> np.ndarray:
        return self._array(self.ca.vec(A.T), *A.shape)

    def _flat(self, array: np.ndarray) -> Any:
        return self.ca.densify(self.ca.vertcat(*array.ravel())) if array.size else self.ca.SX.zeros(0, 1)

    def _back(self, array: np.ndarray) -> Any:
        """An array of symbols as a CasADi vector or matrix."""
        if array.ndim == 1:
            return self.ca.vertcat(*array)
        return self.ca.vertcat(*(self.ca.horzcat(*row) for row in array))


def _solve_positive(ca: Any, M: Any, b: Any) -> Any:
    """M^-1 b for a symmetric positive definite matrix, by M = L D L^T without pivoting."""
    n = M.shape[0]
    L, LD = ca.SX.eye(n), ca.SX.zeros(n, n)
    for j in range(n):
        for i in range(j, n):
            LD[i, j] = M[i, j] - sum(LD[i, k] * L[j, k] for k in range(j))
            L[i, j] = LD[i, j] / LD[j, j]
    x = [b[i] for i in range(n)]
    for i in range(n):
        x[i] -= sum(L[i, k] * x[k] for k in range(i))
    x = [x[i] / LD[i, i] for i in range(n)]
    for i in reversed(range(n)):
        x[i] -= sum(L[k, i] * x[k] for k in range(i + 1, n))
    return ca.vertcat(*x)
