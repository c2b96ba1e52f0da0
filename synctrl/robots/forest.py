"""Robots side by side as one mechanism, so that one call of Pinocchio serves all of them.

Calls from Python cost more than what they compute for an arm of few joints. A forest has a tree per robot and
passes the rigid-body algorithms once; its trees do not act on each other. Arrays have one row per robot.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin

from ..errors import InputError
from .model import PerThread
from .robot import Robot

#: joints of a forest at most
LARGE = 96
#: the same where regressors are asked for: they have a block per tree, in a matrix that grows with the square
SMALL = 24
#: quantities of bodies in world axes, which is the faster way here
_WORLD = pin.Convention.WORLD
#: p @ _CROSS are the entries of the matrix P with a @ P = a x p
_CROSS = np.array([[[0, -z, y], [z, 0, -x], [-y, x, 0]] for x, y, z in np.eye(3)]).reshape(3, 9)
K = TypeVar("K", bound=Hashable)

Selection = slice | np.ndarray
"""Which of the robots: rows of arrays that have one per robot."""


class Forest:
    """Robots with equal numbers of joints and bodies under the same gravity, as one mechanism.

    Every thread that uses a forest has scratch memory of its own.

    Args:
        robots: the robots, at least one.
        maps: matrices that make inertial parameters of the adapted ones, (n, 10 bodies, P), see
            `LinearParameters`; by default all inertial parameters are adapted.
    """

    def __init__(self, robots: Sequence[Robot], maps: np.ndarray | None = None):
        self.robots, self._maps = tuple(robots), maps
        self.n, self.nv = len(robots), robots[0].nv
        self._model, tips = side_by_side(robots)
        self._weightless = pin.Model(self._model)
        self._weightless.gravity.setZero()
        self._scratch = PerThread(partial(_Scratch, self._model, tips, self.n))
        self._weightless_data = PerThread(self._weightless.createData)
        self._neutral, self._still = pin.neutral(self._model), np.zeros(self._model.nv)
        plain = self._model.nq == self._model.nv
        #: joint positions as Pinocchio stores them
        self._stored: Callable[[np.ndarray], np.ndarray] = np.ndarray.ravel if plain else self._integrated
        self._moves = _joints_that_move(self._model, tips).reshape(self.n, self.nv, 1)

    def regressor(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """Slotine-Li regressors of the adapted parameters, (n, nv, P); arguments are (n, nv).

        See `Robot.regressor`. Pinocchio gives a matrix with a block per tree, of which the blocks are taken.
        """
        q, v = self._stored(q), v.ravel()
        half = 0.5 * (v_ref.ravel() - v)
        data, weightless_data = self._scratch.own.data, self._weightless_data.own
        whole = pin.computeJointTorqueRegressor(self._model, data, q, v + half, a_ref.ravel())
        whole -= pin.computeJointTorqueRegressor(self._weightless, weightless_data, q, half, self._still)
        Y = whole.T.reshape(self.n, -1, self.n, self.nv).diagonal(axis1=0, axis2=2).T
        return Y if self._maps is None else Y @ self._maps

    def torque(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """M a_ref + C(q, v) v_ref + g, (n, nv), with the true parameters by the identity of `regressor`."""
        return self._torque(self._model, self._scratch.own.data, q, v, v_ref, a_ref)

    def coriolis_torque(self, q: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """C(q, v) w, (n, nv)."""
        return self._torque(self._weightless, self._weightless_data.own, q, v, w, self._still)

    def mass_matrices(self, q: np.ndarray) -> np.ndarray:
        """M(q), (n, nv, nv)."""
        each, n, nv = np.arange(self.n), self.n, self.nv
        M = pin.crba(self._model, self._scratch.own.data, self._stored(q))
        return M.reshape(n, nv, n, nv)[each, :, each]

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques tau, (n, nv); valid until this thread's next call."""
        scratch = self._scratch.own
        pin.aba(self._model, scratch.data, self._stored(q), v.ravel(), tau.ravel(), _WORLD)
        return scratch.v_dot

    def tips(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions and velocities of the tips, (2, n, 3), the velocities' Jacobians and their derivatives.

        Both of the latter are (n, 3, nv). The columns that Pinocchio has are twists: velocity of the point of
        a body that passes the origin, and angular velocity. A tip at p moves with linear + angular x p, which
        is the twist times a matrix `to_tip`.
        """
        scratch = self._scratch.own
        pin.computeJointJacobiansTimeVariation(self._model, scratch.data, self._stored(q), v.ravel())
        pin.updateFramePlacements(self._model, scratch.data)
        motion = np.empty((2, self.n, 3))
        p, p_dot = motion
        np.concatenate(scratch.positions, out=p.reshape(-1))
        np.matmul(p, _CROSS, out=scratch.arms)
        J = self._moves * (scratch.J @ scratch.to_tip)
        np.vecmat(v, J, out=p_dot)
        np.matmul(p_dot, _CROSS, out=scratch.arms_dot)
        J_dot = self._moves * (scratch.J_dot @ scratch.to_tip + scratch.J @ scratch.to_tip_dot)
        return motion, J.mT, J_dot.mT

    def poses(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions and velocities of tips, (2, n, 3), their rotations, (n, 3, 3), J and J', (n, 6, nv).

        The Jacobians are those of the linear velocity, then of the angular one, in world axes.
        """
        motion, J, J_dot = self.tips(q, v)
        scratch = self._scratch.own
        R = np.concatenate(scratch.rotations).reshape(-1, 3, 3)
        turning, turning_dot = ((self._moves * part[..., 3:]).mT for part in (scratch.J, scratch.J_dot))
        twists = np.concatenate((J, turning), axis=1)
        return motion, R, twists, np.concatenate((J_dot, turning_dot), axis=1)

    # -- internals ----------------------------------------------------------------------------------------

    def _torque(
        self, model: pin.Model, data: pin.Data, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a: np.ndarray
    ) -> np.ndarray:
        q, v, half = self._stored(q), v.ravel(), 0.5 * (v_ref - v).ravel()
        torque = pin.rnea(model, data, q, v + half, a.ravel()).copy()
        torque -= pin.rnea(self._weightless, self._weightless_data.own, q, half, self._still)
        return torque.reshape(self.n, self.nv)

    def _integrated(self, q: np.ndarray) -> np.ndarray:
        """Joint positions of robots with joints that turn without end, as cosine and sine."""
        return pin.integrate(self._model, self._neutral, q.ravel())

    def __reduce__(self) -> tuple:
        """Copies and other processes make the scratch memory anew: views would come apart from it."""
        return type(self), (self.robots, self._maps)


class _Scratch:
    """What one thread needs to work with a forest: Pinocchio's results, and views that follow them.

    Args:
        model: the forest as one mechanism.
        tips: frames of the tips.
        n: number of robots.

    Attributes:
        data: where Pinocchio leaves its results; they stay where they are.
        v_dot: accelerations, (n, nv).
        J, J_dot: twists, (n, nv, 6), and their derivatives.
        positions, rotations: of the tips.
        to_tip, to_tip_dot: matrices from twists to velocities of the tips, (n, 6, 3), see `Forest.tips`.
        arms, arms_dot: the part of them that changes, (n, 9).
    """

    def __init__(self, model: pin.Model, tips: Sequence[int], n: int):
        self.data = data = model.createData()
        self.v_dot = data.ddq.reshape(n, -1)
        self.J, self.J_dot = (twists.T.reshape(n, -1, 6) for twists in (data.J, data.dJ))
        self.positions = [data.oMf[tip].translation for tip in tips]
        self.rotations = [data.oMf[tip].rotation for tip in tips]
        self.to_tip, self.to_tip_dot = np.zeros((2, n, 6, 3))
        self.to_tip[:, :3] = np.eye(3)
        self.arms, self.arms_dot = (A.reshape(n, 18)[:, 9:] for A in (self.to_tip, self.to_tip_dot))


def forests(robots: Sequence[Robot], joints: int = LARGE) -> list[tuple[Selection, Forest]]:
    """Forests that together have all robots, each with the rows it stands for, which ascend.

    Robots share a forest wherever they stand: how many forests there are does not depend on their order.

    Args:
        robots: the robots.
        joints: joints of a forest at most.
    """
    return [(as_selection(part), Forest([robots[i] for i in part])) for part in shares(robots, joints)]


def shares(robots: Sequence[Robot], joints: int) -> Iterator[list[int]]:
    """Which robots have a forest of at most so many joints in common."""
    for (nv, *_), rows in alike(map(_size, robots)).items():
        step = max(1, joints // nv)
        yield from (rows[first : first + step] for first in range(0, len(rows), step))


def alike(kinds: Iterable[K]) -> dict[K, list[int]]:
    """Where each kind is found."""
    found: dict[K, list[int]] = {}
    for i, kind in enumerate(kinds):
        found.setdefault(kind, []).append(i)
    return found


def as_selection(indices: Sequence[int]) -> Selection:
    """Ascending indices of rows; as a slice, which copies nothing, where they are evenly spaced."""
    first, *others = indices
    step = others[0] - first if others else 1
    even = range(first, indices[-1] + 1, step)
    return slice(even.start, even.stop, step) if list(even) == list(indices) else np.array(indices)


def common_gravity(robots: Sequence[Robot]) -> np.ndarray:
    """The gravity that all robots have, (3,), m/s^2.

    Raises:
        InputError: robots in different gravity.
    """
    expected = robots[0].gravity_vector
    for robot in robots:
        found = robot.gravity_vector.tolist()
        if found != expected.tolist():
            text = (
                f"expected one gravity, that of '{robots[0].name}', {expected.tolist()} m/s^2, found {found}"
            )
            raise InputError(text, subject=f"robot '{robot.name}'", found=found)
    return expected


def _size(robot: Robot) -> tuple[Any, ...]:
    """What robots of one forest have in common, first of all their number of joints."""
    return robot.nv, robot.model.nq, robot.body_count, tuple(robot.gravity_vector.tolist())


def side_by_side(robots: Sequence[Robot]) -> tuple[pin.Model, list[int]]:
    """One model with a tree per robot, and the frames of their tips."""
    model, tips = pin.Model(), []
    model.gravity = robots[0].model.gravity
    for i, robot in enumerate(robots):
        of, shift = robot.model, model.njoints - 1
        for j in range(1, of.njoints):
            parent = of.parents[j] + shift if of.parents[j] else 0
            joint = model.addJoint(parent, of.joints[j], of.jointPlacements[j], f"{i} {of.names[j]}")
            model.inertias[joint] = of.inertias[j]
        tip = of.frames[robot.tip_id]
        parent = tip.parentJoint + shift if tip.parentJoint else 0
        tips.append(model.addFrame(pin.Frame(f"{i} tip", parent, tip.placement, pin.OP_FRAME)))
    model.armature = np.concatenate([robot.armature for robot in robots])
    return model, tips


def _joints_that_move(model: pin.Model, tips: Sequence[int]) -> np.ndarray:
    """1 for joints between the tip of their tree and the world, else 0, (nv,)."""
    moves = np.zeros(model.nv)
    for tip in tips:
        for joint in list(model.supports[model.frames[tip].parentJoint])[1:]:  # the first one is the world
            moves[model.joints[joint].idx_v] = 1
    return moves
