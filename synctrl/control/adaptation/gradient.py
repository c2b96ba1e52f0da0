"""The paper's adaptation: theta_hat' = Gamma Y^T s_q, eq. (14)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array, instance, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.pseudo_inertia import inverse_hessian, pseudo_inertia
from ...robots.robot import Robot
from ..gains import RaggedGain
from .metric import DiagonalMetric, Metric, listed, make_metric, read_metric
from .protocol import Adaptation, Seen


class Gradient:
    """theta_hat' = Gamma Y^T s_q, eq. (14), with a diagonal or a full Gamma.

    Its storage is 1/2 tilde^T Gamma^+ tilde. The part of an error that cannot be learned, because Gamma is
    zero or singular there, is the power "model error", s_q^T Y (1 - Gamma Gamma^+) tilde.

    Args:
        Gamma: rate, a number, (P,), (n, P) or a list of n rows of different lengths, not below 0; 0 switches
            the adaptation off. Or a symmetric positive semidefinite matrix for each robot, (n, P, P) or a
            list of n matrices; one alone, (1, P, P), serves all robots.

    Raises:
        InputError: not numbers, not finite, below 0, or matrices that are not symmetric.
    """

    def __init__(self, Gamma: ArrayLike | RaggedGain):
        self.Gamma = read_metric(Gamma)

    @classmethod
    def pullback(cls, robots: Robot | Sequence[Robot], gamma: float, friction: ArrayLike = ()) -> Self:
        """(14) in the metric of bodies: Gamma_kl = gamma tr(D_k P D_l P) per body.

        This is the inverse Hessian of -log det P, with P that of the robot as it is given. With it one
        gamma serves masses, first moments and moments of inertia, robots of every size and all units.

        Args:
            robots: a robot for all of the cell, or one for each, with the parameters that are expected.
            gamma: rate, 1/(N·m), above 0.
            friction: rates of the parameters that are adapted beside those of bodies, one each, as `Gamma`.

        Raises:
            InputError: rates that are not above 0, or a body whose pseudo-inertia is not positive definite.
        """
        rate = positive_number("gamma", gamma)
        given: Any = robots if isinstance(robots, (list, tuple)) else [robots]
        for robot in given:
            instance("robot", robot, Robot, "a Robot, for example from load_robot")
        others = np.diag(finite_array("friction", friction, (None,)))
        return cls([_beside(rate * _pullback(robot), others) for robot in given])

    def bind(self, cell: Cell) -> MetricGradient:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma of another size.
        """
        metric = metric_of(self.Gamma, cell)
        return (BoundGradient if isinstance(metric, DiagonalMetric) else MetricGradient)(cell, metric)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Gradient", "Gamma": listed(self.Gamma)}


def chosen(Gamma: np.ndarray | RaggedGain | None, adaptation: Adaptation | None) -> Adaptation:
    """The adaptation of a controller: the one given, or the paper's with the rate among its gains.

    Raises:
        InputError: both or neither are given, or something that is no adaptation.
    """
    if adaptation is None and Gamma is not None:
        return Gradient(Gamma)
    if adaptation is None or Gamma is not None:
        found = "neither" if adaptation is None else "both"
        shown = found if adaptation is None else "both; gains.replace(Gamma=None) leaves it to the adaptation"
        raise InputError.expected("the gain Gamma or an adaptation", found, "adaptation", shown=shown)
    if not hasattr(adaptation, "bind") or isinstance(adaptation, type):
        raise InputError(
            f"expected, for example, Gradient(0.3), found {adaptation!r}",
            subject="adaptation",
            found=adaptation,
        )
    return adaptation


class MetricGradient:
    """(14) for the robots of a cell, with any Gamma: z is theta_hat itself."""

    def __init__(self, cell: Cell, metric: Metric):
        self.metric, self.theta_hat0 = metric, cell.theta_hat0
        self.Gamma = metric.Gamma  # (n, P), or (n, P, P) if it is not diagonal

    def start(self) -> np.ndarray:
        return self.theta_hat0.copy()

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return z

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self.metric.raised(seen.gradient)

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        return 0.5 * _sum((theta - z) * self.metric.lowered(theta - z))

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        return -_sum(self.metric.lowered(theta - z) * z_dot)

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        frozen = self.metric.frozen(theta - z)
        return {"model error": _sum(seen.s_q * np.matvec(seen.regressor, frozen))}


class BoundGradient(MetricGradient):
    """(14) with a diagonal Gamma, as the paper has it; generated code has a place for it."""

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self.Gamma * seen.gradient


def _sum(term: np.ndarray) -> Any:
    """Over robots and their entries: a number, or with more axes in front one for each instant."""
    return term.sum(axis=(-2, -1))


def metric_of(Gamma: Any, cell: Cell) -> Metric:
    """The metric of a cell's robots.

    Raises:
        InputError: Gamma of another size.
    """
    return make_metric(Gamma, [parameters.theta.size for parameters in cell.parameters])


def _pullback(robot: Robot) -> np.ndarray:
    """tr(D_k P D_l P) of all bodies of a robot, one block per body, (10 bodies, 10 bodies)."""
    P = pseudo_inertia(robot.inertial_parameters.reshape(-1, 10))
    lowest = np.linalg.eigvalsh(P)[:, 0]
    if not lowest.min() > 0:
        k = int(lowest.argmin())
        raise InputError(
            f"the pseudo-inertia of body {k + 1} has the eigenvalue {lowest[k]:.3g}, expected above 0",
            subject=f"robot '{robot.name}'",
            found=float(lowest[k]),
        )
    return _beside(*inverse_hessian(P))


def _beside(*blocks: np.ndarray) -> np.ndarray:
    """A matrix of square blocks along its diagonal."""
    from scipy.linalg import block_diag

    return block_diag(*(block for block in blocks if block.size))
