"""Adaptation on the cone of physically consistent bodies (Lee, Kwon and Park 2018)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...checks import non_negative_number, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.parameters import count_bodies
from ...robots.pseudo_inertia import dual, inertial_parameters, pseudo_inertia
from .protocol import Seen

#: entries of a lower triangular 4 x 4 matrix below its diagonal
_ROWS, _COLUMNS = np.tril_indices(4, -1)
_DIAGONAL = np.arange(4)
#: of the exponential: exact to rounding for matrices of a norm below 64
SQUARINGS, DEGREE = 8, 10


class Natural:
    """P_hat' = gamma P_hat B P_hat per body, with P its pseudo-inertia and tr(B P) = s_q^T Y theta.

    The storage, 1/gamma times the sum over bodies of log(det P_hat/det P) + tr(P_hat^-1 P) - 4, grows without
    bound at the border of the cone: estimates stay those of bodies that can exist. They do not depend on
    units or on the bodies' frames. The state is the Cholesky factor of P_hat, P_hat = L L^T with
    L' = gamma L (lower part of L^T B L, its diagonal halved), the logarithms of the diagonal instead of the
    diagonal: every number of ten stands for a consistent body, so no step can leave the cone.

    Args:
        gamma: rate, 1/(N·m), above 0.
        gamma_friction: rate of parameters of friction, if there are any, by (14); not below 0.

    Raises:
        InputError: numbers of the wrong sign.
    """

    def __init__(self, gamma: float, gamma_friction: float = 0.0):
        self.gamma = positive_number("gamma", gamma)
        self.gamma_friction = non_negative_number("gamma_friction", gamma_friction)

    def bind(self, cell: Cell) -> BoundNatural:
        """This adaptation for a cell.

        Raises:
            InputError: parameters that are not those of bodies, or robots of different numbers of them.
        """
        bodies = [
            count_bodies(f"{name}, adaptation", p)
            for name, p in zip(cell.names, cell.parameters, strict=True)
        ]
        if len(set(bodies)) != 1 or len({len(p.theta) for p in cell.parameters}) != 1:
            raise InputError(
                "Natural expects robots with the same numbers of bodies and parameters, found "
                f"{bodies} bodies",
                subject="adaptation",
                found=bodies,
            )
        return BoundNatural(cell, bodies[0], self.gamma, self.gamma_friction)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Natural", "gamma": self.gamma, "gamma_friction": self.gamma_friction}


class BoundNatural:
    """`Natural` for the robots of a cell: z has ten numbers per body, then the parameters of friction."""

    def __init__(self, cell: Cell, bodies: int, gamma: float, gamma_friction: float):
        self._cell, self._bodies = cell, bodies
        self.gamma, self.gamma_friction = gamma, gamma_friction

    def start(self) -> np.ndarray:
        rigid, friction = self._split(self._cell.theta_hat0)
        P = pseudo_inertia(rigid)
        smallest = np.linalg.eigvalsh(P)[..., 0]
        if not smallest.min() > 0:
            i, k = np.unravel_index(int(np.argmin(smallest)), smallest.shape)
            raise InputError(
                "Natural starts from bodies that can exist; the "
                f"pseudo-inertia of body {k + 1} has the eigenvalue {smallest[i, k]:.3g}, expected above 0",
                subject=f"theta_hat0 of {self._cell.names[i]}",
                found=smallest[i, k],
            )
        L = np.linalg.cholesky(P)
        return self._join(_entries(L), friction)

    def estimate(self, z: np.ndarray) -> np.ndarray:
        rigid, friction = self._split(z)
        L = _lower(rigid)
        return self._join(inertial_parameters(L @ np.swapaxes(L, -1, -2)), friction)

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        rigid, _ = self._split(z)
        gradient, friction = self._split(seen.gradient)
        L = _lower(rigid)
        X = np.swapaxes(L, -1, -2) @ dual(gradient) @ L
        half = _half(X)
        L_dot = L @ half
        logs_dot = half[..., _DIAGONAL, _DIAGONAL]
        entries = np.concatenate((logs_dot, L_dot[..., _ROWS, _COLUMNS]), axis=-1)
        return self._join(self.gamma * entries, self.gamma_friction * friction)

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def leap(self, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
        """Along a geodesic of the cone: P_hat = L exp(h gamma X) L^T, with the X of the sample."""
        (rigid, friction), (rigid_dot, friction_dot) = self._split(z), self._split(z_dot)
        L = _lower(rigid)
        half = _solve_lower(L, _lower_rate(L, rigid_dot))
        root = _exponential(0.5 * h * (half + np.swapaxes(half, -1, -2)))
        return self._join(_entries(_triangular(L @ root)), friction + h * friction_dot)

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        (rigid, friction), (true, true_friction) = self._split(z), self._split(theta)
        P = pseudo_inertia(true)
        L = _lower(rigid)
        ratio = np.linalg.solve(L, np.swapaxes(np.linalg.solve(L, P), -1, -2))
        bodies = (
            2 * rigid[..., :4].sum()
            - np.linalg.slogdet(P)[1].sum()
            + np.trace(ratio, axis1=-2, axis2=-1).sum()
        )
        bodies -= 4 * rigid.shape[0] * rigid.shape[1]
        return float(bodies / self.gamma + self._friction_storage(true_friction - friction))

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        (rigid, friction), (rigid_dot, friction_dot) = self._split(z), self._split(z_dot)
        true, true_friction = self._split(theta)
        L = _lower(rigid)
        # tr(P_hat^-1 P_hat' P_hat^-1 (P_hat - P)) with P_hat' = L (H + H^T) L^T, H = L^-1 L'
        H = np.linalg.solve(L, _lower_rate(L, rigid_dot))
        ratio = np.linalg.solve(L, np.swapaxes(np.linalg.solve(L, pseudo_inertia(true)), -1, -2))
        change = (H + np.swapaxes(H, -1, -2)) * (np.eye(4) - ratio)
        rest = 0.0
        if self.gamma_friction:
            rest = float(np.sum((friction - true_friction) * friction_dot)) / self.gamma_friction
        return float(change.sum() / self.gamma + rest)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        (_, friction), (_, true_friction) = self._split(z), self._split(theta)
        frozen = np.zeros_like(theta)
        if not self.gamma_friction:
            frozen[:, 10 * self._bodies :] = true_friction - friction
        return {"model error": float(np.sum(seen.s_q * np.matvec(seen.regressor, frozen)))}

    # -- internals ----------------------------------------------------------------------------------------

    def _split(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ten numbers per body, (n, bodies, 10), and the rest, (n, ...)."""
        rigid = 10 * self._bodies
        return rows[:, :rigid].reshape(len(rows), self._bodies, 10), rows[:, rigid:]

    def _join(self, bodies: np.ndarray, rest: np.ndarray) -> np.ndarray:
        return np.concatenate((bodies.reshape(len(bodies), -1), rest), axis=1)

    def _friction_storage(self, tilde: np.ndarray) -> float:
        return float(0.5 * np.sum(tilde**2) / self.gamma_friction) if self.gamma_friction else 0.0


