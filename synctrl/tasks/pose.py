"""Full pose of the tip: position and orientation, with the orientation error on the rotation group."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..robots.robot import Robot
from . import rotations
from .measurement import Poses
from .redundancy import Damping, Redundancy
from .spaces import BoundTipSpace, Measurement, TipSpace

#: An orientation error beyond this ends a run: at pi its direction is not defined, rad.
MAX_ANGLE = 3.0


class BoundPoseSpace(BoundTipSpace):
    """Tip poses.

    Desired motion comes as x = (position, rotation vector), x' = (velocity, angular velocity w_d) and
    x'' = (acceleration, w_d'), all in world axes, see poses.py.
    """

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        return self.compare(motion, self._tips.poses(*motion), desired)

    def compare(self, motion: np.ndarray, poses: Poses, desired: np.ndarray) -> Measurement:
        """`measure` of frames that are where `poses` says, see `Kinematics`."""
        v, (xd, xd_dot, xd_ddot) = motion[1], desired
        (position, _), R, J_t, J_t_dot = poses
        x, e, J, left = compare(xd, position, R, J_t)
        wd, wd_dot, x_dot = xd_dot[..., 3:], xd_ddot[..., 3:], np.matvec(J, v)
        turning = np.matvec(left, wd)
        left_dot = rotations.left_jacobian_inverse_dot(e[..., 3:], turning - x_dot[..., 3:])
        J_o_dot = left_dot.mT @ J_t[..., 3:, :] + left.mT @ J_t_dot[..., 3:, :]
        J_dot = np.append(J_t_dot[..., :3, :], J_o_dot, axis=-2)
        inversion = self._inverse.invert(J, J_dot, *motion)
        turning_dot = np.matvec(left_dot, wd) + np.matvec(left, wd_dot)
        rates = np.append(desired[1:, ..., :3], np.stack((turning, turning_dot)), axis=-1)
        moved, error = np.stack((x, x_dot)), np.stack((e, rates[0] - x_dot))
        return Measurement(moved, error, rates, J, inversion.J_inv, J_dot, inversion)


class PoseSpace(TipSpace):
    """Position and orientation of the tip in world axes: x, y, z in m and a rotation vector in rad.

    The orientation error is the rotation vector, in world axes, that turns the tip to where it should be,
    e_o = log(R_d R^T). Its derivative is e_o' = Jl^-1(e_o) w_d - Jr^-1(e_o) w with the angular velocities in
    world axes and the left and right Jacobians of the rotation group. So with the task Jacobian
    J_o = Jr^-1(e_o) J_w and the desired velocity Jl^-1(e_o) w_d, e' = xd' - J v exactly, and the law and its
    proof hold as for positions. The error is an error on the group: it is not the difference between the
    rotation vectors log(R_d) and log(R) that a result has in `x_desired` and `x`.

    An error angle of 3 rad or more ends a run with an error, for at pi its direction is not defined.
    Condition numbers and damping thresholds mix metres and radians here.

    Args:
        max_condition, singularity: see `CartesianSpace`.
        redundancy: what arms with more than six joints do with the rest.

    Raises:
        InputError: a limit that is not positive, or an unknown word.
    """

    unit = "m, rad"
    units = ("m",) * 3 + ("rad",) * 3
    bound = BoundPoseSpace

    def __init__(
        self,
        max_condition: float = 1e4,
        singularity: str | Damping = "stop",
        redundancy: Redundancy | None = None,
    ):
        super().__init__(6, max_condition, singularity, redundancy)

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """x, y, z, and the three coordinates of the rotation vector."""
        return "x", "y", "z", "rx", "ry", "rz"

    @property
    def limits(self) -> Mapping[str, float]:
        """Of the orientation error, rad, and of the condition number."""
        return {"orientation": MAX_ANGLE, **super().limits}

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        return self.missed(target, pose.translation, pose.rotation, J)

    def missed(
        self, target: np.ndarray, position: np.ndarray, R: np.ndarray, J: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`miss` of tips that are at a position, (..., 3), turned by R, with a Jacobian, (..., 6, nv)."""
        return compare(target, position, R, J)[1:3]

    def displacement(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """From one pose to another, (..., 6): a translation and, in world axes, a rotation vector."""
        turn = rotations.exp(end[..., 3:]) @ np.swapaxes(rotations.exp(start[..., 3:]), -1, -2)
        return np.concatenate((end[..., :3] - start[..., :3], rotations.log(turn)), axis=-1)

    def __repr__(self) -> str:
        return "PoseSpace()"


def compare(
    target: np.ndarray, position: np.ndarray, R: np.ndarray, J: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where a tip is, and by how much it misses a target.

    Args:
        target: position and rotation vector, (..., 6).
        position, R, J: of the tip, (..., 3), (..., 3, 3) and (..., 6, nv).

    Returns:
        x and e, (..., 6), the J with e' = -J v, (..., 6, nv), and Jl^-1(e_o), (..., 3, 3).
    """
    e_o, phi = rotations.log(np.stack((rotations.exp(target[..., 3:]) @ R.mT, R)))
    left = rotations.left_jacobian_inverse(e_o)
    task_J = np.append(J[..., :3, :], left.mT @ J[..., 3:, :], axis=-2)
    x, e = np.append(position, phi, axis=-1), np.append(target[..., :3] - position, e_o, axis=-1)
    return x, e, task_J, left
