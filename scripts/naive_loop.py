"""The closed loop as one would first write it: robot after robot, matrix after matrix, for the benchmark.

Same law, same robots, same integrator as the engines, written straight from the formulas with Pinocchio's
Python calls and numpy, without any thought for speed. A test holds it to the trajectories of the engines.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from synctrl import CartesianSpace, Experiment


class NaiveLoop:
    """y' of a cell with constant weights, in joint space or in Cartesian positions."""

    def __init__(self, experiment: Experiment):
        self.experiment, self.cell = experiment, experiment.cell
        self.S = self.cell.coupling.matrix
        self.c = self.cell.coupling.weights(np.zeros(1), self.cell.m).c[0]
        self.cartesian = isinstance(self.cell.space, CartesianSpace)
        self.weightless = []
        for robot in self.cell.robots:
            model = pin.Model(robot.model)
            model.gravity.setZero()
            self.weightless.append((model, model.createData()))
        self.data = [robot.model.createData() for robot in self.cell.robots]

    def initial_state(self):
        cell = self.cell
        return [cell.q0, cell.v0, cell.theta_hat0, np.zeros((cell.coupling.pairs, cell.m))]

    def measure(self, i, q, v):
        """x, x', J and J' of one robot."""
        robot = self.cell.robots[i]
        if not self.cartesian:
            return q, v, np.eye(robot.nv), np.zeros((robot.nv, robot.nv))
        model, data, rows = robot.model, self.data[i], self.cell.space.rows
        pin.forwardKinematics(model, data, q, v)
        pin.updateFramePlacements(model, data)
        pin.computeJointJacobians(model, data, q)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        frame, axes = robot.tip_id, pin.LOCAL_WORLD_ALIGNED
        J = pin.getFrameJacobian(model, data, frame, axes)[rows]
        J_dot = pin.getFrameJacobianTimeVariation(model, data, frame, axes)[rows]
        return data.oMf[frame].translation[rows], J @ v, J, J_dot

    def regressor(self, i, q, v, v_ref, a_ref):
        """Slotine-Li regressor from two ordinary ones."""
        model = self.cell.robots[i].model
        still, data = self.weightless[i]
        Y = pin.computeJointTorqueRegressor(model, self.data[i], q, (v + v_ref) / 2, a_ref)
        Y = Y - pin.computeJointTorqueRegressor(still, data, q, (v - v_ref) / 2, np.zeros(len(q)))
        matrix = getattr(self.cell.parameters[i], "matrix", None)
        return Y if matrix is None else Y @ matrix

    def state_dot(self, t, y, disturbance):
        """y' for y = [q, v, theta_hat, integrals]."""
        cell, S, c = self.cell, self.S, self.c
        gains = self.experiment.gains
        Lambda, beta, K_eps = (
            np.diag(np.broadcast_to(g, cell.m)) for g in (gains.Lambda, gains.beta, gains.K_eps)
        )
        K_r = np.diag(np.broadcast_to(gains.K_r, cell.nv))
        q, v, theta_hat, integral = y
        desired = [member.trajectory(t) for member in cell.members]
        measured = [self.measure(i, q[i], v[i]) for i in range(cell.n)]
        e = [d.x - measured[i][0] for i, d in enumerate(desired)]
        e_dot = [d.x_dot - measured[i][1] for i, d in enumerate(desired)]
        epsilon = np.array([sum(row[i] * c[i] @ e[i] for i in range(cell.n)) for row in S])
        epsilon_dot = np.array([sum(row[i] * c[i] @ e_dot[i] for i in range(cell.n)) for row in S])
        v_dot, theta_hat_dot = np.zeros_like(v), np.zeros_like(theta_hat)
        for i, d in enumerate(desired):
            J, J_dot = measured[i][2:]
            sigma, sigma_dot = S[:, i] @ epsilon, S[:, i] @ epsilon_dot
            e_star = c[i] @ e[i] + beta @ (S[:, i] @ integral)
            u = c[i] @ d.x_dot + beta @ sigma + Lambda @ e_star
            u_dot = c[i] @ d.x_ddot + beta @ sigma_dot + Lambda @ (c[i] @ e_dot[i] + beta @ sigma)
            v_ref = np.linalg.solve(J, np.linalg.solve(c[i], u))
            a_ref = np.linalg.solve(J, np.linalg.solve(c[i], u_dot) - J_dot @ v_ref)
            s_q = v_ref - v[i]
            Y = self.regressor(i, q[i], v[i], v_ref, a_ref)
            tau = Y @ theta_hat[i] + K_r @ s_q + J.T @ c[i].T @ K_eps @ sigma
            theta_hat_dot[i] = gains.Gamma * (Y.T @ s_q)
            load = tau - cell.members[i].friction.torque(v[i]) + disturbance[i]
            v_dot[i] = pin.aba(cell.robots[i].model, self.data[i], q[i], v[i], load)
        return [v, v_dot, theta_hat_dot, epsilon]

    def run(self, steps, dt):
        """Joint positions at every step of the classical Runge-Kutta method, (steps + 1, n, nv)."""
        y, still = self.initial_state(), np.zeros((self.cell.n, self.cell.nv))
        log = [y[0].copy()]
        for k in range(steps):
            t = k * dt
            k1 = self.state_dot(t, y, still)
            k2 = self.state_dot(t + dt / 2, [a + dt / 2 * b for a, b in zip(y, k1, strict=True)], still)
            k3 = self.state_dot(t + dt / 2, [a + dt / 2 * b for a, b in zip(y, k2, strict=True)], still)
            k4 = self.state_dot(t + dt, [a + dt * b for a, b in zip(y, k3, strict=True)], still)
            y = [
                a + dt / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True)
            ]
            log.append(y[0].copy())
        return np.array(log)


class BareCalls:
    """The Pinocchio calls that the law needs, and nothing else: what a closed loop cannot be cheaper than."""

    def __init__(self, experiment: Experiment):
        self.cell = cell = experiment.cell
        self.cartesian = isinstance(cell.space, CartesianSpace)
        self.robots = []
        for i, robot in enumerate(cell.robots):
            still = pin.Model(robot.model)
            still.gravity.setZero()
            q, v = cell.q0[i, : robot.nv].copy(), np.full(robot.nv, 0.1)
            self.robots.append(
                (robot.model, robot.model.createData(), still, still.createData(), robot.tip_id, q, v)
            )

    def run(self, steps):
        """The calls of `steps` Runge-Kutta steps."""
        axes = pin.LOCAL_WORLD_ALIGNED
        for _ in range(4 * steps):
            for model, data, still, still_data, frame, q, v in self.robots:
                if self.cartesian:
                    pin.computeJointJacobiansTimeVariation(model, data, q, v)
                    pin.updateFramePlacement(model, data, frame)
                    pin.getFrameJacobian(model, data, frame, axes)
                    pin.getFrameJacobianTimeVariation(model, data, frame, axes)
                pin.computeJointTorqueRegressor(model, data, q, v, v)
                pin.computeJointTorqueRegressor(still, still_data, q, v, v)
                pin.aba(model, data, q, v, v)
