"""What the closed loop computes in the states of a log: at one instant, or at many of them at once.

Nothing here asks how many instants there are: arrays have a row per robot, and in front of it an axis of
time or none. `look` asks the closed loop itself, at one instant, whatever its parts are; `stacked.py` asks
its formulas at many instants, where all parts are the package's own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..control.controller import Signals
from ..coupling.cell import Reference
from ..simulation.closed_loop import ClosedLoop
from .model_torques import Bodies, friction_torques, frozen_error


class Moment(NamedTuple):
    """What the closed loop computes at one instant; with one more axis in front, at all of them.

    Attributes:
        v, v_dot, v_ref, a_ref, s_q, tau, disturbance: (n, nv); a_ref less what a hedge gives up of it.
        gap, E_gap: what v_ref' has beyond a_ref, (n, nv), and E' beyond sigma - leak E, (n, m), because of
            the network.
        friction: torque of friction that is not in Y, (n, nv).
        friction_damping: torque by which friction in Y damps, F_v s_q, (n, nv).
        cut_off: torque that saturation takes from tau, (n, nv).
        lacking, frozen: torque that the model lacks, Y tilde, and the part of it with Gamma = 0, (n, nv).
        storage, storage_rate: V_th of the adaptation, and its rate by the chain rule, N·m and N·m/s.
        learning: what V_th' has beside -s_q^T Y tilde, in the order of `Replay.learning`, N·m/s.
        stored, stored_rate: energies of a closed chain, in the order of `Replay.stored`, and their rates.
        chained: its powers, in the order of `Replay.chained`, N·m/s.
        epsilon, epsilon_dot: (p, m).
        E, sigma, sigma_dot, e_star, u, r: (n, m).
        weighted: w = c e and its rate, as the law takes them, (2, n, m).
        force: what the law asks for in task space, (n, m).
        c, c_dot, c_inv: (n, m, m).
        slips: what the network told of r, see `Received`, (2, n, m); nothing where nobody asks.
        J, J_inv: (n, m, nv) and (n, nv, m); identities in joint space.
        inverse_damping: lambda of a damped inverse near singular configurations, (n,); 0 without one.
        M: mass matrices, (n, nv, nv).
        C_s: C(q, v) s_q, (n, nv).
        Y_size: |Y| (|theta| + |theta_hat|), the magnitude of the model's torque, (n, nv).
    """

    v: np.ndarray
    v_dot: np.ndarray
    v_ref: np.ndarray
    a_ref: np.ndarray
    gap: np.ndarray
    E_gap: np.ndarray
    s_q: np.ndarray
    tau: np.ndarray
    disturbance: np.ndarray
    friction: np.ndarray
    friction_damping: np.ndarray
    cut_off: np.ndarray
    lacking: np.ndarray
    frozen: np.ndarray
    storage: np.ndarray
    storage_rate: np.ndarray
    learning: np.ndarray
    stored: np.ndarray
    stored_rate: np.ndarray
    chained: np.ndarray
    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    E: np.ndarray
    sigma: np.ndarray
    sigma_dot: np.ndarray
    e_star: np.ndarray
    u: np.ndarray
    r: np.ndarray
    weighted: np.ndarray
    force: np.ndarray
    c: np.ndarray
    c_dot: np.ndarray
    c_inv: np.ndarray
    slips: np.ndarray
    J: np.ndarray
    J_inv: np.ndarray
    inverse_damping: np.ndarray
    M: np.ndarray
    C_s: np.ndarray
    Y_size: np.ndarray


class Look(NamedTuple):
    """What the closed loop says in a state, with one more axis in front in many states.

    Attributes:
        q, v, v_dot: (n, nv).
        z: state of the adaptation, (n, Z).
        signals: what the controller computes there.
        disturbance: torque from outside, (n, nv).
        gap, E_gap: as of `Moment`.
        stored, stored_rate, chained: as of `Moment`.
    """

    q: np.ndarray
    v: np.ndarray
    v_dot: np.ndarray
    z: np.ndarray
    signals: Signals
    disturbance: np.ndarray
    gap: np.ndarray
    E_gap: np.ndarray
    stored: np.ndarray
    stored_rate: np.ndarray
    chained: np.ndarray


def look(loop: ClosedLoop, reference: Reference, y: np.ndarray, disturbance: np.ndarray) -> Look:
    """What the closed loop says in a state y at one instant.

    Args:
        loop: the closed loop as it is at that instant.
        reference: what is desired.
        y: the state.
        disturbance: torque from outside, (n, nv), N·m.
    """
    y_dot, s = loop.evaluate(reference, y, disturbance)
    state, v_dot = loop.state(y), loop.split(y_dot)[1]
    gaps, chain = _gaps(loop, state.memory, s), _chain(loop, y, v_dot, s)
    return Look(state.q, state.v, v_dot, state.z, s, disturbance, *gaps, *chain)


def moment(loop: ClosedLoop, bodies: Bodies, seen: Look) -> Moment:
    """All that a certificate needs to know of a state, or of many.

    Args:
        loop: the closed loop as it is there.
        bodies: the robots of its cell.
        seen: what it says.
    """
    s, theta, adaptation = seen.signals, loop.cell.theta, loop.controller.adaptation
    tilde, (J, J_inv) = theta - s.theta_hat, jacobians(loop, s)
    M, C_s = bodies.dynamics(seen.q, seen.v, s.s_q)
    friction, friction_damping = friction_torques(loop, bodies, seen.q, seen.v, s)
    powers = [*adaptation.powers(seen.z, theta, s.seen).values()]
    times, given = np.shape(s.tau)[:-2], s.reference.weights
    weights = (given.c, given.c_dot, given.c_inv)
    c, c_dot, c_inv = (np.broadcast_to(each, (*times, *each.shape[-3:])) for each in weights)
    return Moment(
        seen.v, seen.v_dot, s.v_ref, s.a_ref - _given_up(adaptation, seen.z, s), seen.gap, seen.E_gap,
        s.s_q, s.tau, seen.disturbance, friction, friction_damping,
        s.tau - loop.plant.applied(s.tau), np.matvec(s.Y, tilde),
        np.matvec(s.Y, frozen_error(adaptation, tilde)), np.array(adaptation.storage(seen.z, theta)),
        np.array(adaptation.storage_rate(seen.z, s.z_dot, theta)),
        np.stack(powers, axis=-1) if powers else np.zeros((*times, 0)),
        seen.stored, seen.stored_rate, seen.chained,
        s.epsilon, s.epsilon_dot, s.E, s.sigma, s.sigma_dot, s.e_star, s.u, s.r,
        np.moveaxis(s.errors.weighted, 0, len(times)), s.force,
        c, c_dot, c_inv,
        np.zeros((*times, 0)) if s.errors.slips is None else np.array(s.errors.slips), J, J_inv,
        np.broadcast_to(s.task.inverse_damping, (*times, loop.cell.n)), M, C_s,
        np.matvec(np.abs(s.Y), np.abs(s.theta_hat) + np.abs(theta)),
    )  # fmt: skip


def jacobians(loop: ClosedLoop, s: Signals) -> tuple[np.ndarray, np.ndarray]:
    """J and its inverse; identities in joint space."""
    if s.task.J is not None and s.task.J_inv is not None:
        return s.task.J, s.task.J_inv
    cell = loop.cell
    identities = np.broadcast_to(np.eye(cell.m), (*np.shape(s.tau)[:-1], cell.m, cell.m))
    return identities, identities


def _given_up(adaptation: Any, z: np.ndarray, s: Signals) -> np.ndarray | float:
    """What an adaptation that moves the desired motion takes from v_ref' at this instant, (n, nv)."""
    return adaptation.given_up(z, s.seen) if hasattr(adaptation, "shift") else 0.0


def _gaps(loop: ClosedLoop, memory: np.ndarray, s: Signals) -> tuple[np.ndarray, np.ndarray]:
    """What v_ref' and E' have beyond a_ref and sigma - leak E where the network told other rates.

    Reference velocities are linear in E and sigma, so they answer a rate as they answer a value.
    """
    network, shares = loop.controller.network, s.errors.shares.copy()
    if not hasattr(network, "gap"):
        return np.zeros_like(s.a_ref), np.zeros_like(s.E)
    gap = network.gap(s.reference.t, memory)
    shares[:2] += gap
    moved = loop.controller.law.command(replace(s.errors, shares=shares))
    _, J_inv = jacobians(loop, s)
    return np.matvec(J_inv, moved.xref_dot - s.asked.xref_dot), gap[0]


def _chain(
    loop: ClosedLoop, y: np.ndarray, v_dot: np.ndarray, s: Signals
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energies, their rates, and powers of a closed chain; nothing if there is none."""
    energies = getattr(loop.chain, "energies", None)
    if energies is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    stored, rates, powers = energies.terms(loop.state(y), v_dot, s)
    return np.array([*stored.values()]), np.array([*rates.values()]), np.array([*powers.values()])
