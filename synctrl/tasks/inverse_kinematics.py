"""From a place of the tip to joint positions: inside the limits where that is possible, else it is said."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any, Protocol

import numpy as np

from ..checks import finite_array, instance
from ..errors import InputError, LimitWarning, UnreachableError, warn
from ..robots.mechanism import joint_limits
from ..robots.model import TURNS
from ..robots.robot import Robot
from .spaces import CartesianSpace

RESTARTS = 20
#: how many of them are compared where a robot may start anywhere
COMPARED = 8
TOLERANCE = 1e-6
#: a position that is beyond a limit by less than this counts as on it, rad or m
ON_LIMIT = 1e-9

Range = tuple[Any, Any]

_EVERYWHERE: Range = (-np.inf, np.inf)


class Missing(Protocol):
    """A space that says how far a robot misses a target."""

    def labels(self, robots: Sequence[Robot]) -> tuple[str, ...]:
        """Names of the m coordinates."""

    def miss(self, robot: Robot, target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error e, (m,), of one robot against a target, (m,), and the J, (m, nv), with e' = -J v."""


def inverse_kinematics(
    robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing | None = None
) -> np.ndarray | None:
    """Joint positions, (nv,), that bring the tip to a target, or None if none were found.

    Damped least squares from q, and then from other configurations drawn with a fixed seed. A redundant arm
    stays close to the configuration it started from. The positions are within the limits that the robot's
    description states, if any such are found. Joints whose range allows it are turned by whole turns to where
    they are closest to q.

    Args:
        robot: the robot.
        target: task coordinates in the world, (m,): a position, m, or a position and a rotation vector.
        q: joint positions to start from, (nv,).
        space: what the coordinates mean, one that offers `miss`; by default the position along x, y, z.

    Raises:
        InputError: no robot, no such space, or numbers of another size or not finite.

    Warns:
        LimitWarning: all positions found are outside the limits.
    """
    space, target, q = _checked(robot, target, q, space)
    bounds = position_range(robot)
    found = _descend(space, robot, target, q, _EVERYWHERE)
    if found is None or not is_within(unwound(robot, found, q), bounds):
        found = _first(_descend(space, robot, target, start, bounds) for start in _starts(q, bounds))
    if found is None:
        found = find_anywhere(robot, target, q, space)
    if found is None:
        return None
    found = unwound(robot, found, q)
    _warn_of_limits(robot, found, bounds)
    return found


def find_anywhere(robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing) -> np.ndarray | None:
    """`inverse_kinematics` whatever the limits, (nv,), or None if none were found."""
    starts = _starts(q, _EVERYWHERE)
    found = _first(_descend(space, robot, target, start, _EVERYWHERE) for start in starts)
    return None if found is None else found.copy()


def reach(robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing | None = None) -> np.ndarray:
    """`inverse_kinematics` that does not return empty-handed.

    Raises:
        UnreachableError: no joint positions were found.
    """
    found = inverse_kinematics(robot, target, q, space)
    if found is None:
        place = ", ".join(f"{value:.4g}" for value in target)
        failure = UnreachableError(
            f"'{robot.name}' cannot reach ({place}); expected a place in reach of its tip"
        )
        raise failure.about("target", found=tuple(map(float, target)))
    return found


def start_in(robot: Robot, target: np.ndarray, space: Missing, posture: np.ndarray | None) -> np.ndarray:
    """Joint positions, (nv,), at a target, for a robot of which nobody said where it starts.

    Those close to the posture; without one, of those found from some seeds within the limits the ones that
    are farthest from a singular configuration.

    Args:
        robot: the robot.
        target: task coordinates, (m,).
        space: what they mean.
        posture: preferred joint positions, (nv,), or None.

    Raises:
        UnreachableError: no joint positions were found.

    Warns:
        LimitWarning: all positions found are outside the limits.
    """
    if posture is not None:
        return reach(robot, target, posture, space)
    bounds = position_range(robot)
    middle = np.mean(_drawn_from(bounds, robot.nv), axis=0)
    found = [_descend(space, robot, target, q, bounds) for q in islice(_starts(middle, bounds), COMPARED)]
    inside = [unwound(robot, q, middle) for q in found if q is not None]
    if not inside:
        return reach(robot, target, middle, space)
    return max(inside, key=lambda q: np.linalg.svd(space.miss(robot, target, q)[1], compute_uv=False)[-1])


