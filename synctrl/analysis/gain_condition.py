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

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, instance, positive_number
from ..errors import InputError
from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay


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


def margins(B: np.ndarray, K_r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
    x, loop = run.rows, run.loop
    found = []
    for i, robot in enumerate(loop.cell.robots):
        k = robot.nv
        M, J, J_inv = x.M[:, i, :k, :k], x.J[:, i, :, :k], x.J_inv[:, i, :k]
        values = _values(
            loop.controller.k_r_space, loop.controller.K_r[i], M, x.c_inv[:, i], x.c_dot[:, i], J, J_inv
        )
        row = int(np.argmin(values[0]))
        instant = int(np.searchsorted(run.logged, row))
        place = float(run.result.t[instant]), run.result.q[instant, i, :k]
        found.append(_condition(run.experiment, i, place, [float(value[row]) for value in values]))
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
        lower, upper: corners of the box, (nv,) for every robot or (n, nv), rad.
        duration: the weights are those of 0 <= t <= duration, s; by default the experiment's.
        samples: number of samples per robot.

    Raises:
        InputError: a box of the wrong size or with lower above upper, or a number that is not positive.
    """
    instance("experiment", experiment, Experiment, "an Experiment")
    instance("samples", samples, (int, np.integer), "a whole number")
    positive_number("samples", samples)
    cell = experiment.cell
    low, high = (_corner(name, corner, cell) for name, corner in (("lower", lower), ("upper", upper)))
    if (low > high).any():
        raise InputError(
            f"expected lower <= upper, found {low.tolist()} and {high.tolist()}", subject="lower, upper"
        )
    span = positive_number("duration", experiment.duration if duration is None else duration)
    found = []
    for i, robot in enumerate(cell.robots):
        k = robot.nv
        evaluate = _Evaluation(experiment, i)
        point = evaluate.worst(np.append(low[i, :k], 0.0), np.append(high[i, :k], span), samples)
        values = [float(value) for value in evaluate(point)]
        found.append(_condition(experiment, i, (float(point[-1]), point[:-1]), values))
    return min(found, key=lambda condition: condition.margin)


class _Evaluation:
    """Margins of one robot at (q, t)."""

    def __init__(self, experiment: Experiment, i: int):
        cell, self._i = experiment.cell, i
        self._robot, self._coupling, self._m = cell.robots[i], cell.coupling, cell.m
        controller = experiment.closed_loop().controller
        self._task, self._space = cell.space.bind([self._robot]), controller.k_r_space
        self._K_r = controller.K_r[i]

    def __call__(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q, t = point[:-1], point[-1:]
        weights = self._coupling.weights(t, self._m)
        motion = np.stack((q[None], np.zeros((1, q.size))))
        task = self._task.measure(motion, np.zeros((3, 1, self._m)))
        J, J_inv = (
            (np.eye(self._m),) * 2 if task.J is None or task.J_inv is None else (task.J[0], task.J_inv[0])
        )
        c_inv, c_dot = weights.c_inv[0, self._i], weights.c_dot[0, self._i]
        return _values(self._space, self._K_r, self._robot.mass_matrix(q), c_inv, c_dot, J, J_inv)

    def margin(self, point: np.ndarray) -> float:
        return float(self(point)[0])

    def worst(self, low: np.ndarray, high: np.ndarray, samples: int) -> np.ndarray:
        """The point of the box with the smallest margin found."""
        from scipy.optimize import minimize
        from scipy.stats.qmc import Halton

        points = low + (high - low) * Halton(low.size, scramble=False).random(samples)
        points = np.array(sorted(points, key=self.margin)[:3])
        refined = [
            minimize(self.margin, p, method="Nelder-Mead", bounds=list(zip(low, high, strict=True))).x
            for p in points
            if np.isfinite(self.margin(p))
        ]
        return min([*points, *refined], key=self.margin)


def _values(
    space: str,
    K_r: np.ndarray,
    M: np.ndarray,
    c_inv: np.ndarray,
    c_dot: np.ndarray,
    J: np.ndarray,
    J_inv: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`margins` in the coordinates in which K_r acts.

    No K_r in task space bounds the motion that a redundant arm's task does not see: the margin is then minus
    infinity. So it is at a singular Jacobian.
    """
    redundant = J.shape[-1] > J.shape[-2]
    if space == "task":
        M, J, J_inv = np.swapaxes(J_inv, -1, -2) @ M @ J_inv, *2 * (np.eye(J.shape[-2]),)
    B = rate_matrix(M, c_inv, c_dot, J, J_inv)
    if not np.isfinite(B).all():
        return np.array(-np.inf), np.array(np.inf), np.array(np.inf)
    margin, corrected, printed = margins(B, K_r[: B.shape[-1]])
    unbounded = redundant and space == "task" and B.any(axis=(-2, -1))
    return np.where(unbounded, -np.inf, margin), corrected, printed


def _condition(
    experiment: Experiment, robot: int, place: tuple[float, np.ndarray], values: list[float]
) -> GainCondition:
    margin, corrected, printed = values
    controller = experiment.closed_loop().controller
    K_r = controller.K_r[robot]
    size = experiment.cell.robots[robot].nv if controller.k_r_space == "joint" else experiment.cell.m
    time, q = place
    return GainCondition(
        margin, corrected, printed, float(K_r[:size].min()), robot, time, tuple(map(float, q)),
        controller.reference_acceleration == "paper",
    )  # fmt: skip


def _corner(name: str, corner: ArrayLike, cell: object) -> np.ndarray:
    shape = cell.n, cell.nv  # type: ignore[attr-defined]
    array = finite_array(name, corner)
    if array.shape not in (shape, shape[1:]):
        raise InputError(f"expected shape {shape[1:]} or {shape}, found {array.shape}", subject=name)
    return np.broadcast_to(array, shape)


__getattr__ = names_elsewhere(__name__, ".gain_condition", gain_condition_of="gain_condition")
