"""The four planar arms once more, from the paper's formulas alone: a second opinion in plain numpy.

Nothing here comes from the toolkit. Every line follows section V-B: geometry of a two-link arm, theta (50),
the regression matrix Y as printed with its z_1 and z_2, Tables II and III (robots 1 and 4 on the circle of
radius R, as the text has it), the ring (46)-(48), the law (28)-(32) with its adaptation (14), and an own
Runge-Kutta step.

The paper's Y belongs to joint torques; k_r and k_epsilon act in joint coordinates, the latter through J^T, as
the units printed for them say.

Several scenarios run side by side: arrays are (scenario, robot, ...).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

R, D = 5.0, 1.0
LENGTH, MASS = 0.3, 1.0
LAMBDA, BETA, K_R, K_EPSILON, GAMMA = 10.0, 100.0, 1.0, 1.0, 0.1
C = np.array([[R + D], [-R], [R], [-(R + D)]])
Q_START = np.pi * np.array([[2 / 3, -1 / 6], [2 / 3, -1 / 6], [2 / 3, -1 / 3], [2 / 3, -1 / 3]])
PUSH_START, PUSH_STOP = 0.5, 0.75  # s
NEXT, PREVIOUS = [1, 2, 3, 0], [3, 0, 1, 2]


def theta(m1: float, l1: float, m2: float, l2: float) -> np.ndarray:
    """Equation (50)."""
    return np.array([m1 * l1**2 / 3 + m2 * l1**2, m2 * l2**2 / 3, m2 * l1 * l2 / 2])


def printed_regressor(z1: np.ndarray, z2: np.ndarray, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Y as printed below (50), (..., 2, 3)."""
    sin, cos = np.sin(q[..., 1]), np.cos(q[..., 1])
    a1, a2, b1, b2 = z1[..., 0], z1[..., 1], z2[..., 0], z2[..., 1]
    dq1, dq2 = dq[..., 0], dq[..., 1]
    Y = np.zeros((*q.shape[:-1], 2, 3))
    Y[..., 0, 0] = a1
    Y[..., 0, 1] = a1 + a2
    Y[..., 0, 2] = 2 * a1 * cos + a2 * cos - dq2 * b1 * sin - (dq1 + dq2) * b2 * sin
    Y[..., 1, 1] = a1 + a2
    Y[..., 1, 2] = a1 * cos + dq1 * b1 * sin
    return Y


def tip(q: np.ndarray) -> np.ndarray:
    """Position of the end of the second link from the base, (..., 2)."""
    first, second = q[..., 0], q[..., 0] + q[..., 1]
    return LENGTH * np.stack([np.cos(first) + np.cos(second), np.sin(first) + np.sin(second)], axis=-1)


def jacobian(q: np.ndarray) -> np.ndarray:
    """d tip / d q, (..., 2, 2)."""
    first, second = q[..., 0], q[..., 0] + q[..., 1]
    s1, s12, c1, c12 = np.sin(first), np.sin(second), np.cos(first), np.cos(second)
    return LENGTH * matrix(-s1 - s12, -s12, c1 + c12, c12)


