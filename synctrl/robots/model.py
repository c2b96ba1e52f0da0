"""Pinocchio's model of a mechanism: whether its algorithms are right for it, and what it says of joints.

What turns is in rad, rad/s and N·m, what slides in m, m/s and N.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Generic, TypeVar

import numpy as np
import pinocchio as pin

from ..checks import instance
from ..errors import FrameNotFound, RobotError
from .pseudo_inertia import NO_MOMENT, principal_moments

# -- what a model must be ----------------------------------------------------------------------------------


def frame_id(robot: str, model: pin.Model, frame: str) -> int:
    """The number of a frame in a robot's model.

    Raises:
        FrameNotFound: there is none of that name.
    """
    instance("frame", frame, str, "a name")
    if not model.existFrame(frame):
        raise FrameNotFound(robot, frame, [known.name for known in model.frames])
    return int(model.getFrameId(frame))


def check_joints(robot: str, model: pin.Model) -> None:
    """Refuse joints with several velocities, such as that of a floating base.

    Raises:
        RobotError: naming the joint.
    """
    for joint, name in zip(model.joints[1:], model.names[1:], strict=False):
        if joint.nv != 1:
            raise RobotError(
                f"joint '{name}' has {joint.nv} degrees of freedom; "
                "expected joints with one (fixed-base arms of revolute and prismatic joints)",
                subject=f"robot '{robot}'",
                found=name,
            )


def check_numbering(robot: str, model: pin.Model) -> None:
    """Refuse joints not numbered branch after branch: Pinocchio's C(q, v) would be silently wrong."""
    for joint in range(1, model.njoints):
        carried = list(model.subtrees[joint])
        if carried != list(range(joint, joint + len(carried))):
            raise RobotError(
                "expected joints numbered branch after branch, found joint "
                f"'{model.names[joint]}' to carry the joints {carried}",
                subject=f"robot '{robot}'",
                found=model.names[joint],
            )


def check_inertia(robot: str, joint: str, row: np.ndarray) -> None:
    """Refuse ten inertial parameters that no body can have."""
    body = f"robot '{robot}', body of '{joint}'"
    if row[0] <= 0:
        raise RobotError.expected("a mass above 0 kg", row[0], body)
    with np.errstate(over="ignore"):
        if not np.isfinite(row @ row):
            raise RobotError.expected("numbers of a size that bodies have", np.abs(row).max(), body)
    lowest, _, highest = principal_moments(row)
    if lowest < -NO_MOMENT or highest <= 0:
        positive, shown = "a positive definite inertia about the centre of mass", f"{lowest:g} kg·m^2"
        raise RobotError.expected(positive, lowest, body, shown=f"a smallest eigenvalue of {shown}")


def as_stored(rows: np.ndarray) -> np.ndarray:
    """Inertial parameters of bodies, (k, 10), as a model gives them back, which has them about the centre."""
    bodies = (pin.Inertia.FromDynamicParameters(row) for row in np.array(rows))
    return np.array([body.toDynamicParameters() for body in bodies])


# -- units of joints ---------------------------------------------------------------------------------------


#: position of a joint that turns, and of one that slides
TURNS, SLIDES = "rad", "m"
#: unit of something of a joint that turns -> unit of the same of one that slides
_SLIDING: Mapping[str, str] = MappingProxyType(
    {
        TURNS: SLIDES,
        "rad/s": "m/s",
        "rad/s²": "m/s²",
        "N·m": "N",
        "N·m·s/rad": "N·s/m",
        "N·m/rad": "N/m",
    }
)


def joint_units(model: pin.Model) -> tuple[str, ...]:
    """Units of the positions of all joints, (nv,): "rad" of those that turn, "m" of those that slide."""
    return tuple(TURNS if np.any(subspace(model, j)[3:]) else SLIDES for j in range(1, model.njoints))


def subspace(model: pin.Model, joint: int) -> np.ndarray:
    """The motion that a joint allows in its own frame, (6,): linear, then angular."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, pin.neutral(model))
    return np.asarray(data.S).ravel()


def unit_for(unit: str, joint: str) -> str:
    """Unit of something of a joint whose position is in `joint`; `unit` is that of a joint that turns."""
    return _SLIDING.get(unit, unit) if joint == SLIDES else unit


def joined(units: Iterable[str]) -> str:
    """Units in one text, each once: `rad`, or `m, rad`."""
    return ", ".join(dict.fromkeys(units))


def joint_poses(model: pin.Model, q: np.ndarray) -> np.ndarray:
    """Poses of all joint frames in the world.

    Args:
        model: the mechanism.
        q: configurations as Pinocchio stores them, (T, nq).

    Returns:
        (T, njoints, 7): x, y, z in m, then the unit quaternion x, y, z, w; joint 0 is the world.
    """
    data = model.createData()
    poses = np.empty((len(q), model.njoints, 7))
    for frame, configuration in enumerate(q):
        pin.forwardKinematics(model, data, configuration)
        for joint in range(model.njoints):
            poses[frame, joint] = pin.SE3ToXYZQUAT(data.oMi[joint])
    return poses


T = TypeVar("T")


class PerThread(threading.local, Generic[T]):
    """Something that each thread makes when it first asks for it, and that ends with the thread.

    Robots and forests may be shared among threads, but Pinocchio's algorithms write into a `pin.Data`: two
    threads that wrote into the same one would read each other's numbers.

    Args:
        make: makes one.
    """

    def __init__(self, make: Callable[[], T]):
        self._make = make

    @cached_property
    def own(self) -> T:
        """The one of the thread that asks."""
        return self._make()
