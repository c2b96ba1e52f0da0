"""The gain condition of the paper's reference acceleration: (18) as printed, and as it should be.

With xref'' as (13) prints it, V' gains sum_i s^T H_x (d(c^-1)/dt) c s, with s = c^-1 r = J s_q and
the inertia in task space H_x = J^-T M J^-1. In the coordinates in which K_r acts this is s^T B s with

    B = H_x (d(c^-1)/dt) c                 K_r in task space
    B = M J^-1 (d(c^-1)/dt) c J            K_r in joint space

so that damping outweighs it for all s if and only if the smallest eigenvalue of K_r - sym(B), the margin,
is above 0. It is if lambda_min(K_r) > lambda_max(sym(B)). What (18) compares with, lambda_max(B), may be
smaller, because B is not symmetric: (18) then holds although V grows. The exact reference acceleration needs
none of this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, finite_array, instance, positive_number
from ..control.controller import Controller
from ..control.gains import spread
from ..coupling.desired import further_rows
from ..errors import InputError
from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay

Margins = tuple[np.ndarray, np.ndarray, np.ndarray]
"""What `margins` gives."""


@dataclass(frozen=True)
class GainCondition:
    """The gain condition where it is tightest, in N·m·s/rad, or N·s/m for K_r in task space.

    Attributes:
        margin: smallest eigenvalue of K_r - sym(B); V' < 0 needs it above 0.
        corrected: lambda_max(sym(B)), to be compared with lambda_min(K_r).
        printed: largest real part of an eigenvalue of B, what (18) compares with lambda_min(K_r).
        K_r_min: lambda_min(K_r) of the robot with the smallest margin.
        robot: index of that robot, counted from 0.
        time: instant of the smallest margin, s.
        q: joint positions there, (nv,), rad.
        needed: whether the controller uses the paper's reference acceleration at all.
    """

    margin: float
    corrected: float
    printed: float
    K_r_min: float
    robot: int
    time: float
    q: tuple[float, ...]
    needed: bool

    @property
    def holds(self) -> bool:
        """Whether K_r - sym(B) is positive definite everywhere."""
        return self.margin > 0

    @property
    def holds_as_printed(self) -> bool:
        """Whether (18) holds at the place of the smallest margin: lambda_min(K_r) >= lambda_max(B)."""
        return self.K_r_min >= self.printed

    def in_words(self) -> str:
        """What it compares, and where."""
        return (
            f"at t = {self.time:g} s has lambda_min(K_r) = {self.K_r_min:.4g} against "
            f"lambda_max(sym(B)) = {self.corrected:.4g} ((18) as printed compares with {self.printed:.4g})"
        )


def rate_matrix(
    M: np.ndarray, c_inv: np.ndarray, c_dot: np.ndarray, J: np.ndarray, J_inv: np.ndarray
) -> np.ndarray:
    """B = M J^-1 (d(c^-1)/dt) c J of K_r in joint space, (..., nv, nv).

    d(c^-1)/dt c = - c^-1 c'. With J_inv^T M for M and identities for J and J_inv it is B in task space.

    Args:
        M: mass matrices, (..., nv, nv).
        c_inv, c_dot: (..., m, m).
        J, J_inv: (..., m, nv) and (..., nv, m).
    """
    return -M @ J_inv @ c_inv @ c_dot @ J


def margins(B: np.ndarray, K_r: np.ndarray) -> Margins:
    """Margin, lambda_max(sym(B)) and the largest real part of an eigenvalue of B.

    Args:
        B: matrices of `rate_matrix`, (..., k, k).
        K_r: diagonal of the damping, (..., k).
    """
    symmetric = 0.5 * (B + np.swapaxes(B, -1, -2))
    slack = K_r[..., :, None] * np.eye(K_r.shape[-1]) - symmetric
    return (
        np.linalg.eigvalsh(slack)[..., 0],
        np.linalg.eigvalsh(symmetric)[..., -1],
        np.linalg.eigvals(B).real.max(axis=-1),
    )


def gain_condition(result: Result | Replay, experiment: Experiment | None = None) -> GainCondition:
    """The gain condition along a run, where it is tightest.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    x, controller = run.rows, run.loop.controller
    found = []
    for i, robot in enumerate(run.loop.cell.robots):
        k = robot.nv
        M, J, J_inv = x.M[:, i, :k, :k], x.J[:, i, :, :k], x.J_inv[:, i, :k]
        c_inv, c_dot = x.c_inv[:, i], x.c_dot[:, i]
        along = M, c_inv, c_dot, J, J_inv
        if not c_dot.any() and all(np.isfinite(each).all() for each in along):
            M, c_inv, c_dot, J, J_inv = (each[:1] for each in along)  # B = 0 at all times
        values = _values(controller, i, M, c_inv, c_dot, J, J_inv)
        row = int(np.argmin(values[0]))
        at = int(np.searchsorted(run.logged, row))
        smallest = [float(value[row]) for value in values]
        found.append(_condition(controller, i, run.result.t[at], run.result.q[at, i, :k], smallest))
    return min(found, key=lambda condition: condition.margin)


