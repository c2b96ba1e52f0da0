"""Robots that hold an object in grasps that do not give: arms and object are one mechanism with loops.

The wrenches of the hands are no function of the state, as those of fixtures are: they follow from the torques
too, see `robots/rigid_chain.py`, and jump where these do.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from ..errors import InputError
from ..robots.rigid_chain import RigidChain
from ..simulation.plant import Dynamics
from .body import pose_rate
from .forces import internal_wrenches
from .grasp import grasp_matrix
from .holding import CLOSED, HoldingPlant
from .judge import Motion, WeldedChain

#: a hand can move in all directions if the condition of its Jacobian, in m and rad, is below this
REGULAR = 1e4


class Mover(Protocol):
    """Arms and the object that they hold as one mechanism."""

    def motion(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, pose: np.ndarray, nu: np.ndarray
    ) -> Motion:
        """See `RigidChain.motion`."""


class ChainPlant(HoldingPlant):
    """`HoldingPlant` in which one library moves arms and object at once; which one, subclasses say."""

    def prepare(self) -> Dynamics:
        self._mover  # noqa: B018 (made here)
        return super().prepare()

    def check_robots(self) -> None:
        self.prepare()

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        v_dot, nu_dot, _ = self._moved(q, v, tau, hidden)
        return v_dot, np.concatenate((pose_rate(hidden[:7], hidden[7:]), nu_dot))

    # -- internals ----------------------------------------------------------------------------------------

    def _forces(self, log: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        tau, hidden = self.applied(log["tau"]) + log["disturbance"], log["plant_state"]
        rows = zip(log["t"], log["q"], log["v"], tau, hidden, strict=True)
        wrenches, levers = [self.at(t)._moved(*row)[2] for t, *row in rows], self._levers(hidden)
        about_origin = np.array(wrenches).reshape(*levers.shape[:2], 6)
        h = np.linalg.solve(grasp_matrix(levers), about_origin[..., None])[..., 0]
        return h, internal_wrenches(h, levers)

    @property
    @abstractmethod
    def _mover(self) -> Mover:
        """Arms and object as they are now; made once for every stage."""

    def _moved(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray) -> Motion:
        """v', nu', and the wrenches of the hands about the object's origin."""
        pose, nu = hidden[:7].copy(), hidden[7:]
        pose[3:] /= np.linalg.norm(pose[3:])
        return self._mover.motion(q, v, tau - self.friction(v) if self.rubs else tau, pose, nu)

    def _stage(self, window: int) -> Self:
        stage = super()._stage(window)
        vars(stage).pop("_mover", None)
        return stage


class RigidPlant(ChainPlant):
    """Robots that hold an object in grasps that do not give, whatever these say of their compliance.

    Pinocchio computes it, or MuJoCo as a judge, whose welds give a little, see `judge.py`.

    Raises:
        InputError: as `HoldingPlant`; a grasp that leaves a direction free; a hand that cannot move in all
            six; hands that do not move as one body at t = 0, to `CLOSED`; robots in different gravity.
    """

    rigid = True

    def __init__(self, *args: Any, **options: Any):
        super().__init__(*args, **options)
        self._check_grasps()
        self._check_hands()

    def felt(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> np.ndarray:
        """Nothing: wrenches here follow from the torques that a controller would make of them.

        Raises:
            InputError: always.
        """
        text = (
            "an admittance expects grasps that give, whose wrenches do not depend on torque, found rigid ones"
        )
        raise InputError(text, subject="admittance", found="rigid")

    # -- internals ----------------------------------------------------------------------------------------

    @cached_property
    def _mover(self) -> Mover:
        hands, places = self._hands.tolist(), (self.arms, self.turned)
        made: dict[str, Any] = {
            "pinocchio": lambda: RigidChain(self.robots, hands, self.body.parameters, places),
            "mujoco": lambda: WeldedChain(self.robots, hands, self.body, places),
        }
        return made[self.physics]()

    def _check_grasps(self) -> None:
        """Refuse those, for instance pins, that let the object turn or slide in the hand."""
        for hand, grasp in zip(self._hands, self.grasps, strict=True):
            stiffness = grasp.compliance.K
            if not stiffness.all():
                text = "expected rigid grasps to hold in all six directions, found the stiffness"
                where = f"grasps, robot '{self.cell.names[hand]}'"
                raise InputError(f"{text} {stiffness.tolist()}", subject=where, found=stiffness.tolist())

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
