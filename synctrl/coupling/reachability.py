"""Do desired motions fit their derivatives, and can the robots reach them? Checked before anything runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np

from ..checks import finite_array
from ..errors import InputError, SimulationError, SynctrlError, TrajectoryError, UnreachableError
from ..robots.forest import alike
from ..robots.mechanism import mechanism
from ..robots.robot import Robot
from ..tasks.derivatives import Misfit, difference, find_misfit_in_motion, spread_windows
from ..tasks.following import can_be_followed, follow
from ..tasks.inverse_kinematics import RESTARTS as RESTARTS
from ..tasks.inverse_kinematics import TOLERANCE as TOLERANCE
from ..tasks.inverse_kinematics import find_anywhere
from ..tasks.inverse_kinematics import inverse_kinematics as inverse_kinematics
from ..tasks.inverse_kinematics import reach as reach
from ..tasks.together import EXACT
from ..tasks.trajectories import MOTION_PARTS, Motion
from .cell import Cell
from .together import LENGTH

SAMPLES = 60


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
    for i in _in_doubt(cell, times):
        with suppress(SimulationError):  # a motion that fails ends the run, which hands over what it has
            _follow(cell, i, times)


def _in_doubt(cell: Cell, times: np.ndarray) -> Iterator[int]:
    """Robots of which it is not seen at once, for many of them together, that they can follow their paths."""
    for first in range(0, cell.n, LENGTH):
        robots = range(first, min(first + LENGTH, cell.n))
        yield from robots if not can_be_followed(cell.space) else _among(cell, robots, times)


def _among(cell: Cell, robots: Sequence[int], times: np.ndarray) -> list[int]:
    """`_in_doubt` among some robots."""
    try:
        targets = cell.told_together(robots, times)[0]
        stand = [mechanism(cell.robots[i]) for i in robots]
    except SynctrlError:  # a motion that fails, or a robot without a mechanism: one after another will tell
        return [*robots]
    doubt = []
    for rows in alike(fixed.name for fixed, _ in stand).values():
        fixed, bases = stand[rows[0]][0], [stand[k][1] for k in rows]
        places = np.array([base.rotation for base in bases]), np.array([base.translation for base in bases])
        q0 = cell.q0[robots[0] :][rows, : len(fixed.joints)]
        seen = follow(cell.space, fixed, places, q0, targets[:, rows])
        doubt += [robots[k] for k, well in zip(rows, seen, strict=True) if not well]
    return sorted(doubt)


def _follow(cell: Cell, i: int, times: np.ndarray) -> None:
    """Follow the path of one robot."""
    name, robot = cell.names[i], cell.robots[i]
    q = cell.q0[i, : robot.nv]
    for t, target in zip(times, cell.motion(i, times).x, strict=True):
        found = find_anywhere(robot, target, q, cell.space)  # type: ignore[arg-type]
        if found is None:
            raise _unreachable(name, robot, t, target, cell)
        q = found


def _unreachable(name: str, robot: Robot, t: float, target: np.ndarray, cell: Cell) -> UnreachableError:
    wanted = ", ".join(
        f"{label} = {value:.4g} {unit}"
        for label, value, unit in zip(cell.labels, target, cell.units, strict=True)
    )
    return UnreachableError(
        f"{name} ('{robot.name}') cannot reach its desired position at t = {t:g} s: {wanted}; "
        "expected a path inside the workspace of its tip"
    ).about(f"{name}, trajectory", found=target, time=float(t))


def check_motions(cell: Cell, times: np.ndarray) -> None:
    """Compare the derivatives of all desired motions with differences, between their breaks.

    In `PoseSpace` the velocity is the angular velocity w of R' = [w] R: a space says by its `displacement`
    which way leads from one position to another, if its velocities are no derivatives of its coordinates.
    Coordinates of one unit side by side are taken together. Motions that fit by the formulas that they are,
    see `EXACT`, are not looked at.

    Args:
        cell: the robots and what is desired of them.
        times: instants of the run, (T,), s.

    Raises:
        TrajectoryError: a derivative that is off by more than 2 % of its largest value. The message names the
            robot, the derivative, the time and both values.
    """
    start, stop = float(times[0]), float(times[-1])
    count = int(np.clip(1000 // cell.n, 4, 24))
    for robot in (i for i in range(cell.n) if not _fits_by_itself(cell, i)):
        with suppress(SimulationError):  # a motion that fails ends the run, which hands over what it has
            _check_motion(cell, robot, start, stop, count)


def _fits_by_itself(cell: Cell, robot: int) -> bool:
    """Whether velocity and acceleration are derivatives by the package's own formula for them."""
    return not hasattr(cell.space, "displacement") and type(cell.members[robot].trajectory) in EXACT


def _check_motion(cell: Cell, robot: int, start: float, stop: float, count: int) -> None:
    windows = spread_windows(start, stop, cell.members[robot].trajectory.breaks, count)
    groups = _groups(cell.units)
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
    unit = cell.units[misfit.coordinate]
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
