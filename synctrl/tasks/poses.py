"""Desired motion of a full pose: a position trajectory together with an orientation trajectory.

The Motion of a pose has x = (position, rotation vector log R), x_dot = (velocity, angular velocity w) and
x_ddot = (acceleration, w'), all in world axes: w is the angular velocity itself, R' = [w] R, and not the
derivative of the rotation vector.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, finite_number, instance, offers, positive_number, rotation_matrix
from ..errors import InputError
from . import rotations
from .trajectories import Certified, Cubic, Hold, Motion, Trajectory, functions_of_time, instants, values_at


class Turning(NamedTuple):
    """Orientation, (..., 3, 3), angular velocity and acceleration in world axes, (..., 3), rad/s, rad/s^2."""

    R: np.ndarray
    w: np.ndarray
    w_dot: np.ndarray


class Orientation(Protocol):
    """A desired orientation over time, smooth except at the instants in `breaks`."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Instants at which a derivative jumps, in s."""

    def __call__(self, t: ArrayLike) -> Turning:
        """Orientation at t, in s."""


class AxisRotation:
    """R(t) = exp(angle(t) axis) start: a turn about a fixed axis of the world.

    Args:
        start: orientation at angle 0, (3, 3).
        axis: any length but 0, (3,).
        angle: trajectory of one number, the angle, rad.

    Attributes:
        start, angle: as given.
        axis, given_axis: of length 1, and as given.

    Raises:
        InputError: `start` is no rotation matrix, the axis is zero, or `angle` no trajectory of one number.
    """

    def __init__(self, start: ArrayLike, axis: ArrayLike, angle: Trajectory):
        self.start = rotation_matrix("start", start)
        self.given_axis = finite_array("axis", axis, (3,))
        self.axis = _unit("axis", axis)
        check_dimension("angle", angle, 1)
        self.angle = angle
        self.breaks = tuple(angle.breaks)

    @classmethod
    def fixed(cls, orientation: ArrayLike) -> Self:
        """An orientation that does not change.

        Args:
            orientation: a rotation matrix, (3, 3).
        """
        return cls(orientation, (0, 0, 1), Hold([0.0]))

    @classmethod
    def between(cls, start: ArrayLike, end: ArrayLike, duration: float) -> Self:
        """The shortest way from one orientation to another, as a cubic polynomial from rest to rest.

        Args:
            start, end: rotation matrices, (3, 3).
            duration: s.
        """
        R0, R1 = rotation_matrix("start", start), rotation_matrix("end", end)
        phi = rotations.log(R1 @ R0.T)
        size = float(np.linalg.norm(phi))
        axis = phi if size > 0 else np.array([0.0, 0.0, 1.0])
        return cls(R0, axis, Cubic([0.0], [size], duration))

    @classmethod
    def steady(cls, start: ArrayLike, axis: ArrayLike, speed: float) -> Self:
        """A turn at constant speed.

        Args:
            start: orientation at t = 0, (3, 3).
            axis: any length but 0, (3,).
            speed: rad/s.
        """
        return cls(start, axis, SteadyAngle(finite_number("speed", speed)))

    def __call__(self, t: ArrayLike) -> Turning:
        angle, speed, growth = self.angle(t)
        return Turning(rotations.exp(angle * self.axis) @ self.start, speed * self.axis, growth * self.axis)


class SteadyAngle:
    """The angle of a turn at constant speed, from 0 on.

    Args:
        speed: rad/s.
    """

    dimension, breaks = 1, ()

    def __init__(self, speed: float):
        self.speed = speed

    def __call__(self, t: ArrayLike) -> Motion:
        angle = self.speed * np.asarray(t, dtype=float)[..., None]
        return Motion(angle, np.full_like(angle, self.speed), np.zeros_like(angle))


class FunctionOrientation:
    """A desired orientation given by Python functions of one time.

    Before a run the derivatives are held against differences. `SmoothOrientation` finds them by itself.

    Args:
        rotation: function of t returning a rotation matrix, (3, 3).
        velocity, acceleration: functions of t returning w and w' in world axes, (3,), rad/s and rad/s^2.
        breaks: instants at which a derivative jumps, s.

    Raises:
        InputError: no functions, or breaks that are no numbers.
        TrajectoryError: not a rotation matrix, or not three finite numbers, at t = 0 or in a later call.
    """

    def __init__(
        self,
        rotation: Callable[[float], ArrayLike],
        velocity: Callable[[float], ArrayLike],
        acceleration: Callable[[float], ArrayLike],
        breaks: tuple[float, ...] = (),
    ):
        self._functions = functions_of_time(rotation=rotation, velocity=velocity, acceleration=acceleration)
        self.breaks = instants(breaks)
        self(0.0)

    def __call__(self, t: ArrayLike) -> Turning:
        rotation, *rates = self._functions.items()
        R = values_at(*rotation, t, (3, 3), rotation_matrix)
        return Turning(R, *(values_at(*rate, t, (3,)) for rate in rates))


