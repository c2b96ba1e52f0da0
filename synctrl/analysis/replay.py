"""A run gone through again: the closed loop evaluated at every logged state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..checks import instance
from ..control.controller import Signals
from ..coupling.cell import Reference
from ..errors import InputError
from ..robots.forest import forests
from ..simulation.clock import before
from ..simulation.closed_loop import ClosedLoop
from ..simulation.recorder import ADAPTATION_STATE, NETWORK_STATE, PLANT_STATE
from ..simulation.result import Result
from ..simulation.schedules import DisturbanceSchedule
from ..simulation.simulate import Experiment
from .jumps import SmoothPart, jumps_in, pieces, tolerance
from .model_torques import Bodies, dynamics, friction_torques, frozen_error
from .origin import check_numbers, check_same, check_settings, check_sizes

#: instants whose references are evaluated together
BLOCK = 256


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


@dataclass(frozen=True, eq=False)
class Replay:
    """The instants of a run, gone through again.

    Attributes:
        result: the run.
        experiment: what made it.
        loop: its closed loop.
        rows: states and signals, one row per instant, and two where something jumps: from the left and right.
        logged: row of every logged instant, (T,); at a jump the one from the right.
        pieces: parts of the log in which nothing jumps.
        events: instants between which and the next one the state jumps, by events of plant or network.
        learning: names of the powers of the adaptation.
        stored, chained: names of the energies and powers of a closed chain, none if there is none.
    """

    result: Result
    experiment: Experiment
    loop: ClosedLoop
    rows: Moment
    logged: np.ndarray
    pieces: tuple[SmoothPart, ...]
    events: tuple[int, ...]
    learning: tuple[str, ...]
    stored: tuple[str, ...]
    chained: tuple[str, ...]


def replay(result: Result | Replay, experiment: Experiment | None = None) -> Replay:
    """Evaluate the closed loop at every logged state of a run.

    Args:
        result: the run; its replay, where one has been made already, is returned as it is.
        experiment: what made it; may be left out while the result still knows.

    Raises:
        InputError: no experiment for a result loaded from a file, another than the one that made it, numbers
            that have no squares, or a state of adaptation or plant that is not in the result.
    """
    if isinstance(result, Replay):
        return result
    instance("result", result, Result, "a Result")
    experiment = experiment_of(result, experiment)
    loop = experiment.closed_loop(result.info.get("plant", "pinocchio"))
    check_sizes(result, loop)
    check_settings(result, loop)
    check_numbers(result)
    schedule = DisturbanceSchedule(loop.cell, experiment.disturbances)
    jumps, crossed, events = jumps_in(result.t, loop, schedule, result.info.get("control_period"))
    rows = Moment(*map(np.array, zip(*_rows(result, loop, schedule, jumps), strict=True)))
    instants = np.arange(len(result.t))
    logged = instants + np.searchsorted(jumps, instants, side="right")
    speed = np.abs(rows.v_ref) + np.abs(rows.v)
    check_same(result, rows.s_q[logged], speed[logged])
    names = _names(loop, result)
    parts = pieces(logged, jumps, crossed)
    return Replay(result, experiment, loop, rows, logged, parts, tuple(events), *names)


def experiment_of(result: Result, experiment: Experiment | None) -> Experiment:
    """The experiment given, or else the one the result still knows.

    Raises:
        InputError: there is neither.
    """
    experiment = result.experiment if experiment is None else experiment
    if experiment is None:
        raise InputError(
            "this result was loaded from a file and does not know the closed loop that made it; "
            "pass the experiment, for example certify(result, experiment=planar_four())",
            subject="experiment",
        )
    instance("experiment", experiment, Experiment, "an Experiment")
    return experiment


# -- rows -------------------------------------------------------------------------------------------------


def _rows(
    result: Result, loop: ClosedLoop, schedule: DisturbanceSchedule, jumps: list[int]
) -> Iterator[Moment]:
    t, references, bodies = result.t, loop.cell.references, forests(loop.cell.robots)
    for start in range(0, len(t), BLOCK):
        for k, reference in enumerate(references(t[start : start + BLOCK]), start):
            if k in jumps:
                from_left, left = references(np.array([before(t[k])]))[0], t[k] - 2 * tolerance(t)
                yield _row(result, loop.at(left), bodies, k, from_left, schedule.torque(left))
            yield _row(result, loop.at(t[k]), bodies, k, reference, result.disturbance[k])


def _row(
    result: Result, loop: ClosedLoop, bodies: Bodies, k: int, reference: Reference, disturbance: np.ndarray
) -> Moment:
    q, v, y = result.q[k], result.v[k], state_at(result, k)
    y_dot, s = loop.evaluate(reference, y, disturbance)
    theta, adaptation, z = loop.cell.theta, loop.controller.adaptation, loop.state(y).z
    J, J_inv = _jacobians(loop, s)
    M, C_s = dynamics(bodies, q, v, s.s_q)
    friction, friction_damping = friction_torques(loop, bodies, q, v, s)
    return Moment(
        v, loop.split(y_dot)[1], s.v_ref, s.a_ref - _given_up(adaptation, z, s), *_gaps(loop, y, s, J_inv),
        s.s_q, s.tau, disturbance, friction, friction_damping,
        s.tau - loop.plant.applied(s.tau), np.matvec(s.Y, theta - s.theta_hat),
        np.matvec(s.Y, frozen_error(adaptation, theta - s.theta_hat)), np.array(adaptation.storage(z, theta)),
        np.array(adaptation.storage_rate(z, s.z_dot, theta)),
        np.array([*adaptation.powers(z, theta, s.seen).values()]), *_chain(loop, y, y_dot, s),
        s.epsilon, s.epsilon_dot, s.E, s.sigma, s.sigma_dot, s.e_star, s.u, s.r, s.errors.weighted, s.force,
        s.reference.c, s.reference.c_dot, s.reference.c_inv,
        np.array([] if s.errors.slips is None else s.errors.slips), J, J_inv, s.task.inverse_damping, M, C_s,
        np.matvec(np.abs(s.Y), np.abs(s.theta_hat) + np.abs(theta)),
    )  # fmt: skip


def _given_up(adaptation: Any, z: np.ndarray, s: Signals) -> np.ndarray | float:
    """What an adaptation that moves the desired motion takes from v_ref' at this instant, (n, nv)."""
    return adaptation.given_up(z, s.seen) if hasattr(adaptation, "shift") else 0.0


