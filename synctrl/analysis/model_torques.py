"""Torques that a replay asks the models of a cell's robots for: inertia, friction, wrong parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from ..control.controller import Signals
from ..robots.forest import forests
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop

#: share of the model's torque from which something in Y theta counts as friction, and not as rounding
KNOWN = 1e-9


class Bodies(Protocol):
    """The robots of a cell, at one instant, or at many with one more axis in front."""

    def dynamics(self, q: np.ndarray, v: np.ndarray, s_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrices, (n, nv, nv), and C s_q, (n, nv)."""

    def torque(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """M a_ref + C v_ref + g, (n, nv)."""


class Robots:
    """Robots at one instant, by Pinocchio."""

    def __init__(self, robots: Sequence[Robot]):
        self._forests = forests(robots)

    def dynamics(self, q: np.ndarray, v: np.ndarray, s_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if len(self._forests) == 1:
            forest = self._forests[0][1]
            return forest.mass_matrices(q), forest.coriolis_torque(q, v, s_q)
        M, C_s = np.zeros((*q.shape, q.shape[1])), np.zeros(q.shape)
        for rows, forest in self._forests:
            k = forest.nv
            M[rows, :k, :k] = forest.mass_matrices(q[rows, :k])
            C_s[rows, :k] = forest.coriolis_torque(q[rows, :k], v[rows, :k], s_q[rows, :k])
        return M, C_s

    def torque(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        found = np.zeros(q.shape)
        for rows, forest in self._forests:
            k = forest.nv
            found[rows, :k] = forest.torque(*(x[rows, :k] for x in (q, v, v_ref, a_ref)))
        return found

    def accelerations(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques; valid until the next call."""
        if len(self._forests) == 1:
            return self._forests[0][1].acceleration(q, v, tau)
        found = np.zeros(q.shape)
        for rows, forest in self._forests:
            k = forest.nv
            found[rows, :k] = forest.acceleration(*(x[rows, :k] for x in (q, v, tau)))
        return found


def frozen_error(adaptation: Any, tilde: np.ndarray) -> np.ndarray:
    """The part of an error of theta, (..., n, P), that no rate can change, (1 - Gamma Gamma^+) tilde.

    Nothing of it where an adaptation has no Gamma of its own: what it does to V is then told by its storage.
    """
    metric: Any = getattr(getattr(adaptation, "adaptation", adaptation), "metric", None)
    return metric.frozen(tilde) if hasattr(metric, "frozen") else np.zeros_like(tilde)


def friction_torques(
    loop: ClosedLoop, bodies: Bodies, q: np.ndarray, v: np.ndarray, s: Signals
) -> tuple[np.ndarray, np.ndarray]:
    """Torque of friction that is not in Y, and torque by which friction in Y damps, each (..., n, nv).

    What Y theta has beyond M a_ref + C v_ref + g is friction that the controller knows. With the viscous part
    taken at v_ref, F_v s_q of the plant's friction remains as damping.
    """
    unknown, damping = loop.plant.friction(v), np.zeros_like(v)
    if not loop.plant.rubs:
        return unknown, damping
    theta = loop.cell.theta
    known = np.matvec(s.Y, theta) - bodies.torque(q, v, s.v_ref, s.a_ref)
    knows = (np.abs(known) > KNOWN * np.matvec(np.abs(s.Y), np.abs(theta))).any(axis=-1, keepdims=True)
    damping = np.where(knows, loop.plant.viscous * s.s_q, 0.0)
    return unknown + damping - np.where(knows, known, 0.0), damping
