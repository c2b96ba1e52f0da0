"""One robot's share of the closed loop, traced with symbols into three functions.

`measure` finds out where the robot is, `control` is the law, `plant` is its true dynamics. Between the first
two the driver lets the coupling exchange what neighbours need. The law itself is not written again here: the
functions of `control/law.py` run on symbols. Which quantities each function reads and writes, and how long
they are, is said in `quantities.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..control import law
from ..control.commands import REFERENCE_ACCELERATIONS
from ..robots.symbolic import Symbols
from .kind import Kind
from .lawful import TracedLaw
from .learning import Learning
from .quantities import DESIRED, FUNCTIONS, QUANTITIES, columns


class Trace:
    """CasADi functions of one kind of robot.

    Args:
        kind: the kind.
        name: prefix of the generated names.
    """

    def __init__(self, kind: Kind, name: str):
        import casadi as ca

        self.ca, self.kind, self.name = ca, kind, name
        self.given = {key: ca.SX.sym(key, columns(key, kind.sizes)) for key in QUANTITIES}
        self.q, self.v = self.given["q"], self.given["v"]
        self.sine, self.cosine = self.given["sine"], self.given["cosine"]

    def functions(self) -> Iterator[Any]:
        """All that the kind has; those that take long to compile first."""
        yield self.control()
        yield self.plant()
        yield self.measure()
        if self.kind.learning is not None:
            yield self.estimate(self.kind.learning)

    # -- where the robot is -------------------------------------------------------------------------------

    def measure(self) -> Any:
        """Where the robot is, and how it errs."""
        ca = self.ca
        sine, cosine = ca.sin(self.q), ca.cos(self.q)
        x, e, x_dot, xd_dot, xd_ddot, J, J_dot = self._task(sine, cosine)
        J_inv, G = self._inverse(J)
        c, c_dot = self._weights()[:2]
        w = law.weighted_error(c, e)
        w_dot = law.weighted_error_dot(c, c_dot, e, xd_dot - x_dot)
        return self._function(
            "measure",
            x=x, e=e, x_dot=x_dot, xd_dot=xd_dot, xd_ddot=xd_ddot, w=w, w_dot=w_dot,
            sine=sine, cosine=cosine, J=J, J_dot=J_dot, J_inv=J_inv, G=G,
        )  # fmt: skip

    def _task(self, sine: Any, cosine: Any) -> tuple:
        kind, m = self.kind, self.kind.m
        desired = [self.given[name] for name in DESIRED]
        xd, xd_dot, xd_ddot = (self._array(part, m) for part in desired)
        empty = np.empty((0, 0), dtype=object)
        if kind.space == "joint":
            q, v = self._row("q"), self._row("v")
            return q, xd - q, v, xd_dot, xd_ddot, empty, empty
        x, R, J, J_dot = Symbols(kind.fixed, self.q, sine, cosine).tip(self.v, *self._base())
        if kind.space == "pose":
            from .pose import pose_task

            return pose_task(self.ca, self.v, x, R, J, J_dot, self.ca.vertcat(*desired))
        rows = list(kind.rows)
        x, J, J_dot = (self._matrix(part[rows, :]) for part in (x, J, J_dot))
        return x[:, 0], xd - x[:, 0], np.matvec(J, self._row("v")), xd_dot, xd_ddot, J, J_dot

    def _inverse(self, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J^-1, or W^-1 J^T G with G = (J W^-1 J^T)^-1."""
        empty = np.empty((0, 0), dtype=object)
        if self.kind.space == "joint":
            return empty, empty
        if not self.kind.redundant:
            return self._inverted(J), empty
        W_inv_JT = self._row("W_inv")[:, None] * J.T
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
        e_star, r, xref_dot, xref_ddot, force = self._law()
        v_ref, a_ref = self._to_joints(xref_dot, xref_ddot)
        s_q = v_ref - self._row("v")
        model_torque, z_dot = self._adaptive(v_ref, a_ref, s_q)
        tau = model_torque + self._damping(s_q, r) + self._to_torque(force)
        return self._function("control", tau=tau, z_dot=z_dot, e_star=e_star, s_q=s_q)

    def _law(self) -> tuple:
        """The same lines as `Controller.evaluate`, for one robot."""
        c, c_dot, c_ddot, c_inv = self._weights()
        E, sigma, sigma_dot = map(self._row, ("E", "sigma", "sigma_dot"))
        task = "e", "x_dot", "xd_dot", "xd_ddot", "w", "w_dot"
        e, x_dot, xd_dot, xd_ddot, w, w_dot = map(self._row, task)
        if self.kind.law is not None:
            given = [e, xd_dot - x_dot, x_dot, xd_dot, xd_ddot, w, w_dot, E, sigma, sigma_dot]
            return self._other_law(self.kind.law, given)
        Lambda, beta, K_eps = map(self._row, ("Lambda", "beta", "K_eps"))
        e_star = law.coupled_error(w, E, beta)
        u = law.command(c, c_dot, xd_dot, e, sigma, e_star, beta, Lambda)
        u_dot = law.command_dot(
            c, c_dot, c_ddot, xd_dot, xd_ddot, e, xd_dot - x_dot, w_dot, sigma, sigma_dot, beta, Lambda
        )
        r = law.coupled_velocity_error(u, c, x_dot)
        xref_dot = law.reference_velocity(c_inv, u)
        acceleration = REFERENCE_ACCELERATIONS[self.kind.reference_acceleration]
        xref_ddot = acceleration(c_inv, c_dot, u_dot, xref_dot, x_dot)
        return e_star, r, xref_dot, xref_ddot, law.synchronizing_force(c, sigma, K_eps)

    def _other_law(self, other: TracedLaw, given: list) -> tuple:
        """e*, r, xref', xref'' and force of a law that was traced."""
        asked = other.command(*map(self._back, given), self.given["weights"])
        xref_dot, xref_ddot, force, e_star, u = (self._array(part, self.kind.m) for part in asked)
        r = law.coupled_velocity_error(u, self._weights()[0], given[2])
        return e_star, r, xref_dot, xref_ddot, force

    def _to_joints(self, xref_dot: np.ndarray, xref_ddot: np.ndarray) -> tuple:
        """v_ref and a_ref, by the formulas of `Inverse` and `Pseudoinverse` in tasks/redundancy.py."""
        kind = self.kind
        if kind.space == "joint":
            return xref_dot, xref_ddot
        J, J_dot, J_inv = self._jacobians()
        if not kind.redundant:
            v_ref = np.matvec(J_inv, xref_dot)
            return v_ref, np.matvec(J_inv, xref_ddot - np.matvec(J_dot, v_ref))
        W_inv, preferred, gain, q, v = map(self._row, ("W_inv", "posture", "gain", "q", "v"))
        zeta, zeta_dot = gain * (preferred - q), -gain * v
        gap = xref_dot - np.matvec(J, zeta)
        mu = np.matvec(self._array(self.given["G"], kind.m, kind.m), gap)
        v_ref = zeta + np.matvec(J_inv, gap)
        h = zeta_dot + W_inv * law.transposed_times(J_dot, mu)
        return v_ref, h + np.matvec(J_inv, xref_ddot - np.matvec(J_dot, v_ref) - np.matvec(J, h))

    def _damping(self, s_q: np.ndarray, r: np.ndarray) -> np.ndarray:
        gain = self._row("K_r")
        if self.kind.k_r_space == "joint":
            return gain * s_q
        return self._to_torque(gain * law.times(self._weights()[3], r))

    def _to_torque(self, force: np.ndarray) -> np.ndarray:
        return force if self.kind.space == "joint" else law.transposed_times(self._jacobians()[0], force)

    def estimate(self, learning: Learning) -> Any:
        """z -> theta_hat, of an adaptation whose state is something else."""
        return self._function("estimate", theta_hat=learning.estimate(self.given["z"]))

    def _adaptive(self, v_ref: np.ndarray, a_ref: np.ndarray, s_q: np.ndarray) -> tuple[np.ndarray, Any]:
        """Y theta_hat, and z' of the adaptation; with (14) its state z is theta_hat."""
        learning, z = self.kind.learning, self.given["z"]
        motion = tuple(map(self._back, (v_ref, a_ref, s_q)))
        if learning is None:
            torque, gradient = self._model(z, *motion)
            Gamma: Any = self.given["Gamma"]
            return self._array(torque, self.kind.nv), law.adaptation(gradient, Gamma)
        theta_hat = self.given["theta_hat"]
        parts = self.ca.substitute([*self._model(theta_hat, *motion)], [theta_hat], [learning.estimate(z)])
        return self._array(parts[0], self.kind.nv), learning.rate(z, self.q, self.v, *motion, parts[1])

    def _model(self, theta_hat: Any, v_ref: Any, a_ref: Any, s_q: Any) -> tuple[Any, Any]:
        """Y theta_hat, and Y^T s_q as the derivative of s_q^T Y theta_hat with respect to theta_hat."""
        ca, kind = self.ca, self.kind
        rigid = theta_hat[: kind.rigid_parameters]
        pi = rigid if kind.matrix is None else ca.mtimes(ca.SX(kind.matrix), rigid)
        symbols = Symbols(kind.fixed, self.q, self.sine, self.cosine)
        torque = symbols.torque(pi, self.v, v_ref, a_ref, self._gravity())
        if kind.smoothing is not None:
            columns = [v_ref, ca.tanh(self.v / kind.smoothing), *([a_ref] if kind.rotors else [])]
            rubbing = theta_hat[kind.rigid_parameters :]
            torque += sum(rubbing[k * kind.nv : (k + 1) * kind.nv] * c for k, c in enumerate(columns))
        return torque, ca.jtimes(torque, theta_hat, s_q, True)

    # -- the plant ----------------------------------------------------------------------------------------

    def plant(self) -> Any:
        """v' = M^-1 (tau - C v - g), through a Cholesky factor of M."""
        ca, pi = self.ca, self.given["pi"]
        symbols = Symbols(self.kind.fixed, self.q, self.sine, self.cosine)
        still = ca.SX.zeros(self.kind.nv)
        bias = symbols.torque(pi, self.v, self.v, still, self._gravity())
        v_dot = _solve_positive(ca, symbols.mass_matrix(pi), self.given["moving"] - bias)
        return self._function("plant", v_dot=v_dot)

    # -- symbols and arrays -------------------------------------------------------------------------------

    def _function(self, name: str, **computed: Any) -> Any:
        """A function of the table, in which nothing is computed twice."""
        inputs, outputs = FUNCTIONS[name]
        given = [self.given[key] for key in inputs]
        results = self.ca.cse([self._flat(computed[key]) for key in outputs])
        return self.ca.Function(f"{self.name}_{name}", given, results, [*inputs], [*outputs])

    def _base(self) -> tuple[Any, Any]:
        ca, shared = self.ca, self.kind.base_rotation
        base = self.given["base"]
        rotation = ca.reshape(base[:9], 3, 3).T if shared is None else ca.SX(shared)
        return rotation, base[9:]

    def _gravity(self) -> Any:
        """Gravity in the frame of the first joint's placement."""
        return self.ca.mtimes(self._base()[0].T, self.ca.SX(self.ca.DM(self.kind.gravity)))

    def _weights(self) -> np.ndarray:
        m = self.kind.m
        return self._array(self.given["weights"], 4, m, m)

    def _jacobians(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        nv, m, given = self.kind.nv, self.kind.m, self.given
        shapes = {"J": (m, nv), "J_dot": (m, nv), "J_inv": (nv, m)}
        J, J_dot, J_inv = (self._array(given[name], *shape) for name, shape in shapes.items())
        return J, J_dot, J_inv

    def _row(self, name: str) -> np.ndarray:
        """A quantity as an array of single symbols."""
        return self._array(self.given[name], self.given[name].numel())

    def _array(self, vector: Any, *shape: int) -> np.ndarray:
        """A column of symbols as an array of single symbols, row by row."""
        array = np.empty(int(np.prod(shape)), dtype=object)
        for k in range(array.size):
            array[k] = vector[k]
        return array.reshape(shape)

    def _matrix(self, A: Any) -> np.ndarray:
        return self._array(self.ca.vec(A.T), *A.shape)

    def _flat(self, array: Any) -> Any:
        """An array of symbols, or a CasADi column, as a dense column, row by row."""
        if not isinstance(array, np.ndarray):
            return self.ca.densify(array)
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