def jacobian_rate(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """d/dt of the Jacobian, (..., 2, 2)."""
    first, second = q[..., 0], q[..., 0] + q[..., 1]
    w1, w12 = dq[..., 0], dq[..., 0] + dq[..., 1]
    s1, s12, c1, c12 = w1 * np.sin(first), w12 * np.sin(second), w1 * np.cos(first), w12 * np.cos(second)
    return LENGTH * matrix(-c1 - c12, -c12, -s1 - s12, -s12)


def mass_matrix(q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """H(q) of the arm with the parameters p of (50), (..., 2, 2)."""
    cos = np.cos(q[..., 1])
    off = p[1] + p[2] * cos
    return matrix(p[0] + p[1] + 2 * p[2] * cos, off, off, p[1] + 0 * cos)


def coriolis_torque(q: np.ndarray, dq: np.ndarray, p: np.ndarray) -> np.ndarray:
    """C(q, q') q', (..., 2)."""
    h = p[2] * np.sin(q[..., 1])
    dq1, dq2 = dq[..., 0], dq[..., 1]
    return np.stack([-h * (2 * dq1 * dq2 + dq2**2), h * dq1**2], axis=-1)


def desired_ends(phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Initial and final positions of Table II, with the radii of (46) and (47), each (4, 2)."""
    radius = np.array([R, R + D, R + D, R])
    first = np.array([-phi, -phi, phi, phi])
    last = np.array([-(phi - 0.02), -(phi - 0.02), phi + 0.02, phi + 0.02])

    def on_circle(angle: np.ndarray) -> np.ndarray:
        return radius[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=1)

    return on_circle(first), on_circle(last)


@dataclass(frozen=True)
class Scenario:
    """Synchronized control, or beta = k_epsilon = 0; robot 1 pushed with 1 N·m on both joints, or not."""

    synchronized: bool
    pushed: bool


class FourArms:
    """The cell of section V-B in several scenarios at once."""

    def __init__(self, scenarios: Sequence[Scenario], phi: float = 0.1):
        self.start, self.end = desired_ends(phi)
        self.base = self.start - tip(Q_START)
        self.theta = theta(MASS, LENGTH, MASS, LENGTH)
        on = np.array([float(s.synchronized) for s in scenarios])[:, None, None]
        self.beta, self.k_epsilon = BETA * on, K_EPSILON * on
        self.push = np.zeros((len(scenarios), 4, 2))
        self.push[:, 0] = np.array([[float(s.pushed)] for s in scenarios])

    def initial_state(self) -> np.ndarray:
        """Per robot q (2), q' (2), theta_hat (3), integral of epsilon (2): (scenario, 4, 9)."""
        guess = np.tile(theta(0.8, 0.2, 0.8, 0.2), (4, 1))
        state = np.hstack([Q_START, np.zeros((4, 2)), guess, np.zeros((4, 2))])
        return np.tile(state, (len(self.push), 1, 1))

    def desired(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Desired position, velocity, acceleration, each (4, 2)."""
        way, left = self.end - self.start, np.exp(-t)
        return self.start + way * (1 - left), way * left, -way * left

    def control(self, t: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """tau of (32), theta_hat' of (14), epsilon of (28)."""
        q, dq, theta_hat, integral = np.split(state, [2, 4, 7], axis=-1)
        J, dJ = jacobian(q), jacobian_rate(q, dq)
        J_inv = inverse(J)
        x, dx = self.base + tip(q), times(J, dq)
        xd, dxd, ddxd = self.desired(t)
        e, de = xd - x, dxd - dx
        epsilon, d_epsilon = ring(C * e), ring(C * de)
        # every robot takes part in two errors: the one of its own number and the one before
        share, d_share = epsilon + epsilon[:, PREVIOUS], d_epsilon + d_epsilon[:, PREVIOUS]
        e_star = C * e + self.beta * (integral + integral[:, PREVIOUS])
        de_star = C * de + self.beta * share
        u = C * dxd + self.beta * share + LAMBDA * e_star
        du = C * ddxd + self.beta * d_share + LAMBDA * de_star
        z2 = times(J_inv, u / C)
        z1 = times(J_inv, du / C - times(dJ, z2))
        Y = printed_regressor(z1, z2, q, dq)
        s = times(J_inv, (u - C * dx) / C)
        force = C * self.k_epsilon * share
        tau = times(Y, theta_hat) + K_R * s + times(transposed(J), force)
        return tau, GAMMA * times(transposed(Y), s), epsilon

    def rate(self, t: float, state: np.ndarray, push: np.ndarray) -> np.ndarray:
        """d/dt of the state."""
        q, dq = state[..., :2], state[..., 2:4]
        tau, dtheta, epsilon = self.control(t, state)
        right = tau + push - coriolis_torque(q, dq, self.theta)
        ddq = times(inverse(mass_matrix(q, self.theta)), right)
        return np.concatenate([dq, ddq, dtheta, epsilon], axis=-1)

    def run(self, duration: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Times, (T,), and states, (T, scenario, 4, 9), by Kutta's classical step."""
        steps = round(duration / dt)
        t, states = dt * np.arange(steps + 1), [self.initial_state()]
        for k in range(steps):
            y = states[-1]
            push = self.push if PUSH_START < t[k] + dt / 2 < PUSH_STOP else 0 * self.push
            a = self.rate(t[k], y, push)
            b = self.rate(t[k] + dt / 2, y + dt / 2 * a, push)
            c = self.rate(t[k] + dt / 2, y + dt / 2 * b, push)
            d = self.rate(t[k] + dt, y + dt * c, push)
            states.append(y + dt / 6 * (a + 2 * b + 2 * c + d))
        return t, np.array(states)


def ring(w: np.ndarray) -> np.ndarray:
    """w_1 + w_2, w_2 + w_3, w_3 + w_4, w_4 + w_1, as (48)."""
    return w + w[:, NEXT]


def matrix(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """[[a, b], [c, d]], (..., 2, 2)."""
    return np.stack([a, b, c, d], axis=-1).reshape(*a.shape, 2, 2)


def inverse(A: np.ndarray) -> np.ndarray:
    """A^-1 of 2 x 2 matrices."""
    a, b, c, d = A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1]
    return matrix(d, -b, -c, a) / (a * d - b * c)[..., None, None]


def transposed(A: np.ndarray) -> np.ndarray:
    """A^T."""
    return A.swapaxes(-1, -2)


def times(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A x."""
    return (A @ x[..., None])[..., 0]
