"""An object that hands carry: its inertia, its motion, and shares of it as loads of robots.

Twists are (velocity of the body's origin, angular velocity), wrenches (force, moment about the origin), both
in world axes. Poses are kept as (position, unit quaternion x y z w), (7,).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, label, positive_number, rotation_matrix
from ..errors import InputError
from ..robots.payload import Payload
from ..robots.pseudo_inertia import inertial_parameters, pseudo_inertia
from ..robots.robot import Robot
from ..tasks.poses import PoseTrajectory
from ..tasks.rotations import from_quaternion, quaternion, skew
from .outline import Outline

Solve = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""M and b -> M^-1 b."""
Placed = tuple[Any, Any]
"""A position, (3,), m, and an orientation, (3, 3), in world axes."""


@dataclass(frozen=True, eq=False)
class Inertia:
    """How hard a rigid object is to move, in numbers or in symbols.

    Args:
        mass: a number, or an array with one entry, kg.
        com: centre of mass in the object's axes, (3,), m.
        inertia: about the centre of mass in the object's axes, (3, 3), kg·m^2.
    """

    mass: Any
    com: Any = (0.0, 0.0, 0.0)
    inertia: Any = None

    def mass_matrix(self, R: np.ndarray) -> np.ndarray:
        """M_o of the twist of its origin in world axes, (6, 6), for its orientation R, (3, 3)."""
        c, M = skew(R @ self.com), self.mass * np.eye(6)
        M[:3, 3:], M[3:, :3] = -self.mass * c, self.mass * c
        M[3:, 3:] = R @ self.inertia @ R.T - self.mass * c @ c
        return M

    def bias(self, R: np.ndarray, w: np.ndarray, g: np.ndarray) -> np.ndarray:
        """c_o of M_o nu' + c_o = sum of the wrenches on it, (6,), with angular velocity w and gravity g."""
        r, inertia, turning = R @ self.com, R @ self.inertia @ R.T, skew(w)
        force = self.mass * (turning @ turning @ r - g)
        return np.concatenate((force, skew(r) @ force + turning @ inertia @ w))


@dataclass(frozen=True, eq=False)
class CarriedObject(Inertia):
    """A rigid object that is carried.

    Args:
        mass: kg.
        com: centre of mass in the object's axes, (3,), m.
        inertia: about the centre of mass in the object's axes, (3, 3), or (3,) for its diagonal, kg·m^2; by
            default that of a uniform ball of the density of water.
        shape: what is drawn for it: edges of a box, (3,), m, above 0, or the `Outline` of a plate; by default
            nothing is.
        box: edges of a box, another way to say `shape`.
        center: of the box or the plate, (3,), m; by default the centre of mass of a box, and of a plate the
            object's origin.
        name: what figures call it.

    Raises:
        InputError: numbers that no body can have.
    """

    mass: float
    com: Any = (0.0, 0.0, 0.0)
    inertia: Any = None
    shape: Any = None
    box: Any = None
    center: Any = None
    name: str = "object"

    def __post_init__(self) -> None:
        label("object, name", self.name)
        load = Payload(0, self.mass, self.com, self.inertia)
        for name in ("mass", "com", "inertia"):
            object.__setattr__(self, name, getattr(load, name))
        with np.errstate(over="ignore", invalid="ignore"):
            finite_array("object, parameters about its origin", self.parameters)
        shape = self._shape()
        plate = isinstance(shape, Outline)
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "box", None if plate else shape)
        middle = np.zeros(3) if plate else self.com
        center = middle if self.center is None else self.center
        object.__setattr__(self, "center", finite_array("object, center", center, (3,)))

    def _shape(self) -> np.ndarray | Outline | None:
        """The shape as it was given, under either name."""
        name, shape = ("shape", self.shape) if self.box is None else ("box", self.box)
        if self.box is not None and self.shape is not None and not np.array_equal(self.shape, self.box):
            raise InputError("expected one of shape and box, found both", subject="object, shape")
        if shape is None or isinstance(shape, Outline):
            return shape
        edges = finite_array(f"object, {name}", shape, (3,))
        positive_number(f"object, {name}", float(edges.min()))
        return edges

    def as_dict(self) -> dict[str, Any]:
        """What it is called, weighs and looks like, as plain data."""
        return {
            "name": self.name,
            "parameters": self.parameters.tolist(),
            "box": None if self.box is None else self.box.tolist(),
            "outline": self.shape.as_dict() if isinstance(self.shape, Outline) else None,
            "center": self.center.tolist(),
        }

    @property
    def parameters(self) -> np.ndarray:
        """Its ten inertial parameters about its origin, in Pinocchio's order, (10,)."""
        c = skew(np.array(self.com))
        I = self.inertia - self.mass * c @ c
        entries = I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]
        return np.array([self.mass, *(self.mass * self.com), *entries])


