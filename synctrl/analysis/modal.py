"""What becomes of r in a run, mode by mode of S^T S: bounds of weighted errors beside what they were.

`modal_filter.py` has the filter from r_j to w_j. Its norms, `gain` and `h2`, bound w_j by rho_j, the L2 norm
of r_j up to now:

    |w_j| <= gain rho_j + |free_j|,   |w_j(t)| <= |free_j(t)| + h2 rho_j(t),   |eps_j| = sqrt(lambda_j) |w_j|,

with `free` the response to w(0) and to integrals that do not start at 0. That holds with the r of true sigma
and E, whatever the robots were told. Before r is known, r = c J s_q and X^2 = int sum s_q^T K_r s_q give

    rho_j <= kappa_j X,   kappa_j^2 = sup sum_i q_ij^2 |row of c_i J_i K_r^-1/2|^2,

with the row of the axis. What r has beyond c J s_q is measured, and added to that as `gap`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .balance import accumulated
from .dissipation import dissipation
from .in_words import InWords, units_in_words
from .modal_filter import ModalFilter
from .modal_signals import run_signals, slip_matrices
from .replay import Replay, replay

#: share of the largest bound below which another says nothing
ROUNDING = 1e-9
#: what the second bound is
PRIORI = "; a priori: with what Theorem A knows of r before it"


@dataclass(frozen=True, eq=False)
class Bounded:
    """Something that was bounded, and what it was; one number per mode and axis, (n, m), or per robot, (n,).

    Attributes:
        actual: what it was in the run.
        bound: with the r of the run.
        a_priori: with a bound of X instead of r; None where no bound of X is known.
    """

    actual: np.ndarray
    bound: np.ndarray
    a_priori: np.ndarray | None

    @property
    def share(self) -> np.ndarray:
        """actual/bound; 0 where both are rounding of what the others are."""
        moved = self.bound > ROUNDING * self.bound.max()
        return np.where(moved, self.actual / np.where(moved, self.bound, 1.0), 0.0)

    def as_dict(self) -> dict[str, Any]:
        a_priori = None if self.a_priori is None else self.a_priori.tolist()
        return {"actual": self.actual.tolist(), "bound": self.bound.tolist(), "a_priori": a_priori}


@dataclass(frozen=True, eq=False, repr=False)
class ModalBounds(InWords):
    """Bounds of w_j beside w_j, n modes, m axes, T logged instants; w in the unit of c e.

    Attributes:
        title: of the run.
        t: (T,), s.
        filter: from r_j to w_j, with its `gain`, `h2` and `static`, (n, m) each.
        axes, names: of the task coordinates, and of the robots.
        unit, units: of w; all that occur, and that of each axis.
        error_unit: of e, all that occur.
        w: modal errors of the run, (T, n, m).
        r: modal coupled velocity errors, of true sigma and E, (T, n, m), in the unit of w per s.
        free: what the modal errors would be without r, (T, n, m).
        rho: |r_j| over [0, t], (T, n, m).
        kappa: sup |c_i J_i K_r^-1/2| over robots and run.
        kappas: the same for one mode and axis, (n, m).
        X: sqrt(int sum s_q^T K_r s_q), or with J s_q for s_q where K_r acts in task space.
        X_bound: bound of X by Theorem A, see `dissipation.py`, or None where it does not reach the run.
        gap: L2 norm of what r_j has beyond c J s_q, (n, m); rounding if `reason` is None.
        l2: L2 norm of w_j over the run, (n, m).
        peak: sup |w_j|, (n, m).
        errors: sup |e_i|, (n,), of all axes together; of poses that is metres beside radians.
        reason: why r is not c J s_q, in words, or None.
        unbounded: why Theorem A does not reach the run, in words, or None.
        unresolved: why integrals over the log are not to be trusted, in words, or None.
    """

    title: str
    t: np.ndarray
    filter: ModalFilter
    axes: tuple[str, ...]
    names: tuple[str, ...]
    unit: str
    units: tuple[str, ...]
    error_unit: str
    w: np.ndarray
    r: np.ndarray
    free: np.ndarray
    rho: np.ndarray
    kappa: float
    kappas: np.ndarray
    X: float
    X_bound: float | None
    gap: np.ndarray
    l2: Bounded
    peak: Bounded
    errors: Bounded
    reason: str | None
    unbounded: str | None
    unresolved: str | None = None

    @property
    def rho_a_priori(self) -> np.ndarray | None:
        """Bound of |r_j| that knows X_bound instead of r, (n, m), where one is known."""
        return None if self.X_bound is None else self.kappas * self.X_bound + self.gap

    @property
    def differences(self) -> np.ndarray:
        """sqrt(lambda_j), (n,): |eps_j| is that times |w_j|."""
        return np.sqrt(self.filter.eigenvalues)

    @property
    def sentence(self) -> str:
        """What beta does to the gains from r, in words."""
        return self.filter.sentence

    def as_dict(self) -> dict[str, Any]:
        """The same as plain numbers, words and lists, without the arrays over time."""
        norms = {name: getattr(self.filter, name).tolist() for name in ("gain", "h2", "static")}
        return {
            "title": self.title,
            "eigenvalues": self.filter.eigenvalues.tolist(),
            **norms,
            "rho": self.rho[-1].tolist(),
            "gap": self.gap.tolist(),
            "kappa": self.kappa,
            "X": self.X,
            "X_bound": self.X_bound,
            **{name: getattr(self, name).as_dict() for name in ("l2", "peak", "errors")},
            "reason": self.reason,
            "unbounded": self.unbounded,
            "unresolved": self.unresolved,
            "sentence": self.sentence,
        }

    def __str__(self) -> str:
        lines = [f"{self.title}: {self.sentence}"]
        lines.append("  at most: with the r of this run" + PRIORI * (self.peak.a_priori is not None))
        for j, value in enumerate(self.filter.eigenvalues):
            for a, axis in enumerate(self.axes):
                gain = f"gain {self.filter.gain[j, a]:.4g} s"
                told = _row(self.peak, (j, a), self.units[a])
                lines.append(f"  mode {j + 1}, lambda {value:.4g}, {axis}: {gain}, sup |w| {told}")
        for i, name in enumerate(self.names):
            lines.append(f"  {name}: sup |e| {_row(self.errors, (i,), self.error_unit)}")
        if self.reason is not None:
            lines.append(f"  r is more than c J s_q, by what was measured: {self.reason}")
        if self.unbounded is not None:
            lines.append(f"  nothing is known a priori: {self.unbounded}")
        if self.unresolved is not None:
            lines.append(f"  {self.unresolved}")
        return "\n".join(lines)


def modal_bounds(result: Result | Replay, experiment: Experiment | None = None) -> ModalBounds:
    """Bounds of the weighted errors in every mode of S^T S and axis, beside what they were in a run.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result; an event that moves
            positions at once.
    """
    run = replay(result, experiment)
    signals, slip, modes = run_signals(run), dissipation(run), ModalFilter.of(run.loop.controller)
    result = run.result
    w, E, r, driven = (modes.to_modes(rows) for rows in signals[:4])
    free = modes.free(result.t - result.t[0], w[0], E[0])
    rho, gap = np.sqrt(_grown(run, r**2)), np.sqrt(_grown(run, (r - driven) ** 2)[-1])
    kappa, kappas = _kappas(run, modes)
    X_bound = slip.X_bound if slip.reason is None else None
    ahead = None if X_bound is None else kappas * X_bound + gap
    total = None if X_bound is None else kappa * X_bound + float(np.linalg.norm(gap))
    norm, peak = modes.free_norm(w[0], E[0]), np.abs(free)
    l2 = Bounded(np.sqrt(_grown(run, w**2)[-1]), norm + modes.gain * rho[-1], _sum(norm, modes.gain, ahead))
    largest = (peak + modes.h2 * rho).max(axis=0), _sum(peak.max(axis=0), modes.h2, ahead)
    return ModalBounds(
        str(result.info["title"]), result.t, modes, tuple(result.info["axes"]), tuple(result.names),
        result.unit("coupled_error"), result.units("coupled_error")[0], result.unit("tracking_error"),
        w[run.logged], r[run.logged], free, rho, kappa, kappas,
        slip.X, X_bound, gap, l2, Bounded(np.abs(w).max(axis=0), *largest),
        _errors(run, modes, free, rho, total, ahead), signals.reason, slip.reason, slip.unresolved,
    )  # fmt: skip


def _sum(free: np.ndarray, gain: np.ndarray, rho: np.ndarray | None) -> np.ndarray | None:
    """free + gain rho, where a rho is known."""
    return None if rho is None else free + gain * rho


def _grown(run: Replay, rate: np.ndarray) -> np.ndarray:
    """Integral of what is not below 0, which a spline through it may be, (T, ...)."""
    return np.maximum.accumulate(np.maximum(accumulated(run, rate), 0.0))


def _kappas(run: Replay, modes: ModalFilter) -> tuple[float, np.ndarray]:
    """sup |c_i J_i K_r^-1/2|, and the same for every mode and axis, (n, m)."""
    ways = slip_matrices(run)
    sizes = np.einsum("ij,ria->rja", modes.vectors**2, (ways**2).sum(axis=-1))
    return float(np.linalg.norm(ways, 2, axis=(-2, -1)).max()), np.sqrt(sizes.max(axis=0))


def _errors(
    run: Replay,
    modes: ModalFilter,
    free: np.ndarray,
    rho: np.ndarray,
    total: float | None,
    ahead: np.ndarray | None,
) -> Bounded:
    """sup |e_i| <= sup |c_i^-1| (|free_i(t)| + |sum_j |q_ij| h2_j rho_j(t)|).

    A priori each |r_j| is at most `ahead`, and all of them together at most `total`, of which a robot gets
    h_i^2 = sum_j q_ij^2 h2_j^2 of the axis with the largest: the smaller bound counts.
    """
    c_inv, w = run.rows.c_inv[run.logged], run.rows.weighted[run.logged, 0]
    inverse, apart = np.linalg.norm(c_inv, 2, axis=(-2, -1)), np.linalg.norm(modes.vectors @ free, axis=-1)
    h = np.sqrt(modes.vectors**2 @ modes.h2**2)

    def pushed(rho: np.ndarray) -> np.ndarray:
        """What rho of all modes and axes, (..., n, m), makes of every robot's w at most, (..., n)."""
        return np.linalg.norm(np.abs(modes.vectors) @ (modes.h2 * rho), axis=-1)

    def largest(pushed: np.ndarray) -> np.ndarray:
        return (inverse * (apart + pushed)).max(axis=0)

    e, a_priori = np.linalg.norm(np.matvec(c_inv, w), axis=-1).max(axis=0), None
    if ahead is not None and total is not None:
        a_priori = largest(np.minimum(pushed(ahead), h.max(axis=-1) * total))
    return Bounded(e, largest(pushed(rho)), a_priori)


def _row(bounded: Bounded, at: tuple[int, ...], unit: str) -> str:
    """One of the numbers with its bounds, in words."""
    ahead = "" if bounded.a_priori is None else f", a priori {bounded.a_priori[at]:.3g}"
    return f"{bounded.actual[at]:.3g}, at most {bounded.bound[at]:.3g}{ahead} {units_in_words(unit)}"
