"""The controller of a cell: wires robots, task space, coupling and law together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import choice
from ..tasks.cell import Cell, Reference
from ..tasks.spaces import Measurement
from . import law
from .gains import Gains, spread

REFERENCE_ACCELERATIONS = {
    "exact": law.reference_acceleration_exact,
    "paper": law.reference_acceleration_paper,
}


@dataclass(slots=True)
class Signals:
    """Everything one evaluation of the controller computed, under its name.

    Task-space rows are (n, m), rows per pair (p, m), joint-space rows (n, nv), parameters (n, P).
    """

    reference: Reference
    task: Measurement
    e: np.ndarray
    e_dot: np.ndarray
    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    E: np.ndarray
    sigma: np.ndarray
    e_star: np.ndarray
    u: np.ndarray
    u_dot: np.ndarray
    r: np.ndarray
    v_ref: np.ndarray
    a_ref: np.ndarray
    s_q: np.ndarray
    Y: np.ndarray
    tau: np.ndarray
    theta_hat_dot: np.ndarray


class Controller:
    """Adaptive synchronized control of a cell, eqs. (7)-(14) and (28)-(32).

    Its state is theta_hat, (n, P), and the integrals of the synchronization errors, (p, m).

    Args:
        cell: the robots and their task.
        gains: the gains.
        reference_acceleration: "exact", the derivative of xref', or "paper", as (13) prints it.
        k_r_space: "joint" for damping K_r s_q, or "task" for J^T K_r c^-1 r.

    Raises:
        InputError: gains of the wrong size, or an unknown option.
    """

    def __init__(
        self, cell: Cell, gains: Gains, *, reference_acceleration: str = "exact", k_r_space: str = "joint"
    ):
        n, m, nv = cell.n, cell.m, cell.nv
        self.cell = cell
        self.gains = gains
        self.reference_acceleration = choice(
            "reference_acceleration", reference_acceleration, tuple(REFERENCE_ACCELERATIONS)
        )
        self.k_r_space = choice("k_r_space", k_r_space, ("joint", "task"))
        self.Lambda = spread("Lambda", gains.Lambda, (m,))
        self.beta = spread("beta", gains.beta, (m,))
        self.K_eps = spread("K_eps", gains.K_eps, (m,))
        self.K_r = spread("K_r", gains.K_r, (n, nv if k_r_space == "joint" else m))
        self.Gamma = spread("Gamma", gains.Gamma, cell.theta.shape)
        self._reference_acceleration = REFERENCE_ACCELERATIONS[reference_acceleration]
        self._damping = self._joint_damping if k_r_space == "joint" else self._task_damping
        self._Y = np.zeros((n, nv, cell.theta.shape[1]))
        self._regressors = [
            (parameters.regressor, self._Y[i, : robot.nv, : len(parameters.theta)], robot.nv)
            for i, (robot, parameters) in enumerate(zip(cell.robots, cell.parameters, strict=True))
        ]

    def evaluate(
        self, reference: Reference, q: np.ndarray, v: np.ndarray, theta_hat: np.ndarray, integral: np.ndarray
    ) -> Signals:
        """The law at one instant.

        Args:
            reference: desired motion and weights.
            q, v: joint positions and velocities, (n, nv).
            theta_hat: estimates, (n, P).
            integral: integrals of the synchronization errors, (p, m).
        """
        c, c_dot, c_ddot, c_inv = reference[3:]
        Lambda, beta = self.Lambda, self.beta
        task = self.cell.task.measure(q, v, *reference[:3])
        e, x_dot, xd_dot, xd_ddot = task[1:5]
        e_dot = xd_dot - x_dot

        w = law.weighted_error(c, e)
        w_dot = law.weighted_error_dot(c, c_dot, e, e_dot)
        epsilon, epsilon_dot, E, sigma, sigma_dot = self._couple(w, w_dot, integral)

        e_star = law.coupled_error(w, E, beta)
        u = law.command(c, c_dot, xd_dot, e, sigma, e_star, beta, Lambda)
        u_dot = law.command_dot(
            c, c_dot, c_ddot, xd_dot, xd_ddot, e, e_dot, w_dot, sigma, sigma_dot, beta, Lambda
        )
        r = law.coupled_velocity_error(u, c, x_dot)
        xref_dot = law.reference_velocity(c_inv, u)
        xref_ddot = self._reference_acceleration(c_inv, c_dot, u_dot, xref_dot, x_dot)

        v_ref, a_ref = self.cell.task.to_joints(task, xref_dot, xref_ddot)
        s_q = v_ref - v
        Y = self._regressor(q, v, v_ref, a_ref)
        damping = self._damping(task, s_q, c_inv, r)
        coupling_torque = self.cell.task.to_torque(task, law.synchronizing_force(c, sigma, self.K_eps))
        tau = law.torque(Y, theta_hat, damping, coupling_torque)
        theta_hat_dot = law.adaptation(Y, s_q, self.Gamma)
        return Signals(
            reference, task, e, e_dot, epsilon, epsilon_dot, E, sigma, e_star, u, u_dot, r,
            v_ref, a_ref, s_q, Y, tau, theta_hat_dot,
        )  # fmt: skip

    def _couple(self, w: np.ndarray, w_dot: np.ndarray, integral: np.ndarray) -> list[np.ndarray]:
        """epsilon and epsilon' per pair; E, sigma and sigma' per robot."""
        m = self.cell.m
        compared = self.cell.coupling.compare(np.concatenate((w, w_dot), axis=1))
        shares = self.cell.coupling.distribute(np.concatenate((integral, compared), axis=1))
        return [
            compared[:, :m],
            compared[:, m:],
            shares[:, :m],
            shares[:, m : 2 * m],
            shares[:, 2 * m :],
        ]

    def _regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        for i, (regressor, Y, nv) in enumerate(self._regressors):
            Y[:] = regressor(q[i, :nv], v[i, :nv], v_ref[i, :nv], a_ref[i, :nv])
        return self._Y.copy()

    def _joint_damping(
        self, task: Measurement, s_q: np.ndarray, c_inv: np.ndarray, r: np.ndarray
    ) -> np.ndarray:
        return self.K_r * s_q

    def _task_damping(
        self, task: Measurement, s_q: np.ndarray, c_inv: np.ndarray, r: np.ndarray
    ) -> np.ndarray:
        return self.cell.task.to_torque(task, self.K_r * law.times(c_inv, r))
