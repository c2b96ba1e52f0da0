"""Full pose of the tip: position and orientation, with the orientation error on the rotation group."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..robots.robot import Robot
from . import rotations
from .redundancy import Damping, Redundancy
from .spaces import BoundTipSpace, Measurement, TipSpace
from .tips import Tips
from .validity import Invalid, too_turned

#: An orientation error beyond this ends a run: at pi its direction is not defined, rad.
MAX_ANGLE = 3.0


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
        max_condition: a Jacobian with a larger condition number counts as singular.
        singularity: "stop" ends a run at a singular Jacobian with an error. "damped", or a `Damping`, goes
            on with damped least squares; the result's `info["damping"]` then says when and how much.
        redundancy: what arms with more than six joints do with the rest.

    Raises:
        InputError: a limit that is not positive, or an unknown word.
    """

    unit = "m, rad"
    units = ("m",) * 3 + ("rad",) * 3

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

    def bind(self, robots: Sequence[Robot]) -> BoundPoseSpace:
        """Pose space of these robots.

        Raises:
            InputError: a robot has fewer than six joints, or a redundancy that does not fit.
        """
        return BoundPoseSpace(Tips(robots), self.inverse_map(robots))

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose, J, _ = robot.tip_kinematics(q, np.zeros(robot.nv))
        e_o = rotations.log(rotations.exp(target[3:]) @ pose.rotation.T)
        e = np.concatenate((target[:3] - pose.translation, e_o))
        return e, np.vstack((J[:3], rotations.left_jacobian_inverse(e_o).T @ J[3:]))

    def invalid(self, task: Measurement) -> Invalid | None:
        """The robot with the largest orientation error, if that is too large; else as every tip's space."""
        turned = too_turned(task.e[:, 3:], MAX_ANGLE)
        return super().invalid(task) if turned is None else turned

    def displacement(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """From one pose to another, (..., 6): a translation and, in world axes, a rotation vector."""
        turn = rotations.exp(end[..., 3:]) @ np.swapaxes(rotations.exp(start[..., 3:]), -1, -2)
        return np.concatenate((end[..., :3] - start[..., :3], rotations.log(turn)), axis=-1)

    def __repr__(self) -> str:
        return "PoseSpace()"


class BoundPoseSpace(BoundTipSpace):
    """Tip poses.

    Desired motion comes as x = (position, rotation vector), x' = (velocity, angular velocity w_d) and
    x'' = (acceleration, w_d'), all in world axes, see poses.py.
    """

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        (q, v), (xd, xd_dot, xd_ddot) = motion, desired
        (position, _), R, J_t, J_t_dot = self._tips.poses(q, v)
        J_w, J_w_dot = J_t[:, 3:], J_t_dot[:, 3:]
        e_o, phi = rotations.log(np.stack((rotations.exp(xd[:, 3:]) @ np.swapaxes(R, 1, 2), R)))
        left = rotations.left_jacobian_inverse(e_o)
        right = np.swapaxes(left, 1, 2)
        J = np.concatenate((J_t[:, :3], right @ J_w), axis=1)
        x_dot = np.matvec(J, v)
        wd, wd_dot = xd_dot[:, 3:], xd_ddot[:, 3:]
        turning = np.matvec(left, wd)
        left_dot = rotations.left_jacobian_inverse_dot(e_o, turning - x_dot[:, 3:])
        turning_dot = np.matvec(left_dot, wd) + np.matvec(left, wd_dot)
        J_o_dot = np.swapaxes(left_dot, 1, 2) @ J_w + right @ J_w_dot
        J_dot = np.concatenate((J_t_dot[:, :3], J_o_dot), axis=1)
        inversion = self._inverse.invert(J, J_dot, q, v)
        x = np.concatenate((position, phi), axis=1)
        e = np.concatenate((xd[:, :3] - position, e_o), axis=1)
        rates = desired[1:].copy()
        rates[:, :, 3:] = turning, turning_dot
        moved, error = np.stack((x, x_dot)), np.stack((e, rates[0] - x_dot))
        return Measurement(moved, error, rates, J, inversion.J_inv, J_dot, inversion)