def _gaps(loop: ClosedLoop, y: np.ndarray, s: Signals, J_inv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What v_ref' and E' have beyond a_ref and sigma - leak E where the network told other rates.

    Reference velocities are linear in E and sigma, so they answer a rate as they answer a value.
    """
    network, shares = loop.controller.network, s.errors.shares.copy()
    if not hasattr(network, "gap"):
        return np.zeros_like(s.a_ref), np.zeros_like(s.E)
    gap = network.gap(s.reference.t, loop.state(y).memory)
    shares[:2] += gap
    moved = loop.controller.law.command(replace(s.errors, shares=shares))
    return np.matvec(J_inv, moved.xref_dot - s.asked.xref_dot), gap[0]


def state_at(result: Result, k: int) -> np.ndarray:
    """The state of the loop at logged instant k."""
    z = result.outputs.get(ADAPTATION_STATE, result.theta_hat)[k]
    memory = result.outputs.get(NETWORK_STATE, result.sync_integral)[k]
    hidden = result.outputs[PLANT_STATE][k] if PLANT_STATE in result.outputs else np.zeros(0)
    parts = result.q[k], result.v[k], z, memory, hidden
    return np.concatenate([part.ravel() for part in parts])


def _names(loop: ClosedLoop, result: Result) -> tuple[tuple[str, ...], ...]:
    """What the storage of the adaptation changes by, and energies and powers of a closed chain, by name."""
    y = loop.initial_state()
    y_dot, signals = loop.evaluate(loop.cell.references(result.t[:1])[0], y, result.disturbance[0])
    state, energies = loop.state(y), getattr(loop.chain, "energies", None)
    powers = tuple(loop.controller.adaptation.powers(state.z, loop.cell.theta, signals.seen))
    if energies is None:
        return powers, (), ()
    terms = energies.terms(state, loop.state(y_dot).v, signals)
    return powers, tuple(terms.energies), tuple(terms.powers)


def _chain(
    loop: ClosedLoop, y: np.ndarray, y_dot: np.ndarray, s: Signals
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energies, their rates, and powers of a closed chain; nothing if there is none."""
    energies = getattr(loop.chain, "energies", None)
    if energies is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    stored, rates, powers = energies.terms(loop.state(y), loop.state(y_dot).v, s)
    return np.array([*stored.values()]), np.array([*rates.values()]), np.array([*powers.values()])


def _jacobians(loop: ClosedLoop, s: Signals) -> tuple[np.ndarray, np.ndarray]:
    if s.task.J is not None and s.task.J_inv is not None:
        return s.task.J, s.task.J_inv
    identities = np.broadcast_to(np.eye(loop.cell.m), (loop.cell.n, loop.cell.m, loop.cell.m))
    return identities, identities
