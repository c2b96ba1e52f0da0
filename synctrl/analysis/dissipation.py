"""Theorem A: what unmodelled torque can do at most, whatever it is.

Along every run V + X^2 + Z^2 = V(0) + int s^T d + what enters otherwise, where

    X^2 = int sum_i s_q^T K_r s_q,    D^2 = int sum_i d^T K_r^-1 d,    Z^2 = int of all else that V' loses,

and d is torque that the model does not know, see `unmodelled.py`. As int s^T d <= X D, with R the largest
energy that enters otherwise

    X <= D/2 + sqrt(D^2/4 + V(0) + R),    Z^2 + V(T) <= V(0) + R + D^2/4.

See docs/theorem_a.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ..control.adaptation.gradient import BoundGradient, MetricGradient
from ..errors import RobotError
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .assumptions import unbounded
from .balance import accumulated
from .base_storage import base_storages
from .gain_condition import gain_condition
from .held import held
from .in_words import InWords
from .lyapunov import damping, inside_of, proof_along
from .metrics import finite_or_none
from .model_torques import frozen_error
from .replay import Replay, replay
from .unmodelled import unmodelled

#: share of the largest from which something is worth a word
SEEN = 1e-9
#: share of what V(0), d and what enters supply at most, by which the balance may miss
COARSE = 1e-2
#: what is in V for the error of the estimates
BASE, OWN = "base parameters", "the adaptation's own"


@dataclass(frozen=True, eq=False, repr=False)
class Dissipation(InWords):
    """The balance of V along a run, and what Theorem A promises of it; N·m if weights have no unit.

    Attributes:
        t: logged instants, (T,), s.
        V: with the errors of base parameters where the adaptation is (14), (T,).
        damped, lost: X^2 and Z^2 until each instant, (T,).
        supply, entering: int s^T d, and what entered otherwise until each instant, (T,).
        acted: D^2 of all unmodelled torque until each instant, (T,).
        sources: D of what each source does alone.
        V0_full: V(0) with the storage of the adaptation, as in a certificate.
        storage: what V has for the error of the estimates: "base parameters" or "the adaptation's own".
        reason: why the theorem does not reach this run, or None; then nothing is promised.
    """

    t: np.ndarray
    V: np.ndarray
    damped: np.ndarray
    lost: np.ndarray
    supply: np.ndarray
    entering: np.ndarray
    acted: np.ndarray
    sources: Mapping[str, float]
    V0_full: float
    storage: str
    reason: str | None = None

    @property
    def V0(self) -> float:  # noqa: N802
        """V at the start."""
        return float(self.V[0])

    @property
    def VT(self) -> float:  # noqa: N802
        """V at the end."""
        return float(self.V[-1])

    @property
    def X(self) -> float:  # noqa: N802
        """Root of the integral of s_q^T K_r s_q over the run."""
        return _root(self.damped)

    @property
    def Z(self) -> float:  # noqa: N802
        """Root of the integral of all else that V' loses."""
        return _root(self.lost)

    @property
    def D(self) -> float:  # noqa: N802
        """Of all unmodelled torque, over the whole run, sqrt(N·m)."""
        return _root(self.acted)

    @property
    def entered(self) -> float:
        """R, the most that entered otherwise than by a torque until any instant."""
        return float(max(self.entering.max(), 0.0))

    @property
    def bound(self) -> np.ndarray:
        """The most that X can be until each instant, (T,); infinite where the theorem does not reach.

        Its square is the most that V + X^2 + Z^2 can be.
        """
        if self.reason is not None:
            return np.full_like(self.t, np.inf)
        D2, R = np.maximum(self.acted, 0.0), np.maximum(np.maximum.accumulate(self.entering), 0.0)
        return np.sqrt(D2) / 2 + np.sqrt(D2 / 4 + self.V0 + R)

    @property
    def X_bound(self) -> float:  # noqa: N802
        """D/2 + sqrt(D^2/4 + V(0) + R); infinite where the theorem does not reach."""
        return float(self.bound[-1])

    @property
    def rest(self) -> float:
        """Z^2 + V(T)."""
        return float(self.lost[-1] + self.V[-1])

    @property
    def rest_bound(self) -> float:
        """V(0) + R + D^2/4; infinite where the theorem does not reach."""
        return float("inf") if self.reason is not None else self.V0 + self.entered + self.D**2 / 4

    @property
    def duration(self) -> float:
        """Time from the first to the last logged instant, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def mean_square(self) -> float:
        """Mean of s_q^T K_r s_q over the run, W; 0 of a single instant."""
        return self.X**2 / self.duration if self.duration else 0.0

    @property
    def mean_square_bound(self) -> float:
        """The most that it can be, W."""
        return self.X_bound**2 / self.duration if self.duration else float("inf")

    @property
    def gap(self) -> np.ndarray:
        """V + X^2 + Z^2 - V(0) - int s^T d - what entered, (T,); 0 but for integration and quadrature."""
        return self.V + self.damped + self.lost - self.V0 - self.supply - self.entering

    @property
    def unresolved(self) -> str | None:
        """Why X and Z are not to be trusted, in words, as of a log that is thinned; else None."""
        gap = float(np.abs(self.gap).max())
        if gap <= COARSE * (self.V0 + self.entered + self.D**2 / 4):
            return None
        return f"the log is too coarse for integrals over it: their balance misses by {gap:.3g}"

    def as_dict(self) -> dict[str, Any]:
        """The same as plain numbers and words, without the arrays over time."""
        names = ("D", "X", "X_bound", "Z", "rest", "rest_bound", "mean_square", "mean_square_bound")
        numbers = {name: finite_or_none(getattr(self, name)) for name in (*names, "V0", "V0_full", "VT")}
        sources = {name: float(value) for name, value in self.sources.items()}
        more = {"entered": self.entered, "supply": float(self.supply[-1]), "storage": self.storage}
        return {**numbers, **more, "sources": sources, "reason": self.reason, "unresolved": self.unresolved}

    @property
    def lines(self) -> list[str]:
        """Bounds beside what they are of, and what the unmodelled torque came from, in words."""
        if self.reason is not None:
            return [f"Theorem A does not reach this run: {self.reason}"]
        floor = SEEN * max(self.X, self.D)
        acting = {name: D for name, D in self.sources.items() if floor < D}
        named = ", ".join(f"{name} {D:.3g}" for name, D in acting.items())
        D = self.D if acting else 0.0  # the rest is rounding
        entered = f", R = {self.entered:.3g} N·m" if self.entered > SEEN * self.V0 else ""
        doubt = [] if self.unresolved is None else [f"  {self.unresolved}"]
        return [
            f"Theorem A: X = {self.X:.3g} of at most {self.X_bound:.3g} sqrt(N·m), Z^2 + V(T) = "
            f"{self.rest:.3g} of at most {self.rest_bound:.3g} N·m",
            f"  by V(0) = {self.V0:.3g} N·m ({self.storage}){entered}, "
            f"D = {D:.3g} sqrt(N·m) ({named or 'nothing'})",
            *doubt,
        ]

    def __str__(self) -> str:
        return "\n".join(self.lines)


def dissipation(result: Result | Replay, experiment: Experiment | None = None) -> Dissipation:
    """What unmodelled torque did along a run, beside the most that it can do.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    return balanced(run, unbounded(run, gain_condition(run)))


