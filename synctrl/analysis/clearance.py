"""Whether a tube of errors stays clear of singular configurations, so that J^-1 exists all along a run.

Three ways, none of which assumes what it shows:

- in joint space J is the identity;
- the tip of two parallel axes with links l_1 and l_2 is singular only at the distances |l_1 - l_2| and
  l_1 + l_2 from the first: the tube has to stay between them;
- any other arm with as many joints as coordinates: let x(q_d) = x_d with the smallest singular value s of J
  there, and H the bound of its derivative by lengths of links. With d = |q - q_d| the error is at least
  s d - H/2 d^2, so that one of at most R < s^2 / (2 H) leaves d either below the first root of
  s d - H/2 d^2 = R or above the second. A robot that starts below the first stays there, and the singular
  values of J are at least s - H d >= (s^2 - 2 H R)^1/2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..coupling.cell import Cell, Reference
from ..robots.link_lengths import column_bounds
from ..robots.model import subspace
from ..robots.robot import Robot
from ..tasks.inverse_kinematics import find_anywhere
from ..tasks.pose import PoseSpace
from ..tasks.spaces import CartesianSpace, JointSpace

#: lengths by which metres are compared with radians, as shares of an arm's reach
SCALES = 0.1, 0.2, 0.4, 0.8
#: instants at which joints are followed along a path that leaves room
FOLLOWED = 1001
#: |Jl^-1(phi) - 1| <= 0.6 |phi| up to half a turn
LOG = 0.6
#: axes are parallel, and positions the same, to this
PARALLEL = 1e-9


class Clearance(NamedTuple):
    """Whether a tube excludes singular configurations.

    Attributes:
        excluded: True, or False; None if there is no way to tell.
        reason: why, in words.
        share: the largest share of the room there is that the tube takes up, below 1 if they are excluded.
    """

    excluded: bool | None
    reason: str
    share: float


def clearance(cell: Cell, told: Reference, radius: np.ndarray) -> Clearance:
    """Whether the tubes of all robots exclude singular configurations.

    Args:
        cell: the robots.
        told: what is desired at some instants.
        radius: bounds of the errors there part by part, (T, n, parts).
    """
    if type(cell.space) is JointSpace:
        return Clearance(True, "in joint space J is the identity", 0.0)
    found = [_clearance(cell, i, told, radius[:, i]) for i in range(cell.n)]
    worst = max(found, key=lambda one: (one.excluded is None, one.share))
    return worst


def _clearance(cell: Cell, i: int, told: Reference, radius: np.ndarray) -> Clearance:
    """The same for one robot."""
    robot, name, space = cell.robots[i], cell.names[i], cell.space
    if type(space) not in (CartesianSpace, PoseSpace):
        return Clearance(None, f"of {type(space).__name__} it is not known where J is singular", np.inf)
    if robot.nv > cell.m:
        free = f"{name} has joints that the task leaves free, of which errors say nothing"
        return Clearance(None, free, np.inf)
    if space.damping is not None:  # type: ignore[attr-defined]
        return Clearance(None, "a damped inverse is outside the theorem", np.inf)
    lengths = two_links(robot, space)
    if lengths is not None:
        return _between(cell, i, told.xd[:, i], radius[:, 0], lengths)
    return _near(cell, i, told, radius)


# -- two links -----------------------------------------------------------------------------------------------


def two_links(robot: Robot, space: Any) -> tuple[float, float] | None:
    """Lengths of the links of an arm of two parallel axes that moves in the plane of the task; else None."""
    model, tip = robot.model, robot.model.frames[robot.tip_id]
    chain = list(model.supports[tip.parentJoint])
    if robot.nv != 2 or not isinstance(space, CartesianSpace) or chain != [0, 1, 2]:
        return None
    first, second = (subspace(model, joint)[3:] for joint in (1, 2))
    place, base = model.jointPlacements[2], model.jointPlacements[1]
    up = base.rotation @ first
    flat = np.abs(up[space.rows]).max() < PARALLEL and first.any() and second.any()
    if not flat or np.linalg.norm(np.cross(first, place.rotation @ second)) > PARALLEL:
        return None
    offsets = zip((first, second), (place.translation, tip.placement.translation), strict=True)
    l_1, l_2 = (float(np.linalg.norm(np.cross(axis, offset))) for axis, offset in offsets)
    return l_1, l_2


def _between(
    cell: Cell, i: int, path: np.ndarray, radius: np.ndarray, lengths: tuple[float, float]
) -> Clearance:
    """Whether a tip stays between the circles on which two links are stretched or folded."""
    axis = cell.robots[i].model.jointPlacements[1].translation[cell.space.rows]  # type: ignore[attr-defined]
    distance = np.linalg.norm(path - axis, axis=-1)
    inner, outer = abs(lengths[0] - lengths[1]), sum(lengths)
    room = np.minimum(distance - inner, outer - distance)
    k = int(np.argmin(room - radius))
    share = float(radius[k] / room[k]) if room[k] > 0 else np.inf
    words = f"{cell.names[i]} is singular {inner:.4g} and {outer:.4g} m from its first axis"
    return Clearance(
        share < 1, f"{words}, and its tube of {radius[k]:.4g} m has {room[k]:.4g} m of room", share
    )


# -- any arm -------------------------------------------------------------------------------------------------


class Along(NamedTuple):
    """An arm along its desired path, where it is nearest to a singular configuration.

    Attributes:
        room, size: s^2 / (2 H) there and R, m, or rad with positions over `scale`.
        scale: of those tried the one that leaves most room, m.
        time: of that instant, s.
        jumps: whether joint positions from instant to instant may be on different branches.
        elsewhere: whether the start is beyond the second root.
    """

    room: float
    size: float
    scale: float
    time: float
    jumps: bool
    elsewhere: bool


def _near(cell: Cell, i: int, told: Reference, radius: np.ndarray) -> Clearance:
    """Whether joints stay so near those of the desired path that J keeps its inverse."""
    name, times = cell.names[i], told.t
    found = _along(cell, i, times, told.xd[:, i], radius)
    if found is not None and found.size < found.room:  # only then does it matter what is in between
        times = np.union1d(times, np.linspace(times[0], times[-1], FOLLOWED))
        between = np.array([np.interp(times, told.t, part) for part in radius.T]).T
        found = _along(cell, i, times, cell.motion(i, times).x, between)
    if found is None:
        return Clearance(None, f"no joint positions were found along the path of {name}", np.inf)
    if found.size < found.room and (found.jumps or found.elsewhere):
        words = "joint positions jump along the path" if found.jumps else "the start is on another branch"
        return Clearance(None, f"{words} of {name}", np.inf)
    unit, scale = ("m", "") if radius.shape[-1] == 1 else ("rad", f", with {found.scale:.2g} m for 1 rad")
    words = f"{name} may be singular from errors of {found.room:.3g} {unit}{scale}, at t = {found.time:.3g} s"
    share = found.size / found.room if found.room > 0 else np.inf
    return Clearance(share < 1, f"{words}, and its tube allows {found.size:.3g} {unit}", share)


def _along(cell: Cell, i: int, times: np.ndarray, path: np.ndarray, radius: np.ndarray) -> Along | None:
    """The same at some instants, in the unit of positions in which it has most room."""
    robot, followed = cell.robots[i], _followed(cell, i, path)
    if followed is None:
        return None
    (q, J), reach = followed, column_bounds(robot).linear.max()
    tried = {scale * reach: _room(robot, J, radius, scale * reach) for scale in SCALES}
    scale = max(tried, key=lambda each: float((tried[each][0] / tried[each][1]).min()))
    room, size, H, s = tried[scale]
    k, away = int(np.argmin(room / size)), float(np.linalg.norm(cell.q0[i, : robot.nv] - q[0]))
    jumps = bool((np.linalg.norm(np.diff(q, axis=0), axis=-1) * H >= s[1:]).any())
    beyond = away * H >= s[0] + float(np.sqrt(max(s[0] ** 2 - 2 * H * size[0], 0.0)))
    unit = scale if radius.shape[-1] == 1 else 1.0
    return Along(float(unit * room[k]), float(unit * size[k]), scale, float(times[k]), jumps, beyond)


def bend(robot: Robot, scale: float, m: int) -> tuple[np.ndarray, float]:
    """Units of the m coordinates, (m,), and H: by how much a tip's way bends at most, in these units.

    H is the norm of a matrix of bounds of second derivatives. Of an orientation, phi' differs from the
    angular velocity by at most `LOG` |phi| times it, and |phi| is at most what the joints have turned.

    Args:
        robot: the robot.
        scale: unit of positions, m; that of orientations is 1 rad.
        m: number of coordinates, 6 of poses.
    """
    columns = column_bounds(robot)
    bending = columns.bending / scale
    if m > 3:
        turning = columns.turning + LOG * np.outer(columns.angular, columns.angular)
        bending = np.hypot(bending, turning)
    return np.repeat([scale, 1.0], 3)[:m], float(np.linalg.norm(bending, 2))


def _room(
    robot: Robot, J: np.ndarray, radius: np.ndarray, scale: float
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """s^2 / (2 H) and R at all instants, H, and s at all instants, with positions in units of `scale`."""
    units, H = bend(robot, scale, J.shape[1])
    s = np.linalg.svd(J / units[:, None], compute_uv=False)[:, -1]
    return s**2 / (2 * H), np.linalg.norm(radius / units[::3], axis=-1), H, s


def _followed(cell: Cell, i: int, path: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Joint positions along the desired path, from the start on, (T, nv), and J there, (T, m, nv)."""
    robot, space = cell.robots[i], cell.space
    q, found = cell.q0[i, : robot.nv], []
    for target in path:
        moved = find_anywhere(robot, target, q, space)  # type: ignore[arg-type]
        if moved is None:
            return None
        q = moved
        found.append((q, space.miss(robot, target, q)[1]))  # type: ignore[attr-defined]
    return np.array([q for q, _ in found]), np.array([J for _, J in found])
