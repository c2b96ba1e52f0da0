"""Controller and plant as one differential equation over one flat state vector."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..control.controller import Controller, Signals
from ..tasks.cell import Reference
from .plant import Plant


class ClosedLoop:
    """y' = f(t, y) with y = (q, v, theta_hat, integrals of epsilon, state of the plant's own).

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
        self._hidden = slice(int(ends[-1]), None)
        self.size = int(ends[-1]) + plant.hidden0.size

    def initial_state(self) -> np.ndarray:
        """y at t = 0."""
        cell = self.cell
        integral = np.zeros(self._shapes[3])
        parts = (cell.q0, cell.v0, cell.theta_hat0, integral, self.plant.hidden0)
        return np.concatenate([part.ravel() for part in parts])

    def at(self, t: float) -> ClosedLoop:
        """The loop with the plant as it is at time t; at an edge from the right."""
        plant = self.plant.at(t)
        return self if plant is self.plant else ClosedLoop(self.controller, plant)

    def split(self, y: np.ndarray) -> list[np.ndarray]:
        """Views of q, v, theta_hat and the integrals in y."""
        return [y[part].reshape(shape) for part, shape in zip(self._slices, self._shapes, strict=True)]

    def hidden(self, y: np.ndarray) -> np.ndarray:
        """View of the state of the plant's own in y."""
        return y[self._hidden]

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
        tau = self.plant.applied(signals.tau) + disturbance
        v_dot, hidden_dot = self.plant.move(q, v, tau, self.hidden(y))
        parts = (v, v_dot, signals.theta_hat_dot, signals.epsilon, hidden_dot)
        return np.concatenate([part.ravel() for part in parts]), signals

    def coast(self, y: np.ndarray, held: np.ndarray, tau: np.ndarray, disturbance: np.ndarray) -> np.ndarray:
        """y' while the controller is not asked: only the plant moves on.

        Args:
            y: state.
            held: y' at the last sample, of which the parts of the controller's state are kept.
            tau: torque of the controller, (n, nv), N·m.
            disturbance: torque from outside, (n, nv), N·m.
        """
        q, v, _, _ = self.split(y)
        y_dot = held.copy()
        moved, accelerated, _, _ = self.split(y_dot)
        moved[:] = v
        tau = self.plant.applied(tau) + disturbance
        accelerated[:], self.hidden(y_dot)[:] = self.plant.move(q, v, tau, self.hidden(y))
        return y_dot
