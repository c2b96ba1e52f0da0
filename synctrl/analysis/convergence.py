"""What converged in a run: errors, with the identity behind the last step, and what it learned of its robots.

That errors converge says nothing about parameters: they converge only as far as the motion excites them.
What is said here of them is measured: how much of the error of every base parameter, theta_b = K theta, is
left at the end of the run. How fast it will go on falling, and how to choose Gamma, says `exponential_rate`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..renamed import names_elsewhere
from ..robots.base_parameters import Grouping, grouping
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay

EPS = float(np.finfo(float).eps)
#: a base parameter counts as learned when no more than this share of its error is left
LEFT = 0.05
#: part of the run, at its end, over which errors are looked at: one that swings may be 0 at one instant
LATE = 0.1
#: errors at the start below this share of a base parameter's terms count as none
KNOWN = 1e-9


@dataclass(frozen=True)
class Convergence:
    """Largest entries of the errors, over robots and axes.

    S+ comes from S written out, so the identity costs the cube of the number of robots, once per run.

    `final` and `peak` have them at the end and over the whole run, by name: "tracking error" e, "sync error"
    epsilon, "coupled error" e* and "coupled velocity error" r.

    Attributes:
        final, peak: per error.
        units: of each, all that occur.
        identity: largest entry of w - (N e* + S+ epsilon) over the run.
        identity_rounding: what rounding may amount to in it.
        modes: dimension of the null space of S: common motions of the weighted errors that no synchronization
            error sees, and that only e* -> 0 removes.
    """

    final: dict[str, float]
    peak: dict[str, float]
    units: dict[str, str]
    identity: float
    identity_rounding: float
    modes: int

    @property
    def identity_holds(self) -> bool:
        """Whether w = N e* + S+ epsilon to rounding at every instant."""
        return self.identity <= self.identity_rounding


def convergence(result: Result | Replay, experiment: Experiment | None = None) -> Convergence:
    """Errors at the end of a run, and w = N e* + S+ epsilon at every instant.

    w = c e; S+ is the pseudo-inverse of the coupling matrix and N = 1 - S+ S projects on its null space. As
    N S^T = 0, e* -> 0 and epsilon -> 0 give w -> 0, for any coupling; see docs/theory.md.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    result, x, at = run.result, run.rows, run.logged
    errors = {
        "tracking error": result.tracking_error,
        "sync error": x.epsilon[at],
        "coupled error": x.e_star[at],
        "coupled velocity error": x.r[at],
    }
    w = np.matvec(x.c[at], result.tracking_error)
    S = run.loop.cell.coupling.matrix
    S_plus = np.linalg.pinv(S)
    N = np.eye(len(w[0])) - S_plus @ S
    gap = np.abs(w - N @ errors["coupled error"] - S_plus @ errors["sync error"])
    share = np.abs(run.loop.controller.beta * x.E[at])
    # e is a difference of positions, and rounded as these are
    terms = np.abs(w) + np.matvec(np.abs(x.c[at]), np.abs(result.x) + np.abs(result.x_desired))
    size = terms + np.abs(N) @ (terms + share) + np.abs(S_plus) @ (np.abs(S) @ terms)
    return Convergence(
        {name: float(np.abs(error[-1]).max()) for name, error in errors.items()},
        {name: float(np.abs(error).max()) for name, error in errors.items()},
        _units(result),
        float(gap.max()),
        float(4 * sum(S.shape) * EPS * size.max()),
        round(float(np.trace(N))),
    )


def _units(result: Result) -> dict[str, str]:
    """Units of the errors of `Convergence`."""
    arrays = ("tracking_error", "sync_error", "coupled_error")
    found = {name.replace("_", " "): result.unit(name) for name in arrays}
    rates = (f"{unit}/s" for unit in found["coupled error"].split(", "))
    return found | {"coupled velocity error": ", ".join(rates)}


