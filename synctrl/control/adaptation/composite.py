"""Composite adaptation: estimates learn from velocity errors, and from the torque that acts.

With p = M v = Y_p theta and p' = tau - Y_h theta, a filter of bandwidth w makes of torque and regressors

    W = w Y_p + Z,   Z' = w (Y_h - W),   y' = w (tau - y),

from rest, Z(0) = -w Y_p(0) and y(0) = 0. Then y = W theta exactly, and no acceleration is needed
(Slotine and Li 1989).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...checks import non_negative_number, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.momentum import momentum_of_all
from ..gains import RaggedGain
from .forgetting import Constant, Following, forgetting
from .gradient import metric_of
from .memory import Memory, Nothing, Remembering
from .metric import Metric, listed, read_metric
from .protocol import Seen


class Composite:
    """theta_hat' = Gamma (Y^T s_q + R W^T (y - W theta_hat) + kappa (b - Q theta_hat)).

    y is the torque that acts, filtered, and y = W theta: so y - W theta_hat shows errors of theta_hat even
    where velocities are right. Q and b remember what was shown, see `Memory`: with `fade` 0, once every
    direction has been, estimates converge exponentially, also when the robots rest. The powers "prediction"
    and "memory", -R |W tilde|^2 and -kappa tilde^T Q tilde, only take from V.

    All this holds for torque that acts as the controller knows it: what it asks for, within `torque_limits`.
    Any other, such as a push or friction outside the model, enters y and is learned as if the robot were
    heavier; the power "prediction" then shows it. y = W theta holds for the robot at rest or at the cell's
    v0 at the start, and otherwise after a few times 1/w. With sampled control it holds up to the order
    of the period.

    Args:
        Gamma: as in `Gradient`.
        prediction: R, weight of the errors of prediction, 1/(N·m·s), at least 0.
        bandwidth: w of the filter, 1/s, above 0; well below 1 over the step.
        memory: kappa, how fast what is remembered pulls, 1/s, at least 0. It takes P (P + 3)/2 states.
        fade: mu, how fast what is remembered fades, 1/s, at least 0. Above 0 the pull of what is not shown
            again ends after a few times 1/mu, and what is wrong then stays so. With 0 the pull grows without
            bound for as long as there is excitation, until the step is too long for it.
        forgetting: lambda_0, 1/s, at least 0. Above 0 Gamma follows what is learned, see `Forgetting`: it
            shrinks along what is excited, and recovers. That takes P (P + 1)/2 states, and parameters that
            motion tells apart, such as base parameters; the power "forgetting" only takes from V.
        growth: k, how far Gamma may grow with forgetting, on average, as a multiple of what it is at the
            start; above 1.

    Raises:
        InputError: a Gamma that `Gradient` would not take, numbers of the wrong sign, or a memory of
            predictions that have no weight.
    """

    def __init__(
        self,
        Gamma: ArrayLike | RaggedGain,
        prediction: float,
        bandwidth: float,
        *,
        memory: float = 0.0,
        fade: float = 0.1,
        forgetting: float = 0.0,
        growth: float = 2.0,
    ):
        self.Gamma = read_metric(Gamma)
        self.prediction = non_negative_number("prediction", prediction)
        self.bandwidth = positive_number("bandwidth", bandwidth)
        self.memory, self.fade = non_negative_number("memory", memory), non_negative_number("fade", fade)
        self.forgetting = non_negative_number("forgetting", forgetting)
        self.growth = positive_number("growth", growth)
        if not self.growth > 1:
            raise InputError(f"expected a number above 1, found {growth:g}", subject="growth", found=growth)
        if (self.memory or self.forgetting) and not self.prediction:
            raise InputError(
                "expected a number above 0, because memory and forgetting are of predictions, found 0",
                subject="prediction",
                found=0.0,
            )

    def bind(self, cell: Cell) -> BoundComposite:
        """This adaptation for a cell.

        Raises:
            InputError: Gamma of another size; with forgetting, a singular one, or parameters that motion does
                not tell apart.
        """
        P = cell.theta.shape[1]
        memory = Memory(P, self.prediction, self.memory, self.fade) if self.memory else Nothing()
        return BoundComposite(cell, self._following(cell), self.prediction, self.bandwidth, memory)

    def _following(self, cell: Cell) -> Following:
        metric = metric_of(self.Gamma, cell)
        if not self.forgetting:
            return Constant(metric)
        return forgetting(cell, metric, self.prediction, self.forgetting, self.growth)

    def as_dict(self) -> dict[str, Any]:
        names = "prediction", "bandwidth", "memory", "fade", "forgetting", "growth"
        numbers = {name: getattr(self, name) for name in names}
        return {"name": "Composite", "Gamma": listed(self.Gamma), **numbers}


class State(NamedTuple):
    """The parts of z: estimates, (n, P), of the filter Z, (n, nv, P), and y, (n, nv), memory, and Gamma."""

    theta_hat: np.ndarray
    Z: np.ndarray
    y: np.ndarray
    memory: np.ndarray
    Gamma: np.ndarray

    def joined(self) -> np.ndarray:
        """z."""
        return np.concatenate([part.reshape(len(part), -1) for part in self], axis=1)


class BoundComposite:
    """`Composite` for the robots of a cell."""

    def __init__(
        self, cell: Cell, metric: Following, prediction: float, bandwidth: float, memory: Remembering
    ):
        self._cell, self._metric, self._memory = cell, metric, memory
        self._R, self._w = prediction, bandwidth
        n, nv, P = cell.n, cell.nv, cell.theta.shape[1]
        self._shapes = (n, P), (n, nv, P), (n, nv), (n, memory.size), (n, metric.size)

    def start(self) -> np.ndarray:
        cell, (_, _, y, memory, _) = self._cell, self._shapes
        Y_p, _ = momentum_of_all(cell.robots, cell.parameters, cell.q0, cell.v0)
        rest = np.zeros(y), np.zeros(memory), self._metric.start()
        return State(cell.theta_hat0, -self._w * Y_p, *rest).joined()

    def estimate(self, z: np.ndarray) -> np.ndarray:
        return z[:, : self._shapes[0][1]]

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        x, (Y_p, Y_h) = self.parts(z), seen.momentum()
        W, missed = self._predicted(x, Y_p)
        gradient = seen.gradient + self._R * np.matvec(W.mT, missed) + self._pull(x)
        return State(
            self._metric.raised(x.Gamma, gradient),
            self._w * (Y_h - W),
            self._w * (seen.applied - x.y),
            self._memory.rate(x.memory, W, x.y),
            self._metric.rate(x.Gamma, W),
        ).joined()

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def leap(self, z: np.ndarray, z_dot: np.ndarray, h: float) -> np.ndarray:
        """What is filtered, and what fades, exactly as it does while the rest of its rate is held."""
        x, rate = self.parts(z), self.parts(z_dot)
        steps = h, _held(self._w, h), _held(self._w, h), _held(self._memory.fade, h), h
        return State(*(a + step * b for a, step, b in zip(x, steps, rate, strict=True))).joined()

    def storage(self, z: np.ndarray, theta: np.ndarray) -> float:
        tilde, metric = theta - self.estimate(z), self.metric(z)
        return float(0.5 * np.sum(tilde * metric.lowered(tilde)))

    def storage_rate(self, z: np.ndarray, z_dot: np.ndarray, theta: np.ndarray) -> float:
        """-u^T theta_hat' - 1/2 u^T Gamma' u with u = Gamma^+ tilde."""
        x, rate = self.parts(z), self.parts(z_dot)
        u = self.metric(z).lowered(theta - x.theta_hat)
        return float(-np.sum(u * (rate.theta_hat + 0.5 * self._metric.turned(rate.Gamma, u))))

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        x = self.parts(z)
        tilde, (W, missed) = theta - x.theta_hat, self._predicted(x, seen.momentum()[0])
        frozen = self.metric(z).frozen(tilde)
        found = {
            "model error": float(np.sum(seen.s_q * np.matvec(seen.regressor, frozen))),
            "prediction": float(-self._R * np.sum(np.matvec(W, tilde - frozen) * missed)),
            "memory": float(-np.sum((tilde - frozen) * self._pull(x))),
        }
        for name, power in self._metric.powers(x.Gamma, tilde, W).items():
            found[name] = found.get(name, 0.0) + power
        return found

    def parts(self, z: np.ndarray) -> State:
        """z by its parts; of one instant, or of a `rate`."""
        ends = np.cumsum([np.prod(shape[1:], dtype=int) for shape in self._shapes])[:-1]
        parts = np.split(z, ends, axis=1)
        return State(*(part.reshape(shape) for part, shape in zip(parts, self._shapes, strict=True)))

    def metric(self, z: np.ndarray) -> Metric:
        """Gamma as it is now."""
        return self._metric.at(self.parts(z).Gamma)

    # -- internals ----------------------------------------------------------------------------------------

    def _predicted(self, x: State, Y_p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """W, (n, nv, P), and what it misses of the filtered torque, y - W theta_hat, (n, nv), N·m."""
        W = self._w * Y_p + x.Z
        return W, x.y - np.matvec(W, x.theta_hat)

    def _pull(self, x: State) -> np.ndarray:
        return self._memory.pull(x.memory, x.theta_hat)


def _held(rate: float, h: float) -> float:
    """(1 - exp(-rate h))/rate: how far x' takes x in h s, if x' = u - rate x with u held."""
    return (1 - np.exp(-rate * h)) / rate if rate else h