def moved_parameters(theta: np.ndarray, xyz: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Inertial parameters of a body, (10,), in a frame in which its own is at xyz, turned by rotation."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, xyz
    return inertial_parameters(T @ pseudo_inertia(theta) @ T.T)


def with_share(robot: Robot, theta: ArrayLike, xyz: ArrayLike, rotation: ArrayLike) -> Robot:
    """A robot whose last body has a share of an object's inertia beside its own.

    Args:
        robot: the robot.
        theta: the share, (10,), in the object's axes; of either sign, as long as the body stays one.
        xyz, rotation: place, (3,), m, and orientation, (3, 3), of the object in the axes of the robot's tip.

    Raises:
        InputError: not of these shapes, no rotation matrix, or a tip that does not move.
        RobotError: the body would have no positive mass or no positive definite inertia.
    """
    instance("robot", robot, Robot, "a Robot")
    frame = robot.model.frames[robot.tip_id]
    if frame.parentJoint == 0:
        raise InputError(f"expected a tip that moves, found '{robot.tip}'", subject=f"robot '{robot.name}'")
    place = frame.placement
    d, G = finite_array("xyz", xyz, (3,)), rotation_matrix("rotation", rotation)
    at = place.translation + place.rotation @ d, place.rotation @ G
    pi = robot.inertial_parameters.reshape(-1, 10).copy()
    pi[frame.parentJoint - 1] += moved_parameters(finite_array("share", theta, (10,)), *at)
    return robot.with_parameters(pi.ravel())


def placed(at: Placed | None, motion: PoseTrajectory | None = None) -> Placed:
    """Where an object is at t = 0: where it is said to be, or, if nothing is said, where its motion begins.

    Raises:
        InputError: no position or no rotation matrix, or neither a place nor a motion.
    """
    if at is None and motion is not None:
        return motion.position(0.0).x, motion.orientation(0.0).R
    instance("at", at, Sequence, "a position and an orientation")
    if len(at) != 2:  # type: ignore[arg-type]
        raise InputError.expected("a position and an orientation", f"{len(at)} things", "at")  # type: ignore[arg-type]
    p, R = at  # type: ignore[misc]
    return finite_array("at, position", p, (3,)), rotation_matrix("at, orientation", R)


def pose_of(xyz: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Position and unit quaternion, (..., 7), of a place and an orientation."""
    return np.concatenate((xyz, quaternion(R)), axis=-1)


def place_of(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place, (..., 3), and orientation, (..., 3, 3), of a pose; its quaternion has any length but 0."""
    q = pose[..., 3:]
    return pose[..., :3], from_quaternion(q / np.sqrt((q * q).sum(axis=-1, keepdims=True)))


def pose_rate(pose: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Rate of a pose, (7,), of a body with the twist nu, (6,): q' = (w, 0) q / 2."""
    w, v, s = nu[3:], pose[3:6], pose[6:]
    return np.concatenate((nu[:3], 0.5 * (s * w + skew(w) @ v), -0.5 * (w * v).sum(keepdims=True)))


def body_rate(
    body: Inertia, state: np.ndarray, load: np.ndarray, g: np.ndarray, solve: Solve = np.linalg.solve
) -> np.ndarray:
    """Rate of pose and twist of an object, (13,), from M_o nu' + c_o = load.

    Args:
        body: its inertia.
        state: its pose and twist, (13,).
        load: the wrench on it about its origin, (6,).
        g: gravity, (3,), m/s^2.
        solve: M, b -> M^-1 b.
    """
    pose, nu = state[:7], state[7:]
    R = place_of(pose)[1]
    nu_dot = solve(body.mass_matrix(R), load - body.bias(R, nu[3:], g))
    return np.concatenate((pose_rate(pose, nu), nu_dot))
