"""What is desired at some instants, asked of functions that users wrote: whatever fails in them is named.

Before a run, its weights are followed: do they keep their inverse, and do their derivatives belong to them?
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..errors import CouplingError, NonFiniteError, SynctrlError, failed
from ..tasks.derivatives import find_misfit_in_motion, spread_windows
from ..tasks.trajectories import MOTION_PARTS, Motion, Trajectory
from .weights import DERIVATIVES, ConstantWeights, FunctionWeights, Weights, WeightSource

Found = TypeVar("Found")
#: times, (T,), and m -> weights
WeightsAt = Callable[[np.ndarray, int], Weights]


def desired_motion(name: str, robot: int, trajectory: Trajectory, times: np.ndarray) -> Motion:
    """Desired motion of a robot at some times, (T,).

    Args:
        name: of the robot.
        robot: its index, counted from 0.
        trajectory: its desired motion.
        times: (T,), s.

    Raises:
        SynctrlError: what the trajectory itself raises of this kind.
        SimulationError: it raises anything else; with robot and time.
        NonFiniteError: it is infinite or not a number; with robot and time.
    """

    def call(at: np.ndarray) -> Motion:
        x, x_dot, x_ddot = trajectory(at)
        return Motion(x, x_dot, x_ddot)

    what = f"the desired motion of {name}"
    motion = _asked(call, times, what, robot)
    for part, value in zip(MOTION_PARTS, motion, strict=True):
        _check_finite(what, f"its {part}", value, times, robot, "motion")
    return motion


def further_rows(name: str, robot: int, space: Any, trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """What a space asks of a desired motion beside xd, xd' and xd'', (k, T, m), at some times, (T,).

    Args:
        name, robot, trajectory, times: see `desired_motion`.
        space: one with `further`, see `Space`; of another it is nothing, k = 0.

    Raises:
        SynctrlError, SimulationError, NonFiniteError: see `desired_motion`.
    """
    if not hasattr(space, "further"):
        return np.zeros((0, len(times), trajectory.dimension))
    what = f"what slides with {name}"
    rows = _asked(lambda at: space.further(trajectory, at), times, what, robot)
    for row in rows:
        _check_finite(what, "it", row, times, robot, "motion")
    return rows


def rows_of(space: Any) -> int:
    """How many rows what is desired in a space has: 3, and 3 further ones where it asks for these."""
    return 6 if hasattr(space, "further") else 3


def desired_weights(weights: WeightsAt, times: np.ndarray, m: int) -> Weights:
    """Weights of a coupling at some times, (T,), s, for a task of dimension m.

    Raises:
        SynctrlError, SimulationError, NonFiniteError: see `desired_motion`.
    """
    found = _asked(lambda at: weights(at, m), times, "the weights of the coupling", None)
    for name, value in zip(DERIVATIVES, found, strict=False):
        wrong = ~np.isfinite(value).all(axis=(0, 2, 3))
        for i in np.flatnonzero(wrong)[:1].tolist():
            _check_finite(f"{name} of the robot at index {i}", "it", value[:, i], times, i, "weights")
    return found


def weights_by_clocks(weights: WeightsAt, times: np.ndarray, m: int, clocks: np.ndarray) -> Weights:
    """`desired_weights` for robots whose clocks are ahead by so much, (n,), s: each has those of its time."""
    if not clocks.any():
        return desired_weights(weights, times, m)
    each = [desired_weights(weights, times + ahead, m) for ahead in clocks.tolist()]
    rows = zip(*each, strict=True)  # c of all robots at the time of each of them, then c', c'' and c^-1
    return Weights(*(np.stack([x[:, i] for i, x in enumerate(row)], axis=1) for row in rows))


def _asked(call: Callable[[np.ndarray], Found], times: np.ndarray, what: str, robot: int | None) -> Found:
    """What a function of the user's gives at some times, (T,), s; `what` names it in messages."""
    try:
        return call(times)
    except SynctrlError:
        raise
    except Exception as error:
        raise failed(what, _first_failure(call, times), error, robot) from error


def _first_failure(call: Callable[[np.ndarray], Any], times: np.ndarray) -> float:
    """The first of the times at which a call fails; the first of all if it only fails for many at once."""
    for t in np.unique(times):
        try:
            call(np.array([t]))
        except Exception:
            return float(t)
    return float(times.min())


def _check_finite(what: str, part: str, value: np.ndarray, times: np.ndarray, robot: int, cause: str) -> None:
    """Refuse numbers, (T, ...), that are not finite at one of the times."""
    wrong = ~np.isfinite(value)
    if wrong.any():
        k = int(np.argwhere(wrong)[0][0])
        raise NonFiniteError(
            f"{what} is not finite at t = {times[k]:g} s: {part} is {np.asarray(value)[k].tolist()}; "
            "expected finite numbers at all times of the run",
            time=float(times[k]),
            robot=robot,
            cause=cause,
        ).about(what, found=np.asarray(value)[k])


def check_weights(source: WeightSource, times: np.ndarray, m: int) -> None:
    """Follow the weights through a run before it starts, see `Coupling.check_weights`.

    Between two neighbouring instants c changes by c c^-1 c' Delta t to first order: where an eigenvalue of
    c^-1 c' Delta t reaches 1 in size, c has lost its inverse on the way, even if both instants have one. A
    few hundred instants are looked at.
    """
    instants = int(np.clip(200_000 // source.robots, 200, 2000))  # fewer for many robots
    constant = isinstance(source, ConstantWeights)
    times = np.unique(times[np.linspace(0, len(times) - 1, instants).astype(int)])[: 1 if constant else None]
    c, c_dot, _, c_inv = desired_weights(source.at, times, m)
    if len(times) < 2:
        return
    if isinstance(source, FunctionWeights):
        _check_derivatives(source, float(times[0]), float(times[-1]), m)
    gaps = np.gradient(times)[:, None]
    change = np.abs(np.linalg.eigvals(c_inv @ c_dot).real).max(axis=-1) * gaps
    if change.max() >= 1:
        k, i = np.unravel_index(np.argmax(change), change.shape)
        raise CouplingError(
            f"the weight c of the robot at index {i} loses its inverse near t = {times[k]:g} s, where it is "
            f"{c[k, i].tolist()} and changes at {c_dot[k, i].tolist()} per second"
        ).about("c", robot=int(i), time=float(times[k]))


def _check_derivatives(source: WeightSource, start: float, stop: float, m: int) -> None:
    """Compare c' and c'' with differences of c and c'."""
    n, entries = source.robots, m * m
    groups = [slice(i * entries, (i + 1) * entries) for i in range(n)]
    windows = spread_windows(start, stop, (), int(np.clip(1000 // n, 4, 24)))
    found = find_misfit_in_motion(
        lambda t: [part.reshape(len(t), -1) for part in desired_weights(source.at, t, m)[:3]], windows, groups
    )
    if found is not None:
        order, misfit = found
        i, entry = divmod(misfit.coordinate, entries)
        name, derivative = DERIVATIVES[order - 1 : order + 1]
        raise CouplingError(
            f"{derivative} of the robot at index {i} is not the derivative of {name}: near "
            f"t = {misfit.time:.6g} s entry {divmod(entry, m)} of {name} changes by "
            f"{misfit.expected:.6g} per second, but {derivative} says {misfit.found:.6g}"
        ).about(derivative, robot=i, time=misfit.time)
