"""Do desired motions fit their derivatives, and can the robots reach them? Checked before anything runs."""

from __future__ import annotations

from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np

from ..checks import finite_array, instance, offers
from ..errors import InputError, SimulationError, TrajectoryError, UnreachableError
from ..robots.robot import Robot
from ..tasks.derivatives import Misfit, difference, find_misfit_in_motion, spread_windows
from ..tasks.spaces import CartesianSpace, units_of
from ..tasks.trajectories import MOTION_PARTS, Motion
from .cell import Cell

SAMPLES = 60
RESTARTS = 20
TOLERANCE = 1e-6


def check_reachable(cell: Cell, times: np.ndarray) -> None:
    """Follow every desired path by inverse kinematics, in any space that says how far a target is missed.

    Joint limits are not part of this: a path counts as reachable if joint positions for it exist at all.

    Raises:
        UnreachableError: a desired position or pose that the tip does not come within a micrometre (and a
            microradian) of, from the path before it or from twenty other configurations. The message names
            the robot and the time.
    """
    if not hasattr(cell.space, "miss"):
        return
    times = np.unique(times[np.linspace(0, len(times) - 1, SAMPLES).astype(int)])
    for i in range(cell.n):
        with suppress(SimulationError):  # a motion that fails ends the run, which hands over what it has
            _follow(cell, i, times)


def _follow(cell: Cell, i: int, times: np.ndarray) -> None:
    """Follow the path of one robot."""
    name, robot = cell.names[i], cell.robots[i]
    q = cell.q0[i, : robot.nv]
    for t, target in zip(times, cell.motion(i, times).x, strict=True):
        found = inverse_kinematics(robot, target, q, cell.space)
        if found is None:
            raise _unreachable(name, robot, t, target, cell)
        q = found


def inverse_kinematics(
    robot: Robot, target: np.ndarray, q: np.ndarray, space: Any = None
) -> np.ndarray | None:
    """Joint positions, (nv,), that bring the tip to a target, or None if none were found.

    Damped least squares from q, and then from other configurations drawn with a fixed seed. A redundant arm
    stays close to the configuration it started from. Joint limits are not regarded.

    Args:
        robot: the robot.
        target: task coordinates in the world, (m,): a position, m, or a position and a rotation vector.
        q: joint positions to start from, (nv,).
        space: what the coordinates mean, one that offers `miss`; by default the position along x, y, z.

    Raises:
        InputError: no robot, no such space, or numbers of another size or not finite.
    """
    space = CartesianSpace() if space is None else space
    instance("robot", robot, Robot, "a Robot, for example from load_robot")
    offers("space", space, ("miss",), "a CartesianSpace, a PoseSpace or another with `miss`")
    target = finite_array("target", target, (len(space.labels((robot,))),))
    q = finite_array("q", q, (robot.nv,))
    rng = np.random.default_rng(0)
    for _ in range(1 + RESTARTS):
        found = _descend(space, robot, target, q)
        if found is not None:
            return found.copy()
        q = rng.uniform(-np.pi, np.pi, robot.nv)
    return None


def reach(robot: Robot, target: np.ndarray, q: np.ndarray, space: Any = None) -> np.ndarray:
    """`inverse_kinematics` that does not return empty-handed.

    Raises:
        UnreachableError: no joint positions were found.
    """
    found = inverse_kinematics(robot, target, q, space)
    if found is None:
        place = ", ".join(f"{value:.4g}" for value in target)
        failure = UnreachableError(f"'{robot.name}' cannot reach ({place}); expected a place in reach")
        raise failure.about("target", found=tuple(map(float, target)))
    return found


def _descend(space: Any, robot: Robot, target: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """Levenberg-Marquardt: the damping shrinks with every step that helps, and grows otherwise."""
    damping = 1e-6
    error, J = space.miss(robot, target, q)
    for _ in range(60):
        if np.abs(error).max() < TOLERANCE:
            return q
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(error)), error)
        new_error, new_J = space.miss(robot, target, q + step)
        if np.linalg.norm(new_error) < np.linalg.norm(error):
            q, error, J, damping = q + step, new_error, new_J, max(damping / 10, 1e-12)
        else:
            damping *= 10
    return None


