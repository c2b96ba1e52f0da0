"""Arms that carry an object, from what is known of it: loads, believed tips, and where the arms start."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance
from ..coupling.cell import Member
from ..robots.payload import holding
from ..robots.robot import Robot
from ..tasks.inverse_kinematics import start_in
from ..tasks.pose import PoseSpace
from ..tasks.poses import PoseTrajectory
from ..tasks.rotations import exp, log
from .body import CarriedObject, Placed, placed, with_share
from .grasp import Grasp


def carrier(
    arm: Robot,
    grasp: Grasp,
    body: CarriedObject,
    motion: PoseTrajectory,
    near: ArrayLike | None = None,
    *,
    at: Placed | None = None,
    share: float = 0.5,
    known: float = 1.0,
    error: ArrayLike = (0.0,) * 6,
) -> Member:
    """An arm that is controlled at the object it carries, in pose space, and has to learn its share of that.

    Args:
        arm: without the object; its tip is the hand.
        grasp: where the hand holds the object, which says a place.
        body, motion: the object, and its desired motion.
        near: joint positions, (nv,), to look for its start from; by default far from singular ones.
        at: place and orientation of the object at t = 0; by default where its motion begins.
        share: of the object's inertia that this arm has; those of all arms add up to 1.
        known: what the first estimate has of that, all of the arm being known.
        error: what it believes of the object in its hand beside the truth, displacement, m, and rotation
            vector, rad, (6,), in the object's axes.

    Raises:
        InputError: a value that is none of these, or a grasp without a place.
        RobotError: a share that leaves its last body no mass or inertia.
        UnreachableError: the hand cannot be there.
    """
    _check(arm, grasp, body, motion)
    (p, R), (d, G), off = placed(at, motion), grasp.object_in_hand, finite_array("error", error, (6,))
    loaded = with_share(arm, finite_number("share", share) * body.parameters, d, G)
    believed = holding(loaded, d + G @ off[:3], G @ exp(off[3:]), body.name)
    q0 = _start(arm, np.concatenate((p + R @ grasp.xyz, log(R @ grasp.rotation))), near)
    load = finite_number("known", known) * (loaded.inertial_parameters - arm.inertial_parameters)
    return Member(believed, motion, q0, theta_hat0=arm.inertial_parameters + load, name=arm.name)


def _check(arm: Robot, grasp: Grasp, body: CarriedObject, motion: PoseTrajectory) -> None:
    instance("arm", arm, Robot, "a Robot")
    instance("grasp", grasp, Grasp, "a Grasp")
    instance("body", body, CarriedObject, "a CarriedObject")
    instance("motion", motion, PoseTrajectory, "a PoseTrajectory")


def _start(arm: Robot, hand: np.ndarray, near: ArrayLike | None) -> np.ndarray:
    """Joint positions, (nv,), with the hand at a pose, (6,), as closely as grasps and theorems ask for."""
    space, posture = PoseSpace(), None if near is None else finite_array("near", near, (arm.nv,))
    q = start_in(arm, hand, space, posture)
    missed, J = space.miss(arm, hand, q)
    return q + np.linalg.lstsq(J, missed)[0]
