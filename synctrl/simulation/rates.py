"""How fast a closed loop wants to move: what each gain asks of the step, and which joint it is about.

With the mass matrix M of a robot, its damping D (K_r, or J^T K_r J in task space), its friction F at rest and
lambda_n, the largest eigenvalue of S^T S:

    K_r        largest eigenvalue of M^-1 D
    friction   largest eigenvalue of M^-1 F
    Lambda     Lambda
    beta       beta lambda_n
    K_eps      root of the largest eigenvalue of M^-1 lambda_n J^T c^T K_eps c J
    law        of another law than the paper's: largest eigenvalue of M^-1 J^T B J, where its force answers a
               velocity with B; and a spring likewise
    Gamma      root of the largest eigenvalue of M^-1 Y Gamma Y^T

The first four damp, as a law may, and add up; K_eps and Gamma are springs, that swing. Held torque damps a
spring late: what counts then is the largest eigenvalue of (D + F)^-1 Y Gamma Y^T, against the period.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..control.adaptation import Seen
from ..control.laws import no_errors
from ..control.laws.sun_mills import BoundSunMills
from ..coupling.cell import Reference
from ..robots.momentum import momentum_of_all
from ..robots.regressors import make_regressors
from ..tasks.measurement import Measurement, Tips
from ..tasks.spaces import TipSpace
from .closed_loop import ClosedLoop

#: largest product of rate and step that was ever seen to do with the classical Runge-Kutta method, whose own
#: limits are 2.78 for what damps, alone and linear, and 2.83 for what swings
RUNGE_KUTTA, SWING = 2.0, 2.83
#: the same for rate and period of torque that is held
HELD, HELD_SPRING = 2.0, 1.0
#: robots that are measured together at most
TOGETHER = 96
#: gains are cut off here, so that rates do not overflow
HUGE = 1e200


class LoopRate(NamedTuple):
    """A rate of a robot and where it comes from.

    Attributes:
        gain: name of the gain, or "friction".
        robot: counted from 0.
        joint: the one that moves most in the fastest mode, counted from 0, or None if the gain is the task's.
        rate: 1/s.
        spring: whether it swings rather than damps.
    """

    gain: str
    robot: int
    joint: int | None
    rate: float
    spring: bool = False


def loop_rates(
    loop: ClosedLoop, t: float, motion: np.ndarray, sampled: bool = False, driven: bool = False
) -> list[LoopRate]:
    """Rates of every robot of a closed loop at one instant.

    Args:
        loop: the closed loop.
        t: the instant, s.
        motion: joint positions and velocities, (2, n, nv).
        sampled: whether torque is held for a period.
        driven: whether the regressor is that of the reference motion with its feedback, rather than that of
            what is desired.
    """
    reference, task, J = _measured(loop, t, motion)
    Y, found = _regressors(loop, reference, task, motion, driven), []
    for i, robot in enumerate(loop.cell.robots):
        nv, J_i = robot.nv, J[i, :, : robot.nv]
        M = robot.mass_matrix(motion[0, i, :nv])
        resistance, dampers = _dampers(loop, reference, i, J_i, M)
        against = resistance + 1e-12 * np.eye(nv) if sampled else M
        springs = _springs(loop, reference, i, J_i, Y[i, :nv])
        found += dampers + [_rate(name, i, against, spring, True, sampled) for name, spring in springs]
    return found


def damping_rate(loop: ClosedLoop, t: float, motion: np.ndarray, sampled: bool = False) -> float:
    """The largest sum of what damps a robot within a step, 1/s.

    It is the sum of Lambda, beta lambda_n and the largest eigenvalues of M^-1 D, of M^-1 F, and of what
    another law than the paper's damps with. Where torque is held, a step knows nothing but the friction.
    """
    reference = loop.cell.references(np.array([t]))[0]
    J, sums = _jacobians(loop, reference, motion), []
    for i, robot in enumerate(loop.cell.robots):
        M = robot.mass_matrix(motion[0, i, : robot.nv])
        _, dampers = _dampers(loop, reference, i, J[i, :, : robot.nv], M)
        sums.append(sum(rate.rate for rate in dampers if rate.gain == "friction" or not sampled))
    return max(sums)


def _measured(loop: ClosedLoop, t: float, motion: np.ndarray) -> tuple[Reference, Measurement, np.ndarray]:
    """What is desired and measured, and the Jacobians, (n, m, nv); in joint space identities."""
    cell, reference = loop.cell, loop.cell.references(np.array([t]))[0]
    task = cell.task.measure(motion, reference.desired)
    J = np.broadcast_to(np.eye(cell.m, cell.nv), (cell.n, cell.m, cell.nv)) if task.J is None else task.J
    return reference, task, J


def _jacobians(loop: ClosedLoop, reference: Reference, motion: np.ndarray) -> np.ndarray:
    """The Jacobians, (n, m, nv), of some robots at a time: forests of all of them would take much memory."""
    cell, space = loop.cell, loop.cell.space
    if cell.n <= TOGETHER or not isinstance(space, TipSpace):
        return _measured(loop, reference.t, motion)[2]
    posture, J = space.redundancy.spread(cell.robots), np.zeros((cell.n, cell.m, cell.nv))
    for first in range(0, cell.n, TOGETHER):
        robots = cell.robots[first : first + TOGETHER]
        rows, nv = slice(first, first + TOGETHER), max(robot.nv for robot in robots)
        W_inv, preferred, gain = (part[rows, :nv] for part in posture)
        tips = Tips(robots)
        bound = space.over(tips, [[robot.nv] for robot in robots], (W_inv, preferred, gain))
        J[rows, :, :nv] = bound.measure(motion[:, rows, :nv], reference.desired[:, rows]).J
        vars(tips).clear()  # its parts hold each other, and would stay for a while
    return J


def _regressors(
    loop: ClosedLoop, reference: Reference, task: Measurement, motion: np.ndarray, driven: bool
) -> np.ndarray:
    """Regressors of all robots, (n, nv, P)."""
    cell, controller = loop.cell, loop.controller
    wanted = cell.task.to_joints(task, *task.rates)
    if driven:
        signals = controller.evaluate(
            reference, motion, controller.adaptation.start(), controller.network.start()
        )
        wanted = signals.v_ref, signals.a_ref
    return make_regressors(cell.parameters, [robot.nv for robot in cell.robots])(
        motion[0], motion[1], *wanted
    )


def _dampers(
    loop: ClosedLoop, reference: Reference, i: int, J: np.ndarray, M: np.ndarray
) -> tuple[np.ndarray, list[LoopRate]]:
    """What resists the velocities of a robot, (nv, nv), and the rates of all that damps it."""
    controller, plant, nv = loop.controller, loop.plant, J.shape[1]
    K_r = np.minimum(controller.K_r[i], HUGE)
    damping = np.diag(K_r[:nv]) if controller.k_r_space == "joint" else J.T @ np.diag(K_r) @ J
    friction = np.diag((plant.viscous + plant.coulomb / plant.smoothing)[i, :nv])  # slope at rest
    beta = min(float(controller.beta.max()), HUGE) * loop.cell.largest_share
    found = [
        LoopRate("Lambda", i, None, min(float(controller.Lambda.max()), HUGE)),
        LoopRate("beta", i, None, beta),
    ]
    found += [_rate("K_r", i, M, damping), _rate("friction", i, M, friction)]
    if type(controller.law) is not BoundSunMills:
        force = J.T @ _answers(loop, reference, i)[0] @ J
        damping = damping + force
        found.append(_rate("law", i, M, force))
    return damping + friction, found


def _springs(
    loop: ClosedLoop, reference: Reference, i: int, J: np.ndarray, Y: np.ndarray
) -> list[tuple[str, np.ndarray]]:
    """What pulls a robot back, (nv, nv) each, by the name of its gain."""
    cJ = reference.c[i] @ J
    coupling = loop.cell.largest_share * cJ.T @ np.diag(np.minimum(loop.controller.K_eps, HUGE)) @ cJ
    found = [("K_eps", coupling), ("Gamma", learned(loop, i, Y))]
    if type(loop.controller.law) is not BoundSunMills:
        found.append(("law", J.T @ _answers(loop, reference, i)[1] @ J))
    return found


def _answers(loop: ClosedLoop, reference: Reference, i: int) -> tuple[np.ndarray, np.ndarray]:
    """How the force of a law answers the velocity and the position of a robot, (m, m) each.

    The other robots move with it in the way that the coupling answers most.
    """
    n, m = loop.cell.n, loop.cell.m
    weights, share = reference.weights, loop.cell.largest_share
    still = replace(no_errors(n, m), t=reference.t, weights=weights)
    rest = loop.controller.law.command(still).force[i]
    found = np.zeros((2, m, m))
    for matrix, order in zip(found, (1, 0), strict=True):  # of the velocity, of the position
        for k in range(m):
            error, shares = np.zeros((2, n, m)), np.zeros((3, n, m))
            error[order, i, k] = -1.0
            weighted = np.matvec(weights.c, error)
            shares[order + 1] = share * weighted[order]
            seen = replace(still, error=error, x_dot=-error[1], weighted=weighted, shares=shares)
            matrix[:, k] = rest - loop.controller.law.command(seen).force[i]
    damping, spring = (np.clip(np.nan_to_num(A + A.T) / 2, -HUGE, HUGE) for A in found)
    return damping, spring


def learned(loop: ClosedLoop, i: int, Y: np.ndarray) -> np.ndarray:
    """The spring that adaptation is, (nv, nv): Y theta_hat' per velocity error, Y Gamma Y^T with (14)."""
    cell, adaptation = loop.cell, loop.controller.adaptation
    z, still = adaptation.start(), np.zeros((cell.n, cell.nv))
    known = partial(momentum_of_all, cell.robots, cell.parameters, still, still)

    def rate(gradient: np.ndarray) -> np.ndarray:
        rows = np.zeros(cell.theta.shape)
        rows[i] = gradient
        return adaptation.rate(z, Seen(still, still, still, still, still, rows, None, still, still, known))

    rest = rate(np.zeros(Y.shape[1]))
    changes = [np.clip(np.nan_to_num(rate(row) - rest), -HUGE, HUGE) for row in Y]
    steps = [1e-6 / (1.0 + np.abs(change).max()) for change in changes]
    columns = [
        (adaptation.estimate(z + h * change) - adaptation.estimate(z - h * change))[i] / (2 * h)
        for h, change in zip(steps, changes, strict=True)
    ]
    return np.clip(np.nan_to_num(Y @ np.stack(columns, axis=1)), -HUGE, HUGE)


def _rate(
    gain: str, i: int, M: np.ndarray, A: np.ndarray, spring: bool = False, sampled: bool = False
) -> LoopRate:
    """The largest eigenvalue of M^-1 A, or its root for a spring, with the joint that its mode moves most.

    It is 0 at a singular configuration, and against an M that drives a robot rather than resists it, as a law
    may: nothing is known of either.
    """
    unknown = LoopRate(gain, i, None, 0.0, spring)
    if np.isnan(A).any():
        return unknown
    try:
        L_inv = np.linalg.inv(np.linalg.cholesky(M))
    except np.linalg.LinAlgError:
        return unknown
    values, vectors = np.linalg.eigh(L_inv @ np.clip(A, -HUGE, HUGE) @ L_inv.T)
    value = max(float(values[-1]), 0.0)
    joint = int(np.abs(L_inv.T @ vectors[:, -1]).argmax())
    return LoopRate(gain, i, joint, np.sqrt(value) if spring and not sampled else value, spring)