class SmoothOrientation(Certified):
    """A desired orientation given by a Python function of one time for its rotation alone.

    The angular velocity is that of R' = [w] R, in world axes.

    Args:
        rotation: function of t returning a rotation matrix, (3, 3); smooth between the breaks.
        duration, breaks: see `SmoothTrajectory`.

    Raises:
        InputError: no function, a duration that is not positive, or breaks that are no numbers.
        TrajectoryError: no rotation matrices, or not smooth enough for a relative error of 1e-8; or a time,
            in a later call, that is outside the duration.
    """

    def __init__(self, rotation: Callable[[float], ArrayLike], duration: float, breaks: Sequence[float] = ()):
        functions_of_time(rotation=rotation)
        at = partial(values_at, "rotation", rotation, shape=(3, 3), check=rotation_matrix)
        super().__init__(lambda t: at(t)[None], duration, breaks)

    def __call__(self, t: ArrayLike) -> Turning:
        R, R_dot, R_ddot = self._at(t)
        w, w_dot = _axial(R_dot @ R.mT), _axial(R_ddot @ R.mT + R_dot @ R_dot.mT)
        return Turning(1.5 * R - 0.5 * R @ R.mT @ R, w, w_dot)  # the rotation next to R: a step of Newton's


class PoseTrajectory:
    """Desired motion of a full pose.

    Args:
        position: trajectory of the position, 3 numbers, m.
        orientation: trajectory of the orientation; by default that of the world's axes.

    Raises:
        InputError: a position that is no trajectory of 3 numbers, or an orientation that is none.
    """

    dimension = 6

    def __init__(self, position: Trajectory, orientation: Orientation | None = None):
        check_dimension("position", position, 3)
        self.position = position
        self.orientation = AxisRotation.fixed(np.eye(3)) if orientation is None else orientation
        offers("orientation", self.orientation, ("__call__", "breaks"), "an orientation such as AxisRotation")
        self.breaks = tuple(sorted({*position.breaks, *self.orientation.breaks}))

    def __call__(self, t: ArrayLike) -> Motion:
        return pose_motion(self.position(t), self.orientation(t))


class Attached:
    """Desired motion of a frame that sits on a moving body, for example a hand that holds a payload.

    With p, R of the body and the frame's place d, G on it: position p + R d, orientation R G.

    Args:
        body: desired motion of the body.
        xyz: place of the frame in the body's axes, (3,), m.
        rotation: orientation of the frame in the body's axes, (3, 3); by default the body's own.

    Raises:
        InputError: `body` is no PoseTrajectory, or `rotation` no rotation matrix.
    """

    dimension = 6

    def __init__(self, body: PoseTrajectory, xyz: ArrayLike = (0, 0, 0), rotation: ArrayLike | None = None):
        instance("body", body, PoseTrajectory, "a PoseTrajectory")
        self.body = body
        self.xyz = finite_array("xyz", xyz, (3,))
        self.rotation = rotation_matrix("rotation", np.eye(3) if rotation is None else rotation)
        self.breaks = body.breaks

    def __call__(self, t: ArrayLike) -> Motion:
        p, p_dot, p_ddot = self.body.position(t)
        R, w, w_dot = self.body.orientation(t)
        arm = R @ self.xyz
        speed = np.cross(w, arm)
        position = Motion(p + arm, p_dot + speed, p_ddot + np.cross(w_dot, arm) + np.cross(w, speed))
        return pose_motion(position, Turning(R @ self.rotation, w, w_dot))


class InPlane:
    """Desired motion along x and y of a place on a moving body.

    Args:
        body: desired motion of the body.
        xyz: the place in the body's axes, (3,), m.
    """

    dimension = 2

    def __init__(self, body: PoseTrajectory, xyz: ArrayLike):
        self._motion = Attached(body, xyz)
        self.body, self.xyz, self.breaks = body, self._motion.xyz, body.breaks

    def __call__(self, t: ArrayLike) -> Motion:
        return Motion(*(part[..., :2] for part in self._motion(t)))


def pose_motion(position: Motion, turning: Turning) -> Motion:
    """The motion of a pose, (..., 6) each, of its two halves."""
    parts = (rotations.log(turning.R), turning.w, turning.w_dot)
    return Motion(*(np.concatenate(pair, axis=-1) for pair in zip(position, parts, strict=True)))


def check_dimension(name: str, trajectory: Any, m: int) -> None:
    """Refuse what is no trajectory of m numbers.

    Raises:
        InputError: a class, or something of another dimension or of none.
    """
    dimension = None if isinstance(trajectory, type) else getattr(trajectory, "dimension", None)
    if dimension != m:
        numbers = f"{m} number{'s' * (m != 1)}"
        found = repr(trajectory) if dimension is None else f"one of {dimension}"
        raise InputError.expected(f"a trajectory of {numbers}", dimension, name, shown=found)


def _axial(A: np.ndarray) -> np.ndarray:
    """The w of the skew part of A = [w], (..., 3, 3) -> (..., 3)."""
    skew = 0.5 * (A - A.mT)
    return np.stack((skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]), axis=-1)


def _unit(name: str, vector: ArrayLike) -> np.ndarray:
    v = finite_array(name, vector, (3,))
    length = positive_number(f"length of {name}", np.linalg.norm(v))
    return v / length