def _unreachable(name: str, robot: Robot, t: float, target: np.ndarray, cell: Cell) -> UnreachableError:
    units = units_of(cell.space, cell.m)
    wanted = ", ".join(
        f"{label} = {value:.4g} {unit}" for label, value, unit in zip(cell.labels, target, units, strict=True)
    )
    return UnreachableError(
        f"{name} ('{robot.name}') cannot reach its desired position at t = {t:g} s: {wanted}; "
        "expected a path inside the workspace of its tip"
    ).about(f"{name}, trajectory", found=target.tolist(), time=float(t))


def check_motions(cell: Cell, times: np.ndarray) -> None:
    """Compare the derivatives of all desired motions with differences, between their breaks.

    In `PoseSpace` the velocity is the angular velocity w of R' = [w] R: a space says by its `displacement`
    which way leads from one position to another, if its velocities are no derivatives of its coordinates.
    Coordinates of one unit side by side are taken together.

    Args:
        cell: the robots and what is desired of them.
        times: instants of the run, (T,), s.

    Raises:
        TrajectoryError: a derivative that is off by more than 2 % of its largest value. The message names the
            robot, the derivative, the time and both values.
    """
    start, stop = float(times[0]), float(times[-1])
    count = int(np.clip(1000 // cell.n, 4, 24))
    for robot in range(cell.n):
        with suppress(SimulationError):  # a motion that fails ends the run, which hands over what it has
            _check_motion(cell, robot, start, stop, count)


def _check_motion(cell: Cell, robot: int, start: float, stop: float, count: int) -> None:
    windows = spread_windows(start, stop, cell.members[robot].trajectory.breaks, count)
    groups = _groups(units_of(cell.space, cell.m))
    way = getattr(cell.space, "displacement", difference)
    found = find_misfit_in_motion(lambda t: _motion(cell, robot, t), windows, groups, way)
    if found is not None:
        raise _error(cell, cell.names[robot], *found)


def _groups(units: tuple[str, ...]) -> list[slice]:
    """Coordinates of one unit that stand side by side."""
    borders = [0, *(k for k in range(1, len(units)) if units[k] != units[k - 1]), len(units)]
    return [slice(a, b) for a, b in pairwise(borders)]


def _motion(cell: Cell, robot: int, times: np.ndarray) -> Motion:
    """The motion at some times, known to be numbers."""
    try:
        parts = zip(MOTION_PARTS, cell.motion(robot, times), strict=True)
        return Motion(*(finite_array(part, value, (len(times), cell.m)) for part, value in parts))
    except InputError as error:
        where, end = f"{cell.names[robot]}, trajectory", times.max()
        failure = TrajectoryError(f"{where}, {error}, between t = 0 s and {end:g} s")
        raise failure.about(where, found=error.found) from None


def _error(cell: Cell, name: str, order: int, misfit: Misfit) -> TrajectoryError:
    label = cell.labels[misfit.coordinate]
    unit = units_of(cell.space, cell.m)[misfit.coordinate]
    per = ("/s", "/s^2")[order - 1]
    function, derivative = MOTION_PARTS[order - 1 : order + 1]
    failure = TrajectoryError(
        f"its {derivative} along {label} does not fit its {function}: near "
        f"t = {misfit.time:.6g} s found {misfit.found:.6g} {unit}{per}, but the {function} changes by "
        f"{misfit.expected:.6g} {unit}{per}; expected its derivative, which SmoothTrajectory finds by "
        "itself, or `breaks` where it jumps",
        subject=f"{name}, trajectory",
        found=misfit.found,
    )
    return failure.about(failure.subject, time=misfit.time, derivative=derivative, coordinate=label)