def balanced(run: Replay, reasons: Sequence[str]) -> Dissipation:
    """`dissipation` of a run of which it is known why the theorem does not reach it; empty if it does."""
    sampled = run.result.info.get("control_period") is not None and len(run.result.t) > 1
    run, further = held(run) if sampled else (run, {})
    torques, x, (kept, rates, lost) = unmodelled(run, further), run.rows, _law(run)
    total, model = np.sum(list(torques.values()), axis=0), x.lacking - x.frozen
    claimed = lost + _sum(x.s_q * (model - np.vecmat(x.force, x.J)))
    squares = [_squared(run, torque) for torque in (total, *torques.values())]
    losses = [_sum(damping(run)), lost + _sum(x.s_q * x.friction_damping)]
    powers = [*losses, _sum(x.s_q * total), claimed, rates + x.storage_rate, *squares]
    damped, gone, supply, due, stored, D2, *each = accumulated(run, np.stack(powers, axis=1)).T
    own = (kept + x.storage)[run.logged]
    stored = own - own[0] if sampled else stored  # what is held does not follow the rates of the law
    energies = (kept + 0.5 * _sum(x.s_q * np.matvec(x.M, x.s_q)))[run.logged]
    storage, kind = _storage(run)
    return Dissipation(
        run.result.t, energies + storage, damped, gone, supply, stored + due, D2,
        dict(zip(torques, map(_root, each), strict=True)),
        float(energies[0] + x.storage[0]), kind, "; ".join(reasons) or None,
    )  # fmt: skip


def _law(run: Replay) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energies of the law, their rates, and what they lose, (R,) each."""
    proof = proof_along(run)
    inside = inside_of(run, proof)
    known = [power for name, power in proof.powers.items() if name in inside]
    kept, rates, powers = (
        np.zeros(len(run.rows.s_q)) + sum(map(_sum, terms))
        for terms in (proof.energies.values(), proof.rates.values(), known)
    )
    return kept, rates, -powers


def _storage(run: Replay) -> tuple[np.ndarray, str]:
    """V's term for the error of the estimates, (T,), and what it is of."""
    adaptation, cell = run.loop.controller.adaptation, run.loop.cell
    own = run.rows.storage[run.logged], OWN
    if type(adaptation) not in (MetricGradient, BoundGradient):
        return own
    tilde = cell.theta - run.result.theta_hat
    learned = tilde - frozen_error(adaptation, tilde)
    with suppress(RobotError):  # it may not be clear which parameters can be told apart
        storages = base_storages(cell, cast(MetricGradient, adaptation).Gamma)
        return np.sum([each.energy(learned[:, i]) for i, each in enumerate(storages)], axis=0), BASE
    return own


def _squared(run: Replay, torque: np.ndarray) -> np.ndarray:
    """d^T K_r^-1 d, (R,), in the space in which K_r acts."""
    controller = run.loop.controller
    d = torque if controller.k_r_space == "joint" else np.vecmat(torque, run.rows.J_inv)
    K_r = np.broadcast_to(controller.K_r, d.shape)
    return _sum(np.divide(d**2, K_r, out=np.zeros_like(d), where=d != 0))


def _sum(term: np.ndarray) -> np.ndarray:
    """Over all axes but the first."""
    return term.sum(axis=(1, 2))


def _root(square: np.ndarray) -> float:
    return float(np.sqrt(max(square[-1], 0.0)))
