"""Convergence: how small the errors are at the end of a run, and the identity behind the last step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .replay import Replay, replay

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Convergence:
    """Largest entries of the errors, over robots and axes.

    S+ comes from S written out, so the identity costs the cube of the number of robots, once per run.

    `final` and `peak` have them at the end and over the whole run, by name: "tracking error" e, "sync error"
    epsilon, "coupled error" e* and "coupled velocity error" r.

    Attributes:
        final, peak: per error.
        identity: largest entry of w - (N e* + S+ epsilon) over the run.
        identity_rounding: what rounding may amount to in it.
        modes: dimension of the null space of S: common motions of the weighted errors that no synchronization
            error sees, and that only e* -> 0 removes.
    """

    final: dict[str, float]
    peak: dict[str, float]
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
        float(gap.max()),
        float(4 * sum(S.shape) * EPS * size.max()),
        round(float(np.trace(N))),
    )


__getattr__ = names_elsewhere(__name__, ".convergence", convergence_of="convergence")
