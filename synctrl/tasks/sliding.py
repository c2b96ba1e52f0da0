"""A point that slides on what a robot carries, and errors that count there.

A tool that works on a carried body asks for the body to be right where the tool is, and that place moves over
the body as the work goes on. Put at rho(t) in the body's axes, it is at p + R rho, and with r = R rho, b the
velocity at which it slides, and J_p, J_w the two halves of the body's Jacobian,

    p_n' = J_n v + b,   J_n = J_p - [r] J_w,   J_n' = J_p' - [r] J_w' - [r'] J_w,   r' = w x r + b
    b = R rho',         b' = w x R rho' + R rho''

A reference velocity there is reached by v_ref = J^-1 (xref' - b), and a_ref = J^-1 (xref'' - J' v_ref - b'):
the drift b is taken from what is desired, and law and proof stay as they are. How the frame at this point is
turned on the body does not matter, for it turns what is desired and what is there alike.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import instance
from ..errors import InputError
from .pose import BoundPoseSpace, PoseSpace
from .poses import PoseTrajectory, Turning, pose_motion
from .rotations import exp, skew
from .spaces import Measurement
from .trajectories import Motion

#: of what is desired: three of the tip, and three of the point
ROWS = 6


class Carrier(PoseTrajectory):
    """Desired motion of a body that a robot carries, on which a frame slides; errors count at that frame.

    They do so in a `SlidingSpace`; in others it is the motion of the body alone.

    Args:
        body: desired motion of the body, which is where the robot's tip is.
        frame: motion of the frame in the body's axes.

    Raises:
        InputError: not two PoseTrajectory.
    """

    def __init__(self, body: PoseTrajectory, frame: PoseTrajectory):
        _check_both(body, frame)
        super().__init__(body.position, body.orientation)
        self.body, self.frame = body, frame
        self.breaks = tuple(sorted({*body.breaks, *frame.breaks}))


class Rider:
    """Desired motion of a tool that follows a frame that slides on a body.

    With p, R of the body and the frame's place rho, orientation G on it: position p + R rho, orientation R G.

    Args:
        body: desired motion of the body.
        frame: motion of the frame in the body's axes.

    Raises:
        InputError: not two PoseTrajectory.
    """

    dimension = 6

    def __init__(self, body: PoseTrajectory, frame: PoseTrajectory):
        _check_both(body, frame)
        self.body, self.frame = body, frame
        self.breaks = tuple(sorted({*body.breaks, *frame.breaks}))

    def __call__(self, t: ArrayLike) -> Motion:
        turning, on_body = self.body.orientation(t), self.frame.orientation(t)
        position = carried_point(self.body.position(t), turning, self.frame.position(t))
        return pose_motion(position, _carried_turning(turning, on_body))


class BoundSlidingSpace(BoundPoseSpace):
    """Poses of tips, with errors that count at points that slide on what these carry.

    Further rows of what is desired are rho, rho' and rho'' in the axes of the tip, (3, n, 6), the last three
    columns 0.
    """

    def measure(self, motion: np.ndarray, desired: np.ndarray) -> Measurement:
        if len(desired) != ROWS:
            where = "desired motion of a sliding point"
            raise InputError.expected("xd, xd', xd'', rho, rho' and rho''", f"{len(desired)} rows", where)
        (p, p_dot), R, J, J_dot = self._tips.poses(*motion)
        w = np.matvec(J[..., 3:, :], motion[1])
        r, b, faster = (np.matvec(R, part) for part in desired[3:, ..., :3])
        r_dot = np.matvec(skew(w), r) + b
        drift = np.stack((np.zeros_like(b), b, np.matvec(skew(w), b) + faster))
        there = np.stack((p + r, p_dot + r_dot)), R, _moved(J, r), _moved(J_dot, r, r_dot, J)
        wanted = np.append(_desired_point(desired) - drift, desired[:3, ..., 3:], axis=-1)
        task = self.compare(motion, there, wanted)
        task.motion[0, ..., :3] = p
        return task


class SlidingSpace(PoseSpace):
    """`PoseSpace` in which the errors of a robot with a `Carrier` count at the frame that slides.

    x and the desired x are those of the tip, which is the body. e, in world axes, is the desired less the
    actual position of the sliding frame, and the rotation vector between the two; x', xd' and xd'' of a
    measurement are without the drift b and its rate. Robots with other motions are as in `PoseSpace`.

    Args:
        max_condition, singularity, redundancy: see `PoseSpace`.

    Raises:
        InputError: a limit that is not positive, or an unknown word.
    """

    bound = BoundSlidingSpace

    def further(self, trajectory: Any, times: np.ndarray) -> np.ndarray:
        """rho, rho' and rho'' at some times, (T,), s, as (3, T, 6); zeros where nothing slides."""
        rows = np.zeros((3, len(times), 6))
        if isinstance(trajectory, Carrier):
            rows[..., :3] = trajectory.frame.position(times)
        return rows

    def __repr__(self) -> str:
        return "SlidingSpace()"


def carried_point(origin: Motion, turning: Turning, point: Motion) -> Motion:
    """Motion in world axes, (..., 3) each, of a point that moves in the axes of a body that moves.

    Args:
        origin, turning: of the body.
        point: in the body's axes.
    """
    (p, p_dot, p_ddot), (R, w, w_dot) = origin, turning
    r, sliding, faster = (np.matvec(R, part) for part in point)
    W = skew(w)
    speed = np.matvec(W, r)
    turned = np.matvec(skew(w_dot), r) + np.matvec(W, speed + 2 * sliding)
    return Motion(p + r, p_dot + speed + sliding, p_ddot + turned + faster)


def _carried_turning(turning: Turning, on_body: Turning) -> Turning:
    """Turning in world axes of a frame that turns in the axes of a body that turns."""
    (R, w, w_dot), G = turning, on_body.R
    spin, faster = (np.matvec(R, part) for part in on_body[1:])
    return Turning(R @ G, w + spin, w_dot + np.matvec(skew(w), spin) + faster)


def _desired_point(desired: np.ndarray) -> np.ndarray:
    """Desired position, velocity and acceleration of the sliding points, (3, ..., 3)."""
    x, point = desired[:3], desired[3:, ..., :3]
    turning = Turning(exp(x[0, ..., 3:]), x[1, ..., 3:], x[2, ..., 3:])
    return np.stack(carried_point(Motion(*x[..., :3]), turning, Motion(*point)))


def _moved(J: np.ndarray, r: np.ndarray, *changing: np.ndarray) -> np.ndarray:
    """J_n of a J, (..., 6, nv), at the lever r, (..., 3); of a J' with r' and J behind it, J_n'."""
    linear = J[..., :3, :] - skew(r) @ J[..., 3:, :]
    if changing:
        r_dot, before = changing
        linear = linear - skew(r_dot) @ before[..., 3:, :]
    return np.append(linear, J[..., 3:, :], axis=-2)


def _check_both(body: Any, frame: Any) -> None:
    instance("body", body, PoseTrajectory, "a PoseTrajectory")
    instance("frame", frame, PoseTrajectory, "a PoseTrajectory")
