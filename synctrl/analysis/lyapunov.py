"""The proof, watched: V and V' along a run, term by term.

    V  = sum_i 1/2 s_q^T M s_q                       kinetic
       + V_th                                        parameter: 1/2 tilde^T Gamma^-1 tilde for (14)
       + sum_k 1/2 eps_k^T K_eps eps_k               synchronization
       + sum_i 1/2 E_i^T K_eps Lambda beta E_i       integral

    V' = - sum_i s_q^T K_r s_q                       damping
       - sum_k eps_k^T K_eps Lambda eps_k            synchronization rate
       - sum_i sigma_i^T K_eps beta sigma_i          coupling
       - sum_i s_q^T F_v s_q                         friction in Y, where viscous friction F_v is adapted
       + named powers of the adaptation
       + power of what is outside the theorem

with tilde = theta - theta_hat, E = S^T int eps, sigma = S^T eps; (19), (24), (34) and (39) for any coupling.
Synchronization, integral and coupling are the part of the paper's law; another law says by its method `proof`
what its own is.
V' is not taken from that formula: it is the chain rule applied to V with the accelerations of the plant. What
the formula does not explain is the power called "other", and is rounding when the model is complete.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from ..control.laws import DIFFUSION, Along, Proof
from ..control.network import BoundNetwork
from ..renamed import names_elsewhere
from ..simulation.closed_loop import ClosedLoop
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .balance import drift, jumped, supplied
from .jumps import jumps_of_v
from .replay import Replay, replay

#: energies of the paper's law; those of another law stand in place of the last two
ENERGIES = ("kinetic", "parameter", "synchronization", "integral")
#: what the theorem knows of the paper's law; each is at most 0
THEOREM = ("damping", "synchronization rate", "coupling", "friction in Y")
#: what it does not: each may have either sign
OUTSIDE = ("friction", "disturbance", "saturation", "weight rate", "damped inverse", "other")
#: what it knows of a closed chain, beside what fixtures and the object do
GIVING = ("admittance",)
#: the powers of the paper's law; those of the adaptation come beside them
POWERS = THEOREM + OUTSIDE
EPS = float(np.finfo(float).eps)
#: share of the range of V that the numerical error of its balance may have
RESOLVED = 1e-3
#: share of V itself that is rounding
ROUNDED = 1e-12


@dataclass(frozen=True, eq=False)
class Lyapunov:
    """V, N·m if weights have no unit, and V' at the T logged instants, at a jump with values from the right.

    Attributes:
        t: (T,), s.
        energy: terms of V by name, each (T,): "kinetic", "parameter", and the law's; with the paper's law
            those in `ENERGIES`.
        power: terms of V' by name, each (T,): with the paper's law those in `POWERS`, and those of the
            adaptation and of a closed chain, see `assembly/energies.py`. A law without a proof has the power
            of its force here, as "law"; what a network does that is not ideal is "network", where E and
            sigma change otherwise than it told, too.
        rounding: bound of the rounding error of V', (T,).
        drift: V(t) - V(0) - integral of V', (T,), without jumps at events; 0 but for the error of the run and
            of the quadrature.
        drift_bound: what these two errors and rounding may amount to.
        supplied: integral of every power over the run, by name; together the change of V.
        inside: names of the powers that the theorem knows.
        events: instants between which and the next one V jumps: by plant or network, or as xd' jumps.
        jumped: what V gained at jumps, of the state or of the desired velocity, in all: V(T) - V(0) is the
            sum of `supplied`, of this, and of the drift at the end.
        kinked: whether rates of terms jump at messages and their sum does not: `drift_bound` is too large.
    """

    t: np.ndarray
    energy: Mapping[str, np.ndarray]
    power: Mapping[str, np.ndarray]
    rounding: np.ndarray
    drift: np.ndarray
    drift_bound: float
    supplied: Mapping[str, float]
    inside: tuple[str, ...] = THEOREM
    events: tuple[int, ...] = ()
    jumped: float = 0.0
    kinked: bool = False

    @property
    def V(self) -> np.ndarray:  # noqa: N802
        """Sum of the energies, (T,)."""
        return np.sum(list(self.energy.values()), axis=0)

    @property
    def V_dot(self) -> np.ndarray:  # noqa: N802
        """V', the sum of the powers, (T,)."""
        return np.sum(list(self.power.values()), axis=0)

    @property
    def largest_drift(self) -> float:
        """Largest absolute value of `drift`."""
        return float(np.abs(self.drift).max())

    @property
    def closes(self) -> bool:
        """Whether the balance of V closes: all power that enters or leaves V has been accounted for."""
        return self.largest_drift <= self.drift_bound

    @property
    def resolved(self) -> bool:
        """Whether numerical errors are small beside what V did, so that `closes` says something."""
        V, error = self.V, self.largest_drift if self.kinked else self.drift_bound
        return error <= max(RESOLVED * float(np.ptp(V)), ROUNDED * float(V.max()))