def gain_condition_in_box(
    experiment: Experiment,
    lower: ArrayLike,
    upper: ArrayLike,
    duration: float | None = None,
    samples: int = 256,
) -> GainCondition:
    """The smallest margin found in a box of configurations and over a time.

    The box is sampled by a Halton sequence, and the search goes on from the worst samples. What it finds is a
    configuration that exists: the true smallest margin is not larger, and the true suprema are not smaller.

    Args:
        experiment: the cell and its gains.
        lower, upper: corners of the box, (nv,) for every robot or (n, nv), or a number, rad.
        duration: the weights are those of 0 <= t <= duration, s; by default the experiment's.
        samples: number of samples per robot.

    Raises:
        InputError: a box of the wrong size or with lower above upper, or a number that is not positive.
    """
    instance("experiment", experiment, Experiment, "an Experiment")
    count("samples", samples)
    cell = experiment.cell
    corners = {name: finite_array(name, corner) for name, corner in (("lower", lower), ("upper", upper))}
    low, high = (spread(name, corner, (cell.n, cell.nv)) for name, corner in corners.items())
    if (low > high).any():
        raise InputError(
            f"expected lower <= upper, found {low.tolist()} and {high.tolist()}",
            subject="lower, upper",
            found=(low.tolist(), high.tolist()),
        )
    span = positive_number("duration", experiment.duration if duration is None else duration)
    controller, found = experiment.closed_loop().controller, []
    for i, robot in enumerate(cell.robots):
        k, evaluate = robot.nv, _evaluation(controller, i)
        point = _worst(evaluate, np.append(low[i, :k], 0.0), np.append(high[i, :k], span), samples)
        found.append(_condition(controller, i, point[-1], point[:-1], [float(v) for v in evaluate(point)]))
    return min(found, key=lambda condition: condition.margin)


def _evaluation(controller: Controller, i: int) -> Callable[[np.ndarray], Margins]:
    """`_values` of one robot as a function of q and t, one after the other in an array."""
    cell, robot = controller.cell, controller.cell.robots[i]
    space, m = cell.space.bind([robot]), cell.m

    def evaluate(point: np.ndarray) -> Margins:
        (q, t), weights = np.split(point, [-1]), cell.coupling.weights(point[-1:], m)
        further = further_rows(cell.names[i], i, cell.space, cell.members[i].trajectory, t)
        desired = np.concatenate((np.zeros((3, 1, m)), further))
        task = space.measure(np.stack((q[None], np.zeros((1, q.size)))), desired)
        J, J_inv = (np.eye(m),) * 2 if task.J is None or task.J_inv is None else (task.J[0], task.J_inv[0])
        M, c_inv, c_dot = robot.mass_matrix(q), weights.c_inv[0, i], weights.c_dot[0, i]
        return _values(controller, i, M, c_inv, c_dot, J, J_inv)

    return evaluate


def _worst(
    evaluate: Callable[[np.ndarray], Margins], low: np.ndarray, high: np.ndarray, samples: int
) -> np.ndarray:
    """The point of a box with the smallest margin found."""
    from scipy.optimize import minimize
    from scipy.stats.qmc import Halton

    def margin(point: np.ndarray) -> float:
        return float(evaluate(point)[0])

    points = low + (high - low) * Halton(low.size, scramble=False).random(samples)
    points = np.array(sorted(points, key=margin)[:3])
    bounds = list(zip(low, high, strict=True))
    finite = [p for p in points if np.isfinite(margin(p))]
    refined = [minimize(margin, p, method="Nelder-Mead", bounds=bounds).x for p in finite]
    return min([*points, *refined], key=margin)


def _values(
    controller: Controller,
    i: int,
    M: np.ndarray,
    c_inv: np.ndarray,
    c_dot: np.ndarray,
    J: np.ndarray,
    J_inv: np.ndarray,
) -> Margins:
    """`margins` in the coordinates in which K_r acts.

    No K_r in task space bounds the motion that a redundant arm's task does not see: the margin is then minus
    infinity. So it is at a singular Jacobian.
    """
    redundant, in_task = J.shape[-1] > J.shape[-2], controller.k_r_space == "task"
    if in_task:
        M, J, J_inv = np.swapaxes(J_inv, -1, -2) @ M @ J_inv, *2 * (np.eye(J.shape[-2]),)
    B = rate_matrix(M, c_inv, c_dot, J, J_inv)
    if not np.isfinite(B).all():
        return np.array(-np.inf), np.array(np.inf), np.array(np.inf)
    margin, corrected, printed = margins(B, controller.K_r[i, : B.shape[-1]])
    unbounded = redundant and in_task and B.any(axis=(-2, -1))
    return np.where(unbounded, -np.inf, margin), corrected, printed


def _condition(controller: Controller, i: int, t: float, q: np.ndarray, values: list[float]) -> GainCondition:
    size = len(q) if controller.k_r_space == "joint" else controller.cell.m
    K_r_min, needed = float(controller.K_r[i, :size].min()), controller.reference_acceleration == "paper"
    margin, corrected, printed = values
    return GainCondition(margin, corrected, printed, K_r_min, i, float(t), tuple(map(float, q)), needed)


__getattr__ = names_elsewhere(__name__, ".gain_condition", gain_condition_of="gain_condition")
