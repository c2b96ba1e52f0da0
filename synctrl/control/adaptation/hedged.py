"""Adaptation that takes missing torque for what it is, and lets the desired motion give way for a while.

What torque limits take from a robot, delta = tau_applied - tau, shows in its errors like a wrong model. The
hedge xi is what the desired motion gives way by: controller and coupling see xd - c^-1 xi instead of xd, and

    xi'' = -k (xi' + v_bar tanh(P xi / v_bar)) + c J Delta,    P = pull (1 + S^T S),
    M_h Delta = -(delta + chi Y (theta_hat - theta_h)),        chi = min(1, max_j |delta_j| / (.02 limit_j)),

with k = 2 pull (1 + largest eigenvalue of S^T S), theta_h = theta_hat(0) and M_h its mass matrix. Meanwhile
it learns with (1 - chi) Y_h^T s_q, Y_h = Y(q, v, v_ref, a_ref - Delta): not at all where chi is 1. Where
nothing is cut off, xi goes to zero whatever it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...checks import offers, positive_number
from ...coupling.cell import Cell, Reference
from ...errors import InputError
from ...robots.regressors import make_regressors
from ...tasks.spaces import CartesianSpace, JointSpace
from .beside import Beside
from .protocol import Adaptation, Seen, check_still

#: share of a limit from which on missing torque counts in full
FULL = 0.02
#: how fast the desired motion comes back from afar, by unit of the task; 1 for others
SPEEDS = {"m": 0.3, "rad": 3.14}


class Cut(NamedTuple):
    """What missing torque does at one instant.

    Attributes:
        Delta: acceleration that is given up, (n, nv).
        seen: what the adaptation is to learn from.
    """

    Delta: np.ndarray
    seen: Seen


class Hedged:
    """An adaptation that gives way while torque is cut off, with the desired motion and in what it learns.

    Without a cut it is the adaptation itself, bit for bit. The power is "hedge",
    s_q^T (Y tilde - M Delta) - (1 - chi) s_q^T Y_h tilde. Estimates are bounded if those of the adaptation
    are: give it `bounded`, or a `Guarded` `Ball`. That cuts end is not proved.

    Args:
        adaptation: what learns.
        pull: rate at which the desired motion comes back, 1/s, above 0; Lambda is a good one.
        speed: how fast it comes back from afar, above 0, task unit per s; by default 0.3 m/s or 3.14 rad/s.

    Raises:
        InputError: no adaptation, or a rate or speed that is not above 0.
    """

    def __init__(self, adaptation: Adaptation, pull: float, speed: float | None = None):
        offers("adaptation", adaptation, ("bind", "as_dict"), "an adaptation, for example Ball(0.3, 2.0)")
        self.adaptation, self.pull = adaptation, positive_number("pull", pull)
        self.speed = None if speed is None else positive_number("speed", speed)

    def bind(self, cell: Cell) -> BoundHedged:
        """This adaptation for a cell.

        Raises:
            InputError: a task that is neither one of joints nor of positions with as many joints, weights
                that move, an adaptation that moves the desired motion itself, or a first estimate of which
                the mass matrix is not positive definite.
        """
        _check_task(cell)
        inner: Any = self.adaptation.bind(cell)
        check_still("Hedged", self.adaptation, inner)
        speeds = [SPEEDS.get(unit, 1.0) if self.speed is None else self.speed for unit in cell.units]
        return BoundHedged(cell, inner, self.pull, np.array(speeds))

    def as_dict(self) -> dict[str, Any]:
        settings = {"pull": self.pull, "speed": self.speed, "adaptation": self.adaptation.as_dict()}
        return {"name": "Hedged", **settings}


class BoundHedged(Beside):
    """`Hedged` for the robots of a cell: its z is the adaptation's, and behind it xi and xi', (n, m) each."""

    def __init__(self, cell: Cell, adaptation: Any, pull: float, speeds: np.ndarray):
        super().__init__(adaptation, np.zeros(2 * cell.m))
        self._cell, self._pull = cell, pull
        self._regressor = make_regressors(cell.parameters, [robot.nv for robot in cell.robots])
        self._theta_h = cell.theta_hat0
        self._missing = np.array([np.arange(cell.nv) >= robot.nv for robot in cell.robots])
        self._c = cell.references(np.zeros(1))[0].c
        S = cell.coupling.matrix
        self._k = 2 * pull * (1 + np.linalg.eigvalsh(S.T @ S)[-1])
        self._v_bar = np.linalg.norm(self._c, 2, axis=(1, 2))[:, None] * speeds
        self._check_mass()

    def shift(self, z: np.ndarray, reference: Reference) -> np.ndarray:
        """xd - c^-1 xi with its rates, (3, n, m), with xi'' as it is where nothing is cut off."""
        xi, xi_dot = self.hedge(z)
        return reference.desired - np.matvec(reference.c_inv, np.stack((xi, xi_dot, self._back(xi, xi_dot))))

    def hedge(self, z: np.ndarray) -> np.ndarray:
        """xi and xi' of states z, (..., n, Z): (2, ..., n, m)."""
        return np.stack(np.split(self.own(z), 2, axis=-1))

    def outputs(self, z: np.ndarray) -> dict[str, tuple[np.ndarray, str, tuple[str, ...]]]:
        """What a result gets of states z, (T, n, Z): by how much the desired motion gave way, c^-1 xi."""
        gave_way = np.matvec(np.linalg.inv(self._c), self.hedge(z)[0])
        return {"hedge": (gave_way, self._cell.unit, ("time", "robot", "axis"))}

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        xi, xi_dot = self.hedge(z)
        cut = self._cut(z, seen)
        xi_ddot = self._back(xi, xi_dot) + np.matvec(self._c, self._in_task(seen, cut.Delta))
        return np.concatenate((self.adaptation.rate(self.learned(z), cut.seen), xi_dot, xi_ddot), axis=1)

    def given_up(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        """Delta: by how much v_ref' is less than a_ref, (n, nv), rad/s^2."""
        return self._cut(z, seen).Delta

    def powers(self, z: np.ndarray, theta: np.ndarray, seen: Seen) -> Mapping[str, float]:
        """Those of the adaptation; and "hedge", which has what the shifted motion does to V' too."""
        cut = self._cut(z, seen)
        M_Delta = np.matvec(seen.regressor - self._seen_regressor(seen, cut.Delta), theta)
        missed = (seen.gradient - cut.seen.gradient) * (theta - self.estimate(z))
        hedge = float(np.sum(missed) - np.sum(seen.s_q * M_Delta))
        return {**self.adaptation.powers(self.learned(z), theta, cut.seen), "hedge": hedge}

    # -- internals ----------------------------------------------------------------------------------------

    def _back(self, xi: np.ndarray, xi_dot: np.ndarray) -> np.ndarray:
        """xi'' where nothing is cut off, (n, m)."""
        coupling = self._cell.coupling
        P_xi = self._pull * (xi + coupling.distribute(coupling.compare(xi)))
        return -self._k * (xi_dot + self._v_bar * np.tanh(P_xi / self._v_bar))

    def _cut(self, z: np.ndarray, seen: Seen) -> Cut:
        delta = seen.applied - seen.tau
        if not delta.any():
            return Cut(np.zeros_like(delta), seen)
        limit = np.where(delta != 0, np.maximum(np.abs(seen.applied), np.finfo(float).tiny), 1.0)
        chi = np.minimum(1.0, np.max(np.abs(delta) / (FULL * limit), axis=1))[:, None]
        unknown = np.matvec(seen.regressor, self.estimate(z) - self._theta_h)
        Delta = np.linalg.solve(self._mass(seen.q), -(delta + chi * unknown)[..., None])[..., 0]
        Y_h, s_q = self._seen_regressor(seen, Delta), (1 - chi) * seen.s_q
        changed = {"a_ref": seen.a_ref - Delta, "s_q": s_q, "regressor": Y_h}
        return Cut(Delta, replace(seen, **changed, gradient=np.vecmat(s_q, Y_h)))

    def _seen_regressor(self, seen: Seen, Delta: np.ndarray) -> np.ndarray:
        """Y_h, (n, nv, P)."""
        return self._regressor(seen.q, seen.v, seen.v_ref, seen.a_ref - Delta)

    def _mass(self, q: np.ndarray) -> np.ndarray:
        """M_h, (n, nv, nv), with ones for joints that a robot does not have."""
        rest = np.zeros_like(q)
        still = self._regressor(q, rest, rest, rest)
        columns = [
            np.matvec(self._regressor(q, rest, rest, np.tile(unit, (len(q), 1))) - still, self._theta_h)
            for unit in np.eye(q.shape[1])
        ]
        return np.stack(columns, axis=-1) + np.eye(q.shape[1]) * self._missing[..., None]

    def _in_task(self, seen: Seen, Delta: np.ndarray) -> np.ndarray:
        """J Delta, (n, m)."""
        if not Delta.any():
            return np.zeros((len(Delta), self._cell.m))
        motion = np.stack((seen.q, seen.v))
        J = self._cell.task.measure(motion, np.zeros((3, self._cell.n, self._cell.m))).J
        return Delta if J is None else np.matvec(J, Delta)

    def _check_mass(self) -> None:
        for name, M in zip(self._cell.names, self._mass(self._cell.q0), strict=True):
            lowest = float(np.linalg.eigvalsh((M + M.T) / 2)[0])
            if not lowest > 0:
                raise InputError(
                    "Hedged expects a first estimate with a positive definite mass matrix, found the "
                    f"eigenvalue {lowest:.3g}",
                    subject=f"theta_hat0 of {name}",
                    found=lowest,
                )


def _check_task(cell: Cell) -> None:
    """Refuse a task in which xi'' and the joints' accelerations do not stand for each other."""
    square = all(robot.nv == cell.m for robot in cell.robots)
    if not isinstance(cell.space, (JointSpace, CartesianSpace)) or not square:
        raise InputError(
            f"Hedged expects joint space, or Cartesian space with as many joints, found {cell.space!r}",
            subject="space",
        )
    if cell.references(np.zeros(1))[0].weights.move:
        raise InputError("Hedged expects weights that do not move", subject="coupling")