# -- parameters --------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Identification:
    """What a run says about the parameters of one robot, P adapted ones and r base parameters.

    Attributes:
        robot: its name in the cell.
        grouping: which combinations of the adapted parameters its torque depends on at all.
        names: of the base parameters.
        torque_error: Y (theta - theta_hat), what the model's torque lacks, (T, nv), N·m.
        base_error: K (theta - theta_hat), (T, r).
        gramian: int Y_b^T Y_b dt over the run, (r, r).
        wrong: which base parameters were wrong at the start, (r,), bool.
        left: the largest error of each in the last tenth of the run as a share of that at the start, (r,); 0
            where there was none to begin with. A combination may be learned though none of its terms is.
    """

    robot: str
    grouping: Grouping
    names: tuple[str, ...]
    torque_error: np.ndarray
    base_error: np.ndarray
    gramian: np.ndarray
    wrong: np.ndarray
    left: np.ndarray

    @property
    def excitation(self) -> float:
        """Smallest eigenvalue of the Gramian: 0 if some direction was not excited at all."""
        return max(float(np.linalg.eigvalsh(self.gramian)[0]), 0.0)

    @property
    def learned(self) -> int:
        """Number of base parameters that were wrong, and of whose error at most a twentieth is left."""
        return int((self.wrong & (self.left <= LEFT)).sum())

    @property
    def all_learned(self) -> bool:
        """Whether that is said of all base parameters that were wrong, and some were."""
        return 0 < self.learned == self.wrong.sum()

    def as_dict(self) -> dict[str, Any]:
        """The figures a report shows, as plain data."""
        size = np.linalg.norm(self.base_error, axis=1)
        return {
            "robot": self.robot,
            "adapted": self.grouping.K.shape[1],
            "identifiable": self.grouping.rank,
            "condition": self.grouping.condition,
            "excitation": self.excitation,
            "learned": self.learned,
            "wrong": int(self.wrong.sum()),
            "all_learned": self.all_learned,
            "most_left": float(self.left.max(initial=0.0)),
            "torque_error_peak": float(np.abs(self.torque_error).max()),
            "torque_error_end": float(np.abs(self.torque_error[-1]).max()),
            "base_error_start": float(size[0]),
            "base_error_end": float(size[-1]),
        }


def identify(result: Result, experiment: Experiment | None = None) -> tuple[Identification, ...]:
    """Errors of model and parameters along a run, apart from its tracking errors, one entry per robot.

    Args:
        result: the run.
        experiment: what made it; may be left out while the result still knows.

    Raises:
        InputError: the result was loaded from a file and no experiment is given, or another one.
        RobotError: the rank of a regressor is not clear.
    """
    run = replay(result, experiment)
    return tuple(_identify(run, i) for i in range(run.loop.cell.n))


def _identify(run: Replay, i: int) -> Identification:
    cell, result = run.loop.cell, run.result
    robot, parameters = cell.robots[i], cell.parameters[i]
    P = parameters.theta.size
    found = grouping(parameters, robot.nv, cell.names[i])
    Y = _regressors(run, i)
    tilde = parameters.theta - result.theta_hat[:, i, :P]
    Y_b = Y[:, :, found.columns]
    base_error = tilde @ found.K.T
    wrong, left = _left(base_error, np.abs(found.K) @ np.abs(parameters.theta))
    return Identification(
        cell.names[i],
        found,
        found.names(parameters.names),
        np.matvec(Y, tilde),
        base_error,
        np.trapezoid(np.einsum("tja,tjb->tab", Y_b, Y_b), result.t, axis=0),
        wrong,
        left,
    )


def _left(error: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of the base parameters were wrong at the start, (r,), and what is left of errors, (T, r)."""
    start = np.abs(error[0])
    wrong = start > KNOWN * size
    late = np.abs(error[-max(1, int(LATE * len(error))) :]).max(axis=0)
    return wrong, np.divide(late, start, out=np.zeros_like(late), where=wrong)


def _regressors(run: Replay, i: int) -> np.ndarray:
    """Y at every logged instant, (T, nv, P)."""
    robot, parameters = run.loop.cell.robots[i], run.loop.cell.parameters[i]
    joints = slice(0, robot.nv)
    columns = (run.result.q, run.result.v, run.rows.v_ref[run.logged], run.rows.a_ref[run.logged])
    states = zip(*(np.ascontiguousarray(column[:, i, joints]) for column in columns), strict=True)
    return np.array([parameters.regressor(*state) for state in states])


__getattr__ = names_elsewhere(__name__, ".convergence", convergence_of="convergence")
