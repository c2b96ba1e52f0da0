"""Robots that hold an object in fixtures that give: it moves with them, and forces pass through it."""

from __future__ import annotations

from collections.abc import Sequence
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
from .body import CarriedObject, Placed, body_rate, place_of, placed, pose_of
from .forces import internal_wrenches
from .grasp import Grasp, fixture_wrenches, grasp_matrix, places_on
from .step import largest_step
from .theorems import ClosedChain

#: how far a hand may be off its place on the object at t = 0, m and rad
CLOSED = 1e-6


class CarryingPlant(Plant):
    """The true robots, and an object that their hands hold; its state is the object's pose and twist, (13,).

        M_i v_i' + n_i = tau_i + J_i^T (what the fixture does to the hand)
        M_o nu' + c_o  = sum G_i (what the fixtures do to the object)

    At t = 0 every hand is where its grasp says, to `CLOSED`, if that says a place. A fixture takes its rest
    pose then, so what is left of the difference is no force.

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
        self.K, self.D = (np.stack([getattr(g.compliance, name) for g in self.grasps]) for name in "KD")
        self._gravity = np.array(self.robots[0].gravity_vector)
        p, R = placed(at, desired)
        self.hidden0 = np.concatenate((pose_of(p, R), self._moving_along(p)))
        self.arms, self.turned = self._closed(p, R)

    def longest_step(self, K_r: np.ndarray) -> float:
        """With the fixtures, the arms and the object as they are at the start, see `step.py`."""
        M, J_c, damping = self._together(K_r)
        K, D = (J_c.T * part.ravel() @ J_c for part in (self.K, self.D))
        return largest_step(M, K, D + np.diag(damping))

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        wrenches, back, J = self._wrenches(q, v, hidden)
        pulled = tau.copy()
        pulled[self._hands] += np.vecmat(back, J)
        v_dot, _ = super().move(q, v, pulled, hidden[:0])
        return v_dot, self._object_rate(hidden, wrenches)

    def chain(self, controller: Controller) -> ClosedChain:
        return ClosedChain(self, controller)

    def felt(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> np.ndarray:
        """Internal wrenches about the object's origin, (n, 6); zeros for robots that do not hold it."""
        levers, found = self._levers(hidden[None])[0], np.zeros((len(q), 6))
        inner = internal_wrenches(self._wrenches(q, v, hidden)[0], levers)
        found[self._hands] = np.matvec(grasp_matrix(levers), inner)
        return found

    def outputs_along(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray, t: np.ndarray
    ) -> dict[str, Output]:
        """Pose, twist and desired motion of the object, and wrenches of the hands on it, all over time."""
        return self._told(*self._forces_along(q, v, hidden), hidden, t)

    def _told(self, h: np.ndarray, inner: np.ndarray, hidden: np.ndarray, t: np.ndarray) -> dict[str, Output]:
        """`outputs_along` with the wrenches of the hands and their internal part, (T, k, 6) each."""
        pose, nu = hidden[:, :7].copy(), hidden[:, 7:13].copy()
        pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
        place, forces = "m, and a unit quaternion", "N, N·m"
        along, at_hands = ("time", "coordinate"), ("time", "grasp", "coordinate")
        return {
            "object_pose": (pose, place, along),
            "object_twist": (nu, "m/s, rad/s", along),
            "object_desired": (self._desired_poses(t), place, along),
            "hand_wrench": (h, forces, at_hands),
            "internal_force": (inner, forces, at_hands),
        }

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What is carried, and by whom, as plain data."""
        held = [
            {"robot": g.robot, "arm": arm.tolist(), **g.compliance.as_dict()}
            for g, arm in zip(self.grasps, self.arms, strict=True)
        ]
        return {"object": self.body.as_dict(), "grasps": held}

    # -- internals ----------------------------------------------------------------------------------------

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
        if rank < 6 and not self.K[:, 3:].any():
            text = f"expected three or more pins that are not on one line, found G of rank {rank}"
            raise InputError(text, subject="grasps", found=rank)

    def _held(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions, orientations, twists and Jacobians of the hands that hold the object."""
        (p, _), R, J, _ = self._tips.poses(q, v)
        J = J[self._hands]
        return p[self._hands], R[self._hands], np.matvec(J, v[self._hands]), J

    def _wrenches(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> tuple[np.ndarray, ...]:
        """Wrenches on the object, at its grasps, and on the hands, (k, 6) each, and the hands' Jacobians."""
        *hands, J = self._held(q, v)
        *places, _ = places_on(hidden, self.arms, self.turned)
        return *fixture_wrenches(hands, places, self.K, self.D), J

    def _forces_along(
        self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What the hands do to the object, and the internal part of it, (T, k, 6) each."""
        h = np.array([self._wrenches(*row)[0] for row in zip(q, v, hidden, strict=True)])
        h = h.reshape(len(hidden), len(self.grasps), 6)
        return h, internal_wrenches(h, self._levers(hidden))

    def _object_rate(self, hidden: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
        levers = self.arms @ place_of(hidden[:7])[1].T
        load = np.matvec(grasp_matrix(levers), wrenches).sum(axis=0)
        return body_rate(self.body, hidden, load, self._gravity)

    def _levers(self, hidden: np.ndarray) -> np.ndarray:
        """From the object's origin to its grasps in world axes, (T, k, 3)."""
        return self.arms @ place_of(hidden[:, :7])[1].mT

    def _together(self, K_r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of arms and object at t = 0: M, the J_c of all fixtures, and damping of all coordinates."""
        q, robots = self.cell.q0, self.robots
        at = np.cumsum([0, *(robot.nv for robot in robots)])
        size = int(at[-1]) + 6
        M, J_c, damping = np.zeros((size, size)), np.zeros((len(self.arms), 6, size)), np.zeros(size)
        for i, robot in enumerate(robots):
            joints = slice(at[i], at[i + 1])
            M[joints, joints] = robot.mass_matrix(q[i, : robot.nv])
            damping[joints] = K_r[i, : robot.nv]
        R = place_of(self.hidden0[:7])[1]
        M[-6:, -6:] = self.body.mass_matrix(R)
        J = self._held(q, self.cell.v0)[3]
        for rows, G, J_k, i in zip(J_c, grasp_matrix(self.arms @ R.T), J, self._hands, strict=True):
            rows[:, at[i] : at[i + 1]], rows[:, -6:] = J_k[:, : robots[i].nv], -G.T
        return M, J_c.reshape(-1, size), damping

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
