"""Controller and plant as one differential equation over one flat state vector."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..control.controller import Controller, Signals
from ..tasks.cell import Reference
from .plant import Plant


class ClosedLoop:
    """y' = f(t, y) with y = (q, v, theta_hat, integrals of epsilon).

    Args:
        controller: the controller of a cell.
        plant: the true cell.
    """

    def __init__(self, controller: Controller, plant: Plant):
        self.controller, self.plant = controller, plant
        cell = self.cell = controller.cell
        self._shapes = [(cell.n, cell.nv)] * 2 + [cell.theta.shape, (cell.coupling.pairs, cell.m)]
        ends = np.cumsum([0] + [rows * columns for rows, columns in self._shapes])
        self._slices = [slice(a, b) for a, b in pairwise(ends)]
        self.size = int(ends[-1])

    def initial_state(self) -> np.ndarray:
        """y at t = 0."""
        cell = self.cell
        integral = np.zeros(self._shapes[3])
        return np.concatenate([part.ravel() for part in (cell.q0, cell.v0, cell.theta_hat0, integral)])

    def split(self, y: np.ndarray) -> list[np.ndarray]:
        """Views of q, v, theta_hat and the integrals in y."""
        return [y[part].reshape(shape) for part, shape in zip(self._slices, self._shapes, strict=True)]

    def evaluate(
        self, reference: Reference, y: np.ndarray, disturbance: np.ndarray
    ) -> tuple[np.ndarray, Signals]:
        """y' and everything the controller computed on the way.

        Args:
            reference: what is desired at this instant.
            y: state.
            disturbance: torque from outside, (n, nv), N·m.
        """
        q, v, theta_hat, integral = self.split(y)
        signals = self.controller.evaluate(reference, q, v, theta_hat, integral)
        v_dot = self.plant.acceleration(q, v, signals.tau + disturbance)
        parts = (v, v_dot, signals.theta_hat_dot, signals.epsilon)
        return np.concatenate([part.ravel() for part in parts]), signals

    def coast(self, y: np.ndarray, held: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """y' while the controller is not asked: only the plant moves on.

        Args:
            y: state.
            held: y' at the last sample, of which the parts of the controller's state are kept.
            tau: torque on the joints, (n, nv), N·m.
        """
        q, v, _, _ = self.split(y)
        y_dot = held.copy()
        moved, accelerated, _, _ = self.split(y_dot)
        moved[:] = v
        accelerated[:] = self.plant.acceleration(q, v, tau)
        return y_dot
