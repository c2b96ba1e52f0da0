"""Robots whose hands are fixed to one free body, as one mechanism with loops.

    M_i v_i' + n_i = tau_i - J_i^T h_i,   M_o nu' + c_o = sum h_i,   J_i v_i = nu,

with J_i the Jacobian of the body's frame as hand i carries it, and h_i what hand i does to the body, about
the body's origin. Pinocchio's constrained dynamics solves these for v', nu' and h. A loop that has come apart
by d is drawn together, d'' = -Kd d' - Kp d, as Baumgarte proposed: rounding and steps' errors do not add up.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pinocchio as pin

from .forest import common_gravity, side_by_side
from .model import PerThread
from .robot import Robot

#: how loops are drawn together, 1/s^2 and 1/s; larger numbers are worse under the method of Runge and Kutta
STIFFNESS, DAMPING = 100.0, 20.0


class RigidChain:
    """Robots that hold a free body by hands that do not give.

    Every thread that uses it has scratch memory of its own.

    Args:
        robots: the robots, under the same gravity; their hands are their tips.
        hands: which of them hold the body, counted from 0.
        body: its inertial parameters about its origin, (10,), see `Robot.inertial_parameters`.
        places: places, (k, 3), m, and orientations, (k, 3, 3), of these hands in its axes.

    Raises:
        InputError: robots in different gravity.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        hands: Sequence[int],
        body: np.ndarray,
        places: tuple[np.ndarray, np.ndarray],
    ):
        self._made_of = robots, hands, body, places
        joints = np.array([robot.nv for robot in robots])
        #: which entries of (n, nv) are joints
        self._mask = np.arange(joints.max()) < joints[:, None]
        common_gravity(robots)
        self._model, tips = side_by_side(robots)
        free = self._model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "body")
        self._model.appendBodyToJoint(free, pin.Inertia.FromDynamicParameters(body), pin.SE3.Identity())
        self._loops = pin.StdVec_RigidConstraintModel()
        for hand, xyz, R in zip(hands, *places, strict=True):
            self._loops.append(_loop(self._model, tips[hand], pin.SE3(R, xyz), free))
        self._neutral = pin.neutral(self._model)
        self._scratch = PerThread(partial(_Scratch, self._model, self._loops))

    def motion(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, pose: np.ndarray, nu: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """v', (n, nv), nu', (6,), and the wrenches h of the hands on the body about its origin, (k, 6).

        Args:
            q, v, tau: positions, velocities and torques of the joints, (n, nv).
            pose: of the body, position in m and unit quaternion x y z w, (7,).
            nu: its twist, velocity of the origin and angular velocity in world axes, (6,).
        """
        scratch, mask = self._scratch.own, self._mask
        R = pin.XYZQUATToSE3(pose).rotation
        turned = (nu.reshape(2, 3) @ R).ravel()
        stored = pin.integrate(self._model, self._neutral, np.concatenate((q[mask], np.zeros(6))))
        stored[-7:] = pose
        speed, torque = np.concatenate((v[mask], turned)), np.concatenate((tau[mask], np.zeros(6)))
        data, loops = scratch.data, scratch.loops
        rate = pin.constraintDynamics(
            self._model, data, stored, speed, torque, self._loops, loops, scratch.settings
        )
        v_dot = np.zeros(q.shape)
        v_dot[mask] = rate[:-6]
        a, turning = rate[-6:].reshape(2, 3)
        nu_dot = np.concatenate((R @ (a + np.cross(turned[3:], turned[:3])), R @ turning))
        wrenches = np.array([-loop.contact_force.vector for loop in loops])
        return v_dot, nu_dot, (wrenches.reshape(-1, 2, 3) @ R.T).reshape(-1, 6)

    def __reduce__(self) -> tuple:
        """Copies and other processes make the scratch memory anew."""
        return type(self), self._made_of


class _Scratch:
    """What one thread needs to work with a closed chain: Pinocchio's results."""

    def __init__(self, model: pin.Model, loops: pin.StdVec_RigidConstraintModel):
        self.data, self.loops = model.createData(), pin.StdVec_RigidConstraintData()
        for loop in loops:
            self.loops.append(loop.createData())
        self.settings = pin.ProximalSettings(1e-14, 0.0, 1)
        pin.initConstraintDynamics(model, self.data, loops, self.loops)


def _loop(model: pin.Model, tip: int, place: pin.SE3, body: int) -> pin.RigidConstraintModel:
    """That the body, at whose `place` a tip is, stays where it is in the axes of the tip."""
    frame = model.frames[tip]
    carried, origin = frame.placement * place.inverse(), pin.SE3.Identity()
    kind, axes = pin.ContactType.CONTACT_6D, pin.ReferenceFrame.LOCAL
    loop = pin.RigidConstraintModel(kind, model, frame.parentJoint, carried, body, origin, axes)
    loop.setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(STIFFNESS, DAMPING))
    return loop
