"""Robots that hold an object in grasps that do not give: arms and object are one mechanism with loops.

The wrenches of the hands are no function of the state, as those of fixtures are: they follow from the torques
too, see `robots/closed_chain.py`, and jump where these do.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Self

import numpy as np

from ..errors import InputError
from ..robots.closed_chain import ClosedChain
from ..simulation.plant import Output
from .body import pose_rate
from .grasp import grasp_matrix
from .plant import CLOSED, CarryingPlant

#: a hand can move in all directions if the condition of its Jacobian, in m and rad, is below this
REGULAR = 1e4


class RigidPlant(CarryingPlant):
    """`CarryingPlant` whose grasps do not give, whatever they say of their compliance.

    Raises:
        InputError: as `CarryingPlant`; a hand that cannot move in all six directions; hands that do not move
            as one body at t = 0, to `CLOSED`; robots in different gravity.
    """

    def __init__(self, *args: Any, **options: Any):
        super().__init__(*args, **options)
        self._check_hands()

    def longest_step(self, K_r: np.ndarray) -> float:
        """Grasps that do not give set no limit."""
        return float("inf")

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        v_dot, nu_dot, _ = self._moved(q, v, tau, hidden)
        return v_dot, np.concatenate((pose_rate(hidden[:7], hidden[7:]), nu_dot))

    def outputs_under(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray, t: np.ndarray, tau: np.ndarray
    ) -> dict[str, Output]:
        """What `CarryingPlant.outputs_along` has."""
        rows = zip(q, v, tau, hidden, strict=True)
        h = [self.at(instant)._moved(*row)[2] for instant, row in zip(t, rows, strict=True)]
        wrenches = np.array(h).reshape(len(t), len(self.grasps), 6)
        G = grasp_matrix(self._levers(hidden))
        return self._told(np.linalg.solve(G, wrenches[..., None])[..., 0], hidden, t)

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        about = super().report(hidden)
        held = [{name: grasp[name] for name in ("robot", "arm")} for grasp in about["grasps"]]
        return {**about, "grasps": held}

    # -- internals ----------------------------------------------------------------------------------------

    @cached_property
    def _chain(self) -> ClosedChain:
        """Arms and object as they are now."""
        return ClosedChain(self.robots, self._hands.tolist(), self.body.parameters, (self.arms, self.turned))

    def _moved(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray) -> tuple:
        """v', nu', and the wrenches of the hands about the object's origin."""
        pose, nu = hidden[:7].copy(), hidden[7:]
        pose[3:] /= np.linalg.norm(pose[3:])
        return self._chain.motion(q, v, tau - self.friction(v) if self.rubs else tau, pose, nu)

    def _stage(self, window: int) -> Self:
        stage = super()._stage(window)
        vars(stage).pop("_chain", None)
        return stage

    def _check_hands(self) -> None:
        """Refuse hands that cannot follow every motion of the object, and those that do not at t = 0."""
        cell = self.cell
        p_h, _, nu_h, J = self._held(cell.q0, cell.v0)
        G = grasp_matrix(p_h - self.hidden0[:3])
        apart = np.linalg.norm((nu_h - np.vecmat(self.hidden0[7:], G)).reshape(-1, 2, 3), axis=2)
        condition = np.sqrt(np.linalg.cond(J @ J.mT))
        for k, hand in enumerate(self._hands):
            subject = f"grasps, robot '{cell.names[hand]}'"
            if not condition[k] < REGULAR:
                raise InputError(
                    "expected a hand that can move in all six directions, found the condition of its "
                    f"Jacobian {condition[k]:.2g}, in m and rad",
                    subject=subject,
                    found=float(condition[k]),
                )
            if apart[k].max() > CLOSED:
                raise InputError(
                    f"expected hands that move as one body at t = 0, to {CLOSED:g} m/s and rad/s, found this "
                    f"one off by {apart[k, 0]:.2g} m/s and {apart[k, 1]:.2g} rad/s",
                    subject=subject,
                    found=tuple(apart[k].tolist()),
                )
