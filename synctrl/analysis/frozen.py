"""The frozen cell: linear equations of small errors, with all that depends on the place held as it is there.

With y = q^d - q of all robots, w = T y and T = c J, the parameters known and a leak l,

    E = D W + A W^,   sigma = D w + A w^,   sigma' = D w' + A w'^,   W' = w - l W,
    s = y' + Z y + P (beta (sigma - l E) + Lambda (w + beta E)),
    y'' = -a - M^-1 (B s + T^T K_eps sigma),
    a   = Z y' + P (beta (sigma' - l (sigma - l E)) + Lambda (w' + beta (sigma - l E))),

where hats are what a robot has received, D and A are the diagonal of S^T S and the rest of it, P = J^-1 c^-1
is the way to the joints, Z that of the joints which the task leaves free, and B the damping. Friction, and
what the desired motion does meanwhile, are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance
from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws.sun_mills import delay_damping
from ..coupling.cell import Cell


@dataclass(frozen=True)
class Frozen:
    """x' = own x + heard h, where h is what robots have received and sent x what they send.

    Both have three rows per coordinate and robot, W, w and w', each (N,) with N = n m. The state begins with
    W, y and y', after which a chain of sensors and actuators may have states of its own.

    Attributes:
        own, heard, sent: (X, X), (X, 3 N) and (3 N, X).
        leak: (N,), 1/s.
        horizon: 1/(beta a), beyond which nobody should extrapolate, s.
        joints: number of joints of every robot, (n,).
        least_eigenvalue: of K_r - a/(4 Lambda) J^T c^T K_eps c J of every robot, (n,), where K_r acts.
        proved: whether the theorem tolerates every constant delay here.
    """

    own: np.ndarray
    heard: np.ndarray
    sent: np.ndarray
    leak: np.ndarray
    horizon: float
    joints: tuple[int, ...]
    least_eigenvalue: np.ndarray
    proved: bool

    @property
    def delayed(self) -> np.ndarray:
        """A_1 of x' = A_0 x + A_1 x(t - d), in which A_0 is `own`, (X, X)."""
        return self.heard @ self.sent

    @cached_property
    def still(self) -> int:
        """How many roots stay at 0, whatever the delay is: what nobody sees."""
        return len(self.own) - int(np.linalg.matrix_rank(self.own + self.delayed))

    def place(self, x: np.ndarray) -> tuple[int, int]:
        """Robot and joint, counted from 0, that move most in a mode x, (X,)."""
        N = self.leak.size
        moved = np.abs(x[N : N + sum(self.joints)])
        ends = np.cumsum(self.joints)
        k = int(np.argmax(moved))
        robot = int(np.searchsorted(ends, k, side="right"))
        return robot, k - int(ends[robot] - self.joints[robot])


@dataclass(frozen=True)
class Arm:
    """What is held of one robot: T, (m, nv), P, (nv, m), Z, M^-1 B and M^-1 T^T K_eps, (nv, ...)."""

    T: np.ndarray
    P: np.ndarray
    Z: np.ndarray
    damped: np.ndarray
    pulled: np.ndarray
    least_eigenvalue: float


def freeze(
    cell: Cell,
    gains: Gains,
    *,
    q: ArrayLike | None = None,
    t: float = 0.0,
    k_r_space: str | None = None,
) -> Frozen:
    """The cell under the paper's law, frozen at one place.

    Args:
        cell, gains, q, t, k_r_space: see `delay_margin`.

    Raises:
        InputError: gains or positions of the wrong size, or an unknown word.
    """
    instance("gains", gains, Gains, "Gains")
    controller = Controller(cell, gains.replace(Gamma=0.0), k_r_space=k_r_space)
    place = cell.q0 if q is None else finite_array("q", q, (cell.n, cell.nv))
    return frozen_with_slips(controller, place, finite_number("t", t))[0]


def frozen_with_slips(controller: Controller, q: np.ndarray, t: float) -> tuple[Frozen, np.ndarray]:
    """The frozen cell of a controller at q, (n, nv), and s_q = s x where nothing is delayed, s of (J, X)."""
    cell, S = controller.cell, controller.cell.coupling.matrix
    L = S.T @ S
    arms = _arms(controller, q, t)
    own, heard, sent = _matrices(controller, arms, L)
    least = np.array([arm.least_eigenvalue for arm in arms])
    joints = tuple(robot.nv for robot in cell.robots)
    leak = np.tile(controller.leak, cell.n)
    fastest = float(controller.beta.max() * L.diagonal().max())
    horizon = 1 / fastest if fastest else np.inf
    frozen = Frozen(own, heard, sent, leak, horizon, joints, least, _proved(controller, least, L))
    return frozen, _slips(controller, arms, np.kron(np.eye(3), np.kron(L, np.eye(cell.m))) @ sent)