def lyapunov(result: Result | Replay, experiment: Experiment | None = None) -> Lyapunov:
    """V and V' at every logged instant of a run.

    The adaptation has its storage in V and powers of its own in V'. Entries of theta that the paper's does
    not adapt (Gamma = 0) have no place in V; their error appears in V' as the power "model error",
    s_q^T Y tilde.

    Args:
        result: the run; or its replay, where one has been made already.
        experiment: what made it; needed for a result loaded from a file.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    run = replay(result, experiment)
    proof = proof_along(run)
    x, summands = run.rows, _summands(run, proof)
    rates = (*map(_sum, summands), x.storage_rate, *x.stored_rate.T)
    power = _power(run, proof, rates)
    energy = {"kinetic": 0.5 * _sum(x.s_q * np.matvec(x.M, x.s_q)), "parameter": x.storage}
    energy |= {name: _sum(term) for name, term in proof.energies.items()}
    energy |= dict(zip(run.stored, x.stored.T, strict=True))
    V, V_dot = (np.sum(list(terms.values()), axis=0) for terms in (energy, power))
    missed, bound = drift(run, rates, V, V_dot)
    return Lyapunov(
        run.result.t,
        {name: term[run.logged] for name, term in energy.items()},
        {name: term[run.logged] for name, term in power.items()},
        operations(run.loop) * EPS * _magnitude(run, summands)[run.logged],
        missed,
        bound + operations(run.loop) * EPS * float(np.max(V)),
        dict(zip(power, supplied(run, np.stack([*power.values()], axis=1)).tolist(), strict=True)),
        inside_of(run, proof),
        jumps_of_v(run.result.t, run.loop.cell, run.events),
        jumped(run, V),
        run.loop.messages.sent and not run.events,
    )


def outside(network: BoundNetwork) -> str | None:
    """What the theorem does not know of a network, in words; None if there is nothing."""
    ask = getattr(network, "outside", None)
    return "no proof is known" if ask is None else ask()


def is_ideal(network: BoundNetwork) -> bool:
    """Whether the proof holds with a network as it stands, without a theorem of its own."""
    return outside(network) is None and getattr(network, "theorem", None) is None


def operations(loop: ClosedLoop) -> int:
    """Roundings behind one entry of V': ten chained sums over joints, axes and parameters."""
    return 10 * (loop.cell.nv + loop.cell.m + loop.cell.theta.shape[1])


# -- terms ------------------------------------------------------------------------------------------------


def proof_along(run: Replay) -> Proof:
    """The law's part in V and V'; nothing of a law that has no proof."""
    x, law = run.rows, cast(Any, run.loop.controller.law)
    along = Along(x.epsilon, x.epsilon_dot, x.E, x.sigma, x.sigma_dot, x.e_star, x.r, x.c, x.slips)
    if not hasattr(law, "proof"):
        return Proof({}, {}, {})
    proof = law.proof(along)
    if not x.E_gap.any():
        return proof
    moves = replace(along, sigma=x.sigma + x.E_gap)  # in rates it stands for E'
    return proof._replace(rates=law.proof(moves).rates)


def inside_of(run: Replay, proof: Proof) -> tuple[str, ...]:
    """Names of the powers that the theorem knows: diffusive coupling only where all is heard at once."""
    ideal = is_ideal(run.loop.controller.network)
    known = (name for name in proof.powers if ideal or name != DIFFUSION)
    return ("damping", *known, "friction in Y", *GIVING)