def _lower(entries: np.ndarray) -> np.ndarray:
    """L, (..., 4, 4), of the logarithms of its diagonal and the six entries below it, (..., 10)."""
    L = np.zeros((*entries.shape[:-1], 4, 4), dtype=entries.dtype)
    L[..., _DIAGONAL, _DIAGONAL] = np.exp(entries[..., :4])
    L[..., _ROWS, _COLUMNS] = entries[..., 4:]
    return L


def _entries(L: np.ndarray) -> np.ndarray:
    """The inverse of `_lower`, (..., 10)."""
    logs = np.log(L[..., _DIAGONAL, _DIAGONAL])
    return np.concatenate((logs, L[..., _ROWS, _COLUMNS]), axis=-1)


def _lower_rate(L: np.ndarray, entries_dot: np.ndarray) -> np.ndarray:
    """L', (..., 4, 4), of the rates of its entries, (..., 10)."""
    L_dot = np.zeros_like(L)
    L_dot[..., _DIAGONAL, _DIAGONAL] = L[..., _DIAGONAL, _DIAGONAL] * entries_dot[..., :4]
    L_dot[..., _ROWS, _COLUMNS] = entries_dot[..., 4:]
    return L_dot


def _half(X: np.ndarray) -> np.ndarray:
    """The lower triangle of a symmetric matrix with half of its diagonal, so that half + half^T = X."""
    half = np.zeros_like(X)
    half[..., _ROWS, _COLUMNS] = X[..., _ROWS, _COLUMNS]
    half[..., _DIAGONAL, _DIAGONAL] = 0.5 * X[..., _DIAGONAL, _DIAGONAL]
    return half


def _solve_lower(L: np.ndarray, B: np.ndarray) -> np.ndarray:
    """L^-1 B of lower triangular matrices, (..., 4, 4), row by row."""
    X = np.zeros_like(B)
    for k in range(4):
        known = sum((L[..., k, j, None] * X[..., j, :] for j in range(k)), np.zeros_like(B[..., k, :]))
        X[..., k, :] = (B[..., k, :] - known) / L[..., k, k, None]
    return X


def _exponential(S: np.ndarray) -> np.ndarray:
    """exp S of symmetric matrices, (..., 4, 4), by squaring a Taylor polynomial; of numbers or symbols."""
    small, one = S / 2**SQUARINGS, np.eye(4)
    result = one + small / DEGREE
    for k in range(DEGREE - 1, 0, -1):
        result = one + small @ result / k
    for _ in range(SQUARINGS):
        result = result @ result
    return result


def _triangular(A: np.ndarray) -> np.ndarray:
    """The lower triangular L, (..., 4, 4), of positive diagonal with L L^T = A A^T, by Gram and Schmidt."""
    L, rows = np.zeros_like(A), [A[..., k, :] for k in range(4)]
    for k, row in enumerate(rows):
        L[..., k, k] = np.sqrt((row * row).sum(axis=-1))
        unit = row / L[..., k, k, None]
        for j in range(k + 1, 4):
            L[..., j, k] = (rows[j] * unit).sum(axis=-1)
            rows[j] = rows[j] - L[..., j, k, None] * unit
    return L
