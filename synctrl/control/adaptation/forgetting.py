"""The metric of composite adaptation: Gamma as it is given, or one that follows what was learned.

(Gamma^-1)' = -lambda Gamma^-1 + R W^T W is least squares that forget: Gamma shrinks along what is excited,
and grows again where nothing is. With lambda = lambda_0 (1 - tr(Gamma Gamma_0^-1)/(P k)) it grows no further
than tr(Gamma Gamma_0^-1) = P k.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.base_parameters import grouping
from .memory import Symmetric
from .metric import FullMetric, Metric


class Following(Protocol):
    """Gamma of n robots, with a state that has a row per robot, (n, size)."""

    size: int

    def start(self) -> np.ndarray:
        """The state at t = 0."""

    def at(self, state: np.ndarray) -> Metric:
        """The metric with a state."""

    def raised(self, state: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Gamma times a gradient, (n, P)."""

    def turned(self, rate: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Gamma' u, (n, P), for a rate of the state."""

    def rate(self, state: np.ndarray, W: np.ndarray) -> np.ndarray:
        """Of the state, for a regressor (n, nv, P)."""

    def powers(self, state: np.ndarray, tilde: np.ndarray, W: np.ndarray) -> Mapping[str, float]:
        """What the storage changes by because Gamma does, by the power to which it belongs."""


class Constant:
    """Gamma as it is given."""

    size = 0

    def __init__(self, metric: Metric):
        self._metric = metric

    def start(self) -> np.ndarray:
        return np.zeros((len(self._metric.Gamma), 0))

    def at(self, state: np.ndarray) -> Metric:
        return self._metric

    def raised(self, state: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        return self._metric.raised(gradient)

    def turned(self, rate: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.zeros_like(u)

    def rate(self, state: np.ndarray, W: np.ndarray) -> np.ndarray:
        return state

    def powers(self, state: np.ndarray, tilde: np.ndarray, W: np.ndarray) -> Mapping[str, float]:
        return {}


class Forgetting:
    """Gamma' = lambda Gamma - R Gamma W^T W Gamma.

    Args:
        Gamma: at the start, (n, P, P); zero beyond a robot's own parameters.
        sizes: numbers of parameters.
        prediction: R, 1/(N·m·s).
        rate: lambda_0, 1/s.
        growth: k, above 1.
    """

    def __init__(
        self, Gamma: np.ndarray, sizes: Sequence[int], prediction: float, rate: float, growth: float
    ):
        self._form, self._Gamma = Symmetric(Gamma.shape[1]), Gamma
        self._R, self._rate, self.size = prediction, rate, self._form.size
        self._bound = growth * np.array(sizes, dtype=float)
        units = np.eye(Gamma.shape[1])[:, None] * np.ones((len(Gamma), 1))  # (P, n, P)
        metric = FullMetric(Gamma)
        self._inverse = np.stack([metric.lowered(unit) for unit in units], axis=1)

    def start(self) -> np.ndarray:
        return self._form.pack(self._Gamma)

    def at(self, state: np.ndarray) -> FullMetric:
        return FullMetric(self._form.unpack(state))

    def raised(self, state: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        return np.matvec(self._form.unpack(state), gradient)

    turned = raised

    def rate(self, state: np.ndarray, W: np.ndarray) -> np.ndarray:
        learned = self._R * self._form.gram(W @ self._form.unpack(state))
        return self._forgets(state)[:, None] * state - learned

    def powers(self, state: np.ndarray, tilde: np.ndarray, W: np.ndarray) -> Mapping[str, float]:
        stored = 0.5 * (tilde * self.at(state).lowered(tilde)).sum(axis=1)
        return {
            "prediction": float(0.5 * self._R * np.sum(np.matvec(W, tilde) ** 2)),
            "forgetting": float(-np.sum(self._forgets(state) * stored)),
        }

    def _forgets(self, state: np.ndarray) -> np.ndarray:
        """lambda of every robot, (n,), 1/s."""
        grown = (self._form.unpack(state) * self._inverse).sum(axis=2).sum(axis=1)
        return self._rate * (1 - grown / self._bound)


def forgetting(cell: Cell, metric: Metric, prediction: float, rate: float, growth: float) -> Forgetting:
    """`Forgetting` for the robots of a cell.

    Raises:
        InputError: parameters that motion does not tell apart, or a Gamma that is singular.
    """
    sizes = [len(parameters.theta) for parameters in cell.parameters]
    Gamma = metric.Gamma if metric.Gamma.ndim == 3 else metric.Gamma[..., None] * np.eye(max(sizes))
    for name, robot, parameters in zip(cell.names, cell.robots, cell.parameters, strict=True):
        rank, P = grouping(parameters, robot.nv, robot.name).rank, len(parameters.theta)
        if rank < P:
            raise InputError(
                f"motion tells only {rank} of {P} parameters apart, and Gamma would grow along the others; "
                "with forgetting expected base parameters (parameters='base'), or a map of your own",
                subject=f"{name}, adaptation",
                found=rank,
            )
    for i, P in enumerate(sizes):
        lowest = float(np.linalg.eigvalsh(Gamma[i, :P, :P])[0])
        if not lowest > 0:
            raise InputError(
                f"expected no eigenvalue of 0 with forgetting, found {lowest:g} for {cell.names[i]}",
                subject="Gamma",
                found=lowest,
            )
    return Forgetting(Gamma, sizes, prediction, rate, growth)
