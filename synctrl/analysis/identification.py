"""What a run could learn about its robots, and what it did learn.

That errors converge says nothing about parameters: they converge only as far as the motion excites them. Near
s' = 0 the controller's balance is Y tilde = D s with the damping D, and adaptation then gives

    tilde_b' = - Gamma_b Y_b^T D^-1 Y_b tilde_b,   Gamma_b = K Gamma K^T

for the base parameters theta_b = K theta. The eigenvalues of Gamma_b^1/2 (int Y_b^T D^-1 Y_b dt) Gamma_b^1/2
are numbers without unit, one per direction: how many times its error had the time to fall by e. What they
support is an estimate, no proof, and nothing else is claimed here about convergence of parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.adaptation.gradient import BoundGradient
from ..errors import InputError
from ..robots.base_parameters import Grouping, grouping
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay

#: a direction counts as learned when its error had the time to fall by e this often
LEARNED = 4.0


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
        lifetimes: how many times the error of each direction had the time to fall by e, (r,), ascending.
    """

    robot: str
    grouping: Grouping
    names: tuple[str, ...]
    torque_error: np.ndarray
    base_error: np.ndarray
    gramian: np.ndarray
    lifetimes: np.ndarray

    @property
    def excitation(self) -> float:
        """Smallest eigenvalue of the Gramian: 0 if some direction was not excited at all."""
        return max(float(np.linalg.eigvalsh(self.gramian)[0]), 0.0)

    @property
    def learned(self) -> int:
        """Number of directions whose error had the time to become small."""
        return int((self.lifetimes >= LEARNED).sum())

    @property
    def supports_convergence(self) -> bool:
        """Whether the excitation of the run supports that all base parameters converge."""
        return self.learned == self.grouping.rank

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
            "supports_convergence": self.supports_convergence,
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
    strength = _integral(result.t, np.einsum("tja,tjk,tkb->tab", Y_b, _compliance(run, i), Y_b))
    root = _root(found.K * _gamma(run)[i, :P] @ found.K.T)
    return Identification(
        cell.names[i],
        found,
        found.names(parameters.names),
        np.matvec(Y, tilde),
        tilde @ found.K.T,
        _integral(result.t, np.einsum("tja,tjb->tab", Y_b, Y_b)),
        np.maximum(np.linalg.eigvalsh(root @ strength @ root), 0.0),
    )


def _gamma(run: Replay) -> np.ndarray:
    """The diagonal Gamma of (14), (n, P).

    Raises:
        InputError: the run has another adaptation, whose lifetimes these are not.
    """
    adaptation = run.loop.controller.adaptation
    if not isinstance(adaptation, BoundGradient):
        found = run.result.info.get("adaptation", {}).get("name", "another")
        raise InputError(
            f"expected a run with the adaptation Gradient, eq. (14), found {found}", subject="result"
        )
    return adaptation.Gamma


def _regressors(run: Replay, i: int) -> np.ndarray:
    """Y at every logged instant, (T, nv, P)."""
    robot, parameters = run.loop.cell.robots[i], run.loop.cell.parameters[i]
    joints = slice(0, robot.nv)
    columns = (run.result.q, run.result.v, run.rows.v_ref[run.logged], run.rows.a_ref[run.logged])
    states = zip(*(np.ascontiguousarray(column[:, i, joints]) for column in columns), strict=True)
    return np.array([parameters.regressor(*state) for state in states])


def _compliance(run: Replay, i: int) -> np.ndarray:
    """D^-1 at every logged instant, (T, nv, nv)."""
    controller, nv = run.loop.controller, run.loop.cell.robots[i].nv
    if controller.k_r_space == "joint":
        return np.broadcast_to(np.diag(1 / controller.K_r[i, :nv]), (len(run.logged), nv, nv))
    J = run.rows.J[run.logged, i][:, :, :nv]
    return np.linalg.pinv(np.einsum("tai,a,taj->tij", J, controller.K_r[i], J), hermitian=True)


def _integral(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.trapezoid(values, t, axis=0)


def _root(A: np.ndarray) -> np.ndarray:
    """Symmetric square root of a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(A)
    return vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
