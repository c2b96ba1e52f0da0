"""Robots that hold an object in fixtures that give: it moves with them, and forces pass through it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .body import body_rate, place_of
from .forces import internal_wrenches
from .grasp import fixture_wrenches, grasp_matrix, places_on
from .holding import HoldingPlant
from .step import largest_step


class CarryingPlant(HoldingPlant):
    """Robots that hold an object in fixtures.

        M_i v_i' + n_i = tau_i + J_i^T (what the fixture does to the hand)
        M_o nu' + c_o  = sum G_i (what the fixtures do to the object)

    A fixture takes its rest pose at t = 0, so what is left of the difference between hand and place is no
    force. Arguments and errors are those of `HoldingPlant`.

    Attributes:
        K, D: stiffness and damping of the fixtures, (k, 6), N/m, N·m/rad, N·s/m and N·m·s/rad.
    """

    def __init__(self, *args: Any, **options: Any):
        super().__init__(*args, **options)
        self.K, self.D = (np.stack([getattr(g.compliance, name) for g in self.grasps]) for name in "KD")
        self._gravity = np.array(self.robots[0].gravity_vector)

    def longest_step(self, K_r: np.ndarray) -> float:
        """With the fixtures, the arms and the object as they are at the start, see `step.py`."""
        M, J_c, damping = self._together(K_r)
        K, D = (J_c.T * part.ravel() @ J_c for part in (self.K, self.D))
        return largest_step(M, K, D + np.diag(damping))

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        wrenches, back, J = self._wrenches(q, v, hidden)
        pulled = tau.copy()
        pulled[self._hands] += np.vecmat(back, J)
        v_dot, _ = super().move(q, v, pulled, hidden[:0])
        return v_dot, self._object_rate(hidden, wrenches)

    def felt(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> np.ndarray:
        """Internal wrenches about the object's origin, (n, 6); zeros for robots that do not hold it."""
        levers, found = self._levers(hidden), np.zeros((len(q), 6))
        inner = self._inside(self._wrenches(q, v, hidden)[0], levers)
        found[self._hands] = np.matvec(grasp_matrix(levers), inner)
        return found

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What is carried, by whom, and with which fixtures, as plain data."""
        about = super().report(hidden)
        for entry, grasp in zip(about["grasps"], self.grasps, strict=True):
            entry |= grasp.compliance.as_dict()
        return about

    # -- internals ----------------------------------------------------------------------------------------

    def _wrenches(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> tuple[np.ndarray, ...]:
        """Wrenches on the object, at its grasps, and on the hands, (k, 6) each, and the hands' Jacobians."""
        *hands, J = self._held(q, v)
        *places, _ = places_on(hidden, self.arms, self.turned)
        return *fixture_wrenches(hands, places, self.K, self.D), J

    def _forces(self, log: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        rows = zip(log["q"], log["v"], log["plant_state"], strict=True)
        levers = self._levers(log["plant_state"])
        h = np.array([self._wrenches(*row)[0] for row in rows]).reshape(*levers.shape[:2], 6)
        return h, self._inside(h, levers)

    def _inside(self, wrenches: np.ndarray, levers: np.ndarray) -> np.ndarray:
        """Internal part of wrenches of the hands, (..., k, 6) each, at levers, (..., k, 3)."""
        return internal_wrenches(wrenches, levers)

    def _object_rate(self, hidden: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
        load = np.matvec(grasp_matrix(self._levers(hidden)), wrenches).sum(axis=0)
        return body_rate(self.body, hidden, load, self._gravity)

    def _together(self, K_r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of arms and object at t = 0: M, the J_c of all fixtures, and damping of all coordinates."""
        q, robots = self.cell.q0, self.robots
        at = np.cumsum([0, *(robot.nv for robot in robots)])
        size = int(at[-1]) + 6
        M, J_c, damping = np.zeros((size, size)), np.zeros((len(self.arms), 6, size)), np.zeros(size)
        for i, robot in enumerate(robots):
            joints = slice(at[i], at[i + 1])
            M[joints, joints] = robot.mass_matrix(q[i, : robot.nv])
            damping[joints] = K_r[i, : robot.nv]
        R = place_of(self.hidden0[:7])[1]
        M[-6:, -6:] = self.body.mass_matrix(R)
        J = self._held(q, self.cell.v0)[3]
        for rows, G, J_k, i in zip(J_c, grasp_matrix(self.arms @ R.T), J, self._hands, strict=True):
            rows[:, at[i] : at[i + 1]], rows[:, -6:] = J_k[:, : robots[i].nv], -G.T
        return M, J_c.reshape(-1, size), damping