def damping(run: Replay) -> np.ndarray:
    """s_q^T K_r s_q joint by joint, (R, n, nv), or of J s_q axis by axis where K_r acts in task space."""
    x, controller = run.rows, run.loop.controller
    s = x.s_q if controller.k_r_space == "joint" else np.matvec(x.J, x.s_q)
    return np.asarray(s * controller.K_r * s)


def _summands(run: Replay, proof: Proof) -> tuple[np.ndarray, ...]:
    """Time derivatives of the terms of V but for the adaptation's, joint by joint or axis by axis."""
    x = run.rows
    s_q_dot = x.a_ref + x.gap + reference_gap(run) - x.v_dot
    return x.s_q * (np.matvec(x.M, s_q_dot) + x.C_s), *proof.rates.values()


def _power(run: Replay, proof: Proof, rates: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Terms of V', one value per row; "other" is what `rates` have beyond those with a name."""
    x, controller = run.rows, run.loop.controller
    s, moved = np.matvec(x.c_inv, x.r), np.matvec(x.J, x.s_q)
    in_task = controller.k_r_space == "task"
    unfollowed = x.force - controller.K_r * moved if in_task else x.force  # acts on s where J s_q is meant
    terms = {
        "damping": -damping(run),
        **proof.powers,
        "friction in Y": -x.s_q * x.friction_damping,
        "friction": x.s_q * x.friction,
        "disturbance": -x.s_q * x.disturbance,
        "saturation": x.s_q * x.cut_off,
        "weight rate": x.s_q * np.matvec(x.M, reference_gap(run)),
        "damped inverse": (s - moved) * unfollowed,
    }
    power = {name: _sum(term) for name, term in terms.items()}
    power |= dict(zip((*run.learning, *run.chained), (*x.learning.T, *x.chained.T), strict=True))
    pushed = _sum(s * x.force)  # the rates of the proof less its powers, where it holds
    if not hasattr(controller.law, "proof"):
        power["law"] = -pushed
    elif not is_ideal(controller.network):
        changes, powers = (sum(map(_sum, terms.values())) for terms in (proof.rates, proof.powers))
        power["network"] = changes - powers - pushed + _sum(x.s_q * np.matvec(x.M, x.gap))
    power["other"] = np.sum(rates, axis=0) - np.sum(list(power.values()), axis=0)
    return power


def reference_gap(run: Replay) -> np.ndarray:
    """v_ref' - a_ref, (R, n, nv): 0 when exact, J^-1 d(c^-1)/dt r with the paper's reference acceleration."""
    x = run.rows
    if run.loop.controller.reference_acceleration == "exact":
        return np.zeros_like(x.a_ref)
    return -np.matvec(x.J_inv, np.matvec(x.c_inv, np.matvec(x.c_dot, np.matvec(x.c_inv, x.r))))


def _magnitude(run: Replay, summands: Sequence[np.ndarray]) -> np.ndarray:
    """Sum of the magnitudes of all that is added up to V', from which its rounding follows, (R,)."""
    x, controller = run.rows, run.loop.controller
    condition = np.linalg.norm(x.J, axis=(-2, -1)) * np.linalg.norm(x.J_inv, axis=(-2, -1))
    size = np.abs(x.s_q) + np.abs(x.v_ref) + np.abs(x.v)
    inertial = np.abs(np.matvec(x.M, x.a_ref - x.v_dot))
    kinetic = size * (x.Y_size + np.abs(x.tau) + inertial)
    command = np.abs(x.u) + np.abs(x.r) + controller.Lambda * np.abs(x.e_star)
    coupling = command * np.abs(np.vecmat(x.force, x.c_inv))
    per_robot = condition * (kinetic.sum(axis=-1) + coupling.sum(axis=-1))
    learned = _sum(np.abs(x.s_q) * x.Y_size) + np.abs(x.stored_rate).sum(-1) + np.abs(x.chained).sum(-1)
    return per_robot.sum(axis=-1) + learned + sum(_sum(np.abs(summand)) for summand in summands)


def _sum(term: np.ndarray) -> np.ndarray:
    """Over all axes but the first."""
    return term.sum(axis=(1, 2))


__getattr__ = names_elsewhere(__name__, ".lyapunov", lyapunov_of="lyapunov")
