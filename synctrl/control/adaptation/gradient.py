"""The paper's adaptation: theta_hat' = Gamma Y^T s_q, eq. (14)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ...checks import instance, non_negative_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.pseudo_inertia import pullback
from ...robots.robot import Robot
from ..gains import RaggedGain, read_gain, spread_rows
from .protocol import Adaptation, Seen


class Gradient:
    """theta_hat' = Gamma Y^T s_q, eq. (14), with a diagonal Gamma.

    Its storage is 1/2 tilde^T Gamma^-1 tilde over the entries that are adapted. The error of those that are
    not (Gamma = 0) is the power "model error", s_q^T Y tilde.

    Args:
        Gamma: rate, a number, (P,), (n, P) or a list of n rows of different lengths, not below 0; 0 switches
            the adaptation off.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    def __init__(self, Gamma: ArrayLike | RaggedGain):
        self.Gamma = read_gain("Gamma", Gamma)
        if self.Gamma.size and self.Gamma.min() < 0:
            raise InputError(f"expected entries of at least 0, found {self.Gamma.min():g}", subject="Gamma")

    @classmethod
    def pullback(cls, robot: Robot, gamma: float) -> Self:
        """Rates that fit all inertial parameters of a robot: Gamma_k = gamma tr(D_k P D_k P), see `pullback`.

        P are the pseudo-inertias of the robot's bodies, so a rate is large where a parameter may change by
        much, and a change of units changes nothing.

        Args:
            robot: its true parameters, or what is known of them, say which size they have.
            gamma: rate, 1/(N·m), not below 0.

        Raises:
            InputError: no robot, or a rate below 0.
        """
        instance("robot", robot, Robot, "a Robot, for example from load_robot")
        return cls(non_negative_number("gamma", gamma) * pullback(robot.inertial_parameters))

    def bind(self, cell: Cell) -> BoundGradient:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma of another size.
        """
        sizes = [parameters.theta.size for parameters in cell.parameters]
        return BoundGradient(cell, spread_rows("Gamma", self.Gamma, sizes))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Gradient", "Gamma": self.Gamma.tolist()}


def chosen(Gamma: np.ndarray | RaggedGain | None, adaptation: Adaptation | None) -> Adaptation:
    """The adaptation of a controller: the one given, or the paper's with the rate among its gains.

    Raises:
        InputError: both or neither are given, or something that is no adaptation.
    """
    if adaptation is None and Gamma is not None:
        return Gradient(Gamma)
    if adaptation is None or Gamma is not None:
        found = "neither" if adaptation is None else "both"
        raise InputError(f"expected the gain Gamma or an adaptation, found {found}", subject="adaptation")
    if not hasattr(adaptation, "bind") or isinstance(adaptation, type):
        raise InputError(f"expected, for example, Gradient(0.3), found {adaptation!r}", subject="adaptation")
    return adaptation


class BoundGradient:
    """`Gradient` for the robots of a cell: z is theta_hat itself."""

    def __init__(self, cell: Cell, Gamma: np.ndarray):
        self.Gamma, self._theta_hat0 = Gamma, cell.theta_hat0
        self._per_gamma = np.divide(1.0, Gamma, out=np.zeros_like(Gamma), where=Gamma > 0)

    def start(self) -> np.ndarray:
        return self._theta_hat0.copy()

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return z

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self.Gamma * seen.gradient

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        return float(0.5 * np.sum(self._per_gamma * (theta - z) ** 2))

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        return float(-np.sum(self._per_gamma * (theta - z) * z_dot))

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        frozen = np.where(self.Gamma > 0, 0.0, theta - z)
        return {"model error": float(np.sum(seen.s_q * np.matvec(seen.regressor, frozen)))}
