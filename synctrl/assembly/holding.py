"""Robots that hold an object, in whatever grasps: where it is, who holds it, and what is told of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import NoneType
from typing import Any

import numpy as np

from ..checks import instance
from ..control.controller import Controller
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.robot import Robot
from ..simulation.plant import Output, Plant
from ..tasks.measurement import Tips
from ..tasks.poses import PoseTrajectory
from ..tasks.rigid_motions import place_matrix
from ..tasks.rotations import log
from .body import CarriedObject, Placed, place_of, placed, pose_of
from .grasp import Grasp, grasp_matrix
from .theorems import ClosedChain

#: how far a hand may be off its place on the object at t = 0, m and rad
CLOSED = 1e-6


class HoldingPlant(Plant, ABC):
    """The true robots, and an object that their hands hold; its state is the object's pose and twist, (13,).

    Subclasses say how it is held: by `move`, and by `_forces`, the wrenches of the hands. At t = 0 every hand
    is where its grasp says, to `CLOSED`, if that says a place.

    Args:
        cell: what the controller knows, its robots with their shares of the object.
        body: the object.
        grasps: who holds it where, at least one; no robot twice.
        at: position, (3,), m, and orientation, (3, 3), of the object at t = 0 in world axes;
            by default where its desired motion begins.
        robots: the robots without the object, whose tips are the hands, with the joints of those of the cell;
            by default these.
        desired: desired motion of the object, for figures.
        options: of `Plant`.

    Raises:
        InputError: grasps that do not fit the robots, robots that do not fit the cell, a pose that is none,
            a hand that is not where its grasp says, or pins on one line and nothing else.
    """

    #: whether the grasps do not give
    rigid = False

    def __init__(
        self,
        cell: Cell,
        *,
        body: CarriedObject,
        grasps: Sequence[Grasp],
        at: Placed | None = None,
        robots: Sequence[Robot] | None = None,
        desired: PoseTrajectory | None = None,
        **options: Any,
    ):
        super().__init__(cell, robots=None if robots is None else _fitting(robots, cell), **options)
        instance("body", body, CarriedObject, "a CarriedObject")
        instance("desired", desired, (PoseTrajectory, NoneType), "a PoseTrajectory")
        self.body, self.grasps, self.desired = body, self._checked(grasps), desired
        self._hands = np.array([grasp.robot for grasp in self.grasps])
        self._tips = Tips(self.robots)
        p, R = placed(at, desired)
        self.hidden0 = np.concatenate((pose_of(p, R), self._moving_along(p)))
        self.arms, self.turned = self._closed(p, R)

    def chain(self, controller: Controller) -> ClosedChain:
        return ClosedChain(self, controller)

    def account(self, log: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, Output]]:
        """Pose, twist and desired motion of the object, and wrenches of the hands on it, all over time."""
        hidden, (h, inner) = log["plant_state"], self._forces(log)
        pose, nu = hidden[:, :7].copy(), hidden[:, 7:13].copy()
        pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
        place, forces = "m, and a unit quaternion", "N, N·m"
        along, at_hands = ("time", "coordinate"), ("time", "grasp", "coordinate")
        outputs = {
            "object_pose": (pose, place, along),
            "object_twist": (nu, "m/s, rad/s", along),
            "object_desired": (self._desired_poses(log["t"]), place, along),
            "hand_wrench": (h, forces, at_hands),
            "internal_force": (inner, forces, at_hands),
        }
        return self.report(hidden), outputs

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What is carried, and by whom, as plain data."""
        pairs = zip(self.grasps, self.arms, strict=True)
        held = [{"robot": grasp.robot, "arm": arm.tolist()} for grasp, arm in pairs]
        return {"object": self.body.as_dict(), "grasps": held}

    # -- internals ----------------------------------------------------------------------------------------

    @abstractmethod
    def _forces(self, log: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """What the hands do to the object, and the internal part of it, (T, k, 6) each."""

    def _checked(self, grasps: Sequence[Grasp]) -> tuple[Grasp, ...]:
        """Grasps that this plant can have."""
        check_grasps(grasps, self.cell)
        held = [grasp.robot for grasp in grasps]
        if len(set(held)) != len(held):
            raise InputError(f"expected different robots, found {held}", subject="grasps", found=tuple(held))
        for grasp in grasps:
            if not grasp.lasting:
                text = "expected grasps that hold from the beginning to the end; a HandlingPlant knows others"
                found = grasp.since, grasp.until
                raise InputError(
                    f"{text}, found one from {found[0]} to {found[1]} s", subject="grasps", found=found
                )
        return tuple(grasps)

    def _closed(self, p: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places, (k, 3), and orientations, (k, 3, 3), of the hands in the object's axes at t = 0."""
        hands, turned = self._held(self.cell.q0, self.cell.v0)[:2]
        arms, turned = (hands - p) @ R, R.T @ turned
        for grasp, arm, turn in zip(self.grasps, arms, turned, strict=True):
            if grasp.xyz is None:
                continue
            turning = float(grasp.compliance.stiffness[1] > 0) * log(turn @ grasp.rotation.T)
            off = [float(np.linalg.norm(miss)) for miss in (arm - grasp.xyz, turning)]
            if max(off) > CLOSED:
                raise InputError(
                    f"expected its hand at t = 0 where its grasp says, to {CLOSED:g} m and rad, "
                    f"found it off by {off[0]:.2g} m and {off[1]:.2g} rad",
                    subject=f"grasps, robot '{self.cell.names[grasp.robot]}'",
                    found=tuple(off),
                )
        self._check_rank(arms)
        return arms, turned

    def _check_rank(self, arms: np.ndarray) -> None:
        """Refuse pins, at arms from the object's origin, about which the object may turn as it likes."""
        rank = int(np.linalg.matrix_rank(place_matrix(arms), tol=CLOSED))
        if rank < 6 and not any(grasp.compliance.stiffness[1] for grasp in self.grasps):
            text = f"expected three or more pins that are not on one line, found G of rank {rank}"
            raise InputError(text, subject="grasps", found=rank)

    def _held(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions, orientations, twists and Jacobians of the hands that hold the object."""
        (p, _), R, J, _ = self._tips.poses(q, v)
        J = J[self._hands]
        return p[self._hands], R[self._hands], np.matvec(J, v[self._hands]), J

    def _levers(self, hidden: np.ndarray) -> np.ndarray:
        """From the object's origin to its grasps in world axes, (..., k, 3), of states (..., 13)."""
        return self.arms @ place_of(hidden[..., :7])[1].mT

    def _moving_along(self, p: np.ndarray) -> np.ndarray:
        """Twist of the object at t = 0: that which fits the hands best, which is 0 at rest."""
        hands, _, nu, _ = self._held(self.cell.q0, self.cell.v0)
        G = grasp_matrix(hands - p)
        return np.linalg.lstsq(np.concatenate(G.mT), nu.ravel())[0]

    def _desired_poses(self, t: np.ndarray) -> np.ndarray:
        """Desired poses of the object, (T, 7); NaN if nobody told."""
        if self.desired is None:
            return np.full((len(t), 7), np.nan)
        return pose_of(self.desired.position(t).x, self.desired.orientation(t).R)


def _fitting(robots: Sequence[Robot], cell: Cell) -> tuple[Robot, ...]:
    instance("cell", cell, Cell, "a Cell")
    instance("robots", robots, Sequence, "a sequence of Robot objects")
    for robot in robots:
        instance("robots", robot, Robot, "Robot objects")
    joints, found = ([robot.nv for robot in some] for some in (cell.robots, robots))
    if found != joints:
        raise InputError.expected(f"robots with as many joints as the cell, {joints}", found, "robots")
    return tuple(robots)


def check_grasps(grasps: Sequence[Grasp], cell: Cell) -> None:
    """Refuse what are no grasps by robots of a cell, or none at all.

    Raises:
        InputError: naming the robots.
    """
    instance("grasps", grasps, Sequence, "a sequence of Grasp objects")
    for grasp in grasps:
        instance("grasps", grasp, Grasp, "Grasp objects")
    held = [grasp.robot for grasp in grasps]
    if not held or max(held) >= cell.n:
        words = f"expected robots from 0 to {cell.n - 1}, at least one, found {held}"
        raise InputError(words, subject="grasps", found=tuple(held))