def _slips(controller: Controller, arms: Sequence[Arm], shares: np.ndarray) -> np.ndarray:
    """Rows of s_q, (J, X), where (E, sigma, sigma') = shares x."""
    from scipy.linalg import block_diag

    n, N = controller.cell.n, controller.cell.n * controller.cell.m
    T, P, Z = (block_diag(*(getattr(arm, name) for arm in arms)) for name in ("T", "P", "Z"))
    Lambda, beta, leak = (np.tile(g, n) for g in (controller.Lambda, controller.beta, controller.leak))
    J = T.shape[1]
    s = P * (beta * (Lambda - leak)) @ shares[:N] + P * beta @ shares[N : 2 * N]
    s[:, N : N + J] += Z + P * Lambda @ T
    s[:, N + J :] += np.eye(J)
    return s


def _proved(controller: Controller, least: np.ndarray, L: np.ndarray) -> bool:
    """Whether every constant delay is tolerated: no leak, D - A >= 0, and damping that outweighs K_eps."""
    slack = np.linalg.eigvalsh(2 * np.diag(L.diagonal()) - L)[0]
    return bool(not controller.leak.any() and slack > -1e-12 * L.max() and least.min() > 0)


def _arms(controller: Controller, q: np.ndarray, t: float) -> list[Arm]:
    """All robots at q, (n, nv), with the weights of an instant."""
    cell = controller.cell
    reference = cell.references(np.array([t]))[0]
    task = cell.task.measure(np.stack((q, np.zeros_like(q))), reference.desired)
    still = np.zeros((cell.n, cell.m))
    towards = [cell.task.to_joints(task, still + row, still)[0] for row in np.eye(cell.m)]
    free = cell.task.to_joints(task, still, still)[0]
    P = np.stack(towards, axis=-1) - free[..., None]  # (n, nv, m)
    redundancy = getattr(cell.space, "redundancy", None)
    gain = np.zeros_like(cell.q0) if redundancy is None else redundancy.spread(cell.robots)[2]
    arms = []
    for i, robot in enumerate(cell.robots):
        k, c, c_inv = robot.nv, reference.c[i], reference.c_inv[i]
        J = np.eye(cell.m) if task.J is None else task.J[i, :, :k]
        M = robot.mass_matrix(q[i, :k])
        Z = gain[i, :k, None] * (np.eye(k) - P[i, :k] @ J)
        arms.append(_arm(controller, i, M, c @ J, P[i, :k] @ c_inv, Z, J))
    return arms


def _arm(
    controller: Controller,
    i: int,
    M: np.ndarray,
    T: np.ndarray,
    P: np.ndarray,
    Z: np.ndarray,
    J: np.ndarray,
) -> Arm:
    """One robot, with damping that acts in its joints or in its task."""
    in_joints = controller.k_r_space == "joint"
    K_r, K_eps = controller.K_r[i, : T.shape[-1] if in_joints else len(T)], controller.K_eps
    acting = T if in_joints else T @ np.linalg.pinv(J)
    B = np.diag(K_r) if in_joints else J.T @ (K_r[:, None] * J)
    taken = delay_damping(controller.cell.coupling, controller.Lambda, K_eps)
    bound = acting.T @ (taken[:, None] * acting)
    least = float(np.linalg.eigvalsh(np.diag(K_r) - bound)[0])
    return Arm(T, P, Z, np.linalg.solve(M, B), np.linalg.solve(M, T.T * K_eps), least)


def _matrices(
    controller: Controller, arms: Sequence[Arm], L: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """own, heard and sent of `Frozen`."""
    from scipy.linalg import block_diag

    n, m = controller.cell.n, controller.cell.m
    T, P, Z, damped, pulled = (
        block_diag(*(getattr(arm, name) for arm in arms)) for name in ("T", "P", "Z", "damped", "pulled")
    )
    Lambda, beta, leak = (np.tile(g, n) for g in (controller.Lambda, controller.beta, controller.leak))
    D, A = (np.kron(part, np.eye(m)) for part in (np.diag(L.diagonal()), L - np.diag(L.diagonal())))
    pace = beta * (Lambda - leak)
    shares = np.hstack(  # what E, sigma and sigma' do to -y''
        (damped @ P * pace - P * (leak * pace), P * pace + damped @ P * beta + pulled, P * beta)
    )
    N, J = T.shape
    sent = np.zeros((3 * N, N + 2 * J))
    sent[:N, :N], sent[N : 2 * N, N : N + J], sent[2 * N :, N + J :] = np.eye(N), T, T
    towards = Z + P * Lambda @ T
    own = np.zeros((N + 2 * J, N + 2 * J))
    own[:N, :N], own[:N, N : N + J], own[N : N + J, N + J :] = -np.diag(leak), T, np.eye(J)
    own[N + J :, N : N + J], own[N + J :, N + J :] = -damped @ towards, -(towards + damped)
    own[N + J :] -= shares @ np.kron(np.eye(3), D) @ sent
    heard = np.zeros((N + 2 * J, 3 * N))
    heard[N + J :] = -shares @ np.kron(np.eye(3), A)
    return own, heard, sent