# -- limits ------------------------------------------------------------------------------------------------


def position_range(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper limits, (nv,) each, rad or m; infinite where there is none."""
    limits = joint_limits(robot)
    return limits.lower, limits.upper


def is_within(q: np.ndarray, bounds: Range) -> bool:
    """Whether joint positions are within limits."""
    return bool(((q >= bounds[0] - ON_LIMIT) & (q <= bounds[1] + ON_LIMIT)).all())


def unwound(robot: Robot, q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same configuration with joints turned by whole turns to where they are closest to `near`.

    A joint stays within its limits, if whole turns lead there at all; sliding joints stay as they are.
    """
    limits, turn = joint_limits(robot), 2 * np.pi
    least = np.ceil((limits.lower - ON_LIMIT - q) / turn)
    most = np.floor((limits.upper + ON_LIMIT - q) / turn)
    turns = np.clip(np.round((near - q) / turn), least, most)
    return q + turn * np.where((least <= most) & (np.array(robot.joint_units) == TURNS), turns, 0.0)


def _drawn_from(bounds: Range, nv: int) -> tuple[np.ndarray, np.ndarray]:
    """Ranges of positions to begin with, (nv,) each: of the limits no more than half a turn to each side."""
    middle = np.clip(np.zeros(nv), *bounds)
    return np.maximum(bounds[0], middle - np.pi), np.minimum(bounds[1], middle + np.pi)


def _warn_of_limits(robot: Robot, q: np.ndarray, bounds: Range) -> None:
    if is_within(q, bounds):
        return
    beyond = np.maximum(bounds[0] - q, q - bounds[1])
    joint = int(np.argmax(beyond))
    lower, upper = (float(bound[joint]) for bound in bounds)
    warn(
        f"'{robot.name}' reaches its target only beyond the limits of its joints: "
        f"'{robot.joint_names[joint]}' at {q[joint]:.4g}, expected {lower:.4g} to {upper:.4g}",
        LimitWarning,
    )


# -- search ------------------------------------------------------------------------------------------------


def _checked(
    robot: Robot, target: np.ndarray, q: np.ndarray, space: Missing | None
) -> tuple[Missing, np.ndarray, np.ndarray]:
    space = CartesianSpace() if space is None else space
    instance("robot", robot, Robot, "a Robot, for example from load_robot")
    if isinstance(space, type) or not hasattr(space, "miss"):
        raise InputError.expected("a CartesianSpace, a PoseSpace or another with `miss`", space, "space")
    m = len(space.labels((robot,)))
    return space, finite_array("target", target, (m,)), finite_array("q", q, (robot.nv,))


def _starts(q: np.ndarray, bounds: Range) -> Iterator[np.ndarray]:
    """q, and other configurations within the limits, the same ones every time."""
    yield np.clip(q, *bounds)
    rng, (low, high) = np.random.default_rng(0), _drawn_from(bounds, len(q))
    for _ in range(RESTARTS):
        yield rng.uniform(low, high)


def _first(found: Iterator[np.ndarray | None]) -> np.ndarray | None:
    return next((q for q in found if q is not None), None)


def _descend(
    space: Missing, robot: Robot, target: np.ndarray, q: np.ndarray, bounds: Range
) -> np.ndarray | None:
    """Levenberg-Marquardt within bounds: the damping shrinks with every step that helps, and grows otherwise.

    A step that would leave the bounds stops at them.
    """
    damping = 1e-6
    error, J = space.miss(robot, target, q)
    for _ in range(60):
        if np.abs(error).max() < TOLERANCE:
            return q
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(error)), error)
        moved = np.clip(q + step, *bounds)
        new_error, new_J = space.miss(robot, target, moved)
        if np.linalg.norm(new_error) < np.linalg.norm(error):
            q, error, J, damping = moved, new_error, new_J, max(damping / 10, 1e-12)
        else:
            damping *= 10
    return None
