"""Gains for a bandwidth, from the robots' inertia along their paths.

What is fast in the loop of a robot are the modes of M^-1 K_r, Lambda and beta times the eigenvalues of S^T S;
all of them together have to stay below what the step, or the sample, can follow. Within that room K_r is made
as large as the bandwidth asks, K_eps a quarter of what any constant delay may be added to, and Gamma so large
that what is learned moves no faster than the damping can follow.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..checks import instance, non_negative_number, positive_number
from ..coupling.cell import Cell
from ..errors import GainWarning, warn
from ..robots.mechanism import joint_limits
from ..robots.model import unit_for
from ..robots.payload import Payload, carrying
from ..robots.robot import Robot
from .excursion import Excursion, excursion
from .learning_scale import learning_scale

#: largest rate that is asked for, times dt of RK4 and times the period of sampled control
RK4_SHARE, SAMPLED_SHARE = 0.35 * 2.78, 0.6 * 2.0
#: K_r over bandwidth and inertia; error of gravity's torque that is allowed for; where it may lead, rad
DAMPING, GRAVITY_ERROR, SAG = 8.0, 0.3, 0.1
#: of the load that nobody told of: kg, and share of the arm's mass
LOAD, LOAD_SHARE = 2.0, 0.2
#: share of the largest K_eps that is good with every delay
STIFFNESS = 0.25
#: how long the damping takes, times the bandwidth; errors for which learning has to be slow, rad
SETTLING, TRANSIENT = 0.5, 0.03


class Rates(NamedTuple):
    """Rates of the loop, 1/s; `room` is what they leave for the modes of M^-1 K_r."""

    Lambda: float
    beta: float
    synchronized: float
    room: float


class Arm:
    """One robot along its path: what the choice of its gains depends on.

    Args:
        cell: the cell.
        i: index of the robot.
        states: where it will be.
        payload: mass that it may carry, kg.
    """

    def __init__(self, cell: Cell, i: int, states: Excursion, payload: float):
        self.robot, self.parameters, self.name = cell.robots[i], cell.parameters[i], cell.names[i]
        self.loaded = carrying(self.robot, Payload(0, payload)) if payload else self.robot
        nv = self.robot.nv
        self.q, self.v, self.a = (part[:, i, :nv] for part in states[:3])
        self.weighted = states.weighted[:, i, :, :nv]

    @cached_property
    def M(self) -> np.ndarray:  # noqa: N802
        """Inertia without load, (K, nv, nv)."""
        return np.array([self.robot.mass_matrix(q) for q in self.q])

    @cached_property
    def M_loaded(self) -> np.ndarray:  # noqa: N802
        """Inertia with load, (K, nv, nv)."""
        return np.array([self.loaded.mass_matrix(q) for q in self.q])

    @cached_property
    def unknown(self) -> np.ndarray:
        """Torque that holds an error of gravity's, and the load, (nv,), N·m: the largest along the path."""
        g = self.gravity(self.robot)
        return (GRAVITY_ERROR * np.abs(g) + np.abs(self.gravity(self.loaded) - g)).max(axis=0)

    def gravity(self, robot: Robot) -> np.ndarray:
        """Torque of gravity, (K, nv), N·m."""
        return np.array([robot.gravity(q) for q in self.q])


def suggested(
    cell: Cell, bandwidth: float, period: float | None, payload: float | None, dt: float, duration: float
) -> dict[str, Any]:
    """The gains of `Gains.suggest`, by their names."""
    instance("cell", cell, Cell, "a Cell")
    omega = positive_number("bandwidth", bandwidth)
    rates = choose_rates(cell, omega, fastest(period, dt))
    states = excursion(cell, positive_number("duration", duration))
    arms = [Arm(cell, i, states, usual_load(robot, payload)) for i, robot in enumerate(cell.robots)]
    K_r = [damping(arm, omega, rates) for arm in arms]
    _warn_of_slow_modes(omega, rates, arms, K_r)
    _warn_of_sag(rates, arms, K_r)
    _warn_of_first_torque(cell, rates, K_r)
    K_eps = np.min([stiffness(arm, K, cell, rates) for arm, K in zip(arms, K_r, strict=True)], axis=0)
    Gamma = [learning(arm, K, omega, rates) for arm, K in zip(arms, K_r, strict=True)]
    return {"Lambda": rates.Lambda, "beta": rates.beta, "K_r": K_r, "K_eps": K_eps, "Gamma": Gamma}


def choose_rates(cell: Cell, omega: float, top: float) -> Rates:
    """Lambda = min(omega, top/4), beta = min(Lambda/lambda_2, top/(4 lambda_n)); lambda are of S^T S."""
    values = np.linalg.eigvalsh(cell.coupling.matrix.T @ cell.coupling.matrix)
    largest = values[-1]
    smallest = values[values > 1e-9 * largest][0]
    Lambda = min(omega, top / 4)
    beta = min(Lambda / smallest, top / (4 * largest))
    return Rates(Lambda, beta, beta * smallest, top - Lambda - beta * largest)


def damping(arm: Arm, omega: float, rates: Rates) -> np.ndarray:
    """K_r, (nv,): what bandwidth and gravity ask for, cut at the joints that are too light for it."""
    return cut(arm, wished(arm, omega, rates.Lambda), rates.room)


def wished(arm: Arm, omega: float, Lambda: float) -> np.ndarray:
    """K_r that bandwidth and gravity ask for, whatever the joints can take, (nv,)."""
    inertia = np.einsum("kjj->kj", arm.M_loaded).mean(axis=0)
    return np.maximum(DAMPING * omega * inertia, arm.unknown / (SAG * Lambda))


def cut(arm: Arm, K_r: np.ndarray, room: float) -> np.ndarray:
    """K_r, (nv,), cut at light joints, so that all modes of M^-1 K_r are below the room, 1/s.

    Light joints are those with K_j > kappa room / (M^-1)_jj; kappa is the largest up to 1 that does.
    """
    M_inv = np.linalg.inv(arm.M)
    ceiling = room / np.einsum("kjj->kj", M_inv).max(axis=0)
    low, high = 0.0, 2.0  # the first kappa is 1
    while low < 1 and high - low > 1e-9 * high:
        kappa = (low + high) / 2
        good = largest_mode(M_inv, np.minimum(K_r, kappa * ceiling)) <= room
        low, high = (kappa, high) if good else (low, kappa)
    return np.minimum(K_r, low * ceiling)


def stiffness(arm: Arm, K_r: np.ndarray, cell: Cell, rates: Rates) -> np.ndarray:
    """K_eps, (m,) = STIFFNESS (4 Lambda/d_max) W/lambda_max(W^1/2 A W^1/2), A = c J K_r^-1 J^T c^T.

    W_j = 1/max A_jj, so that the units are those of c; d_max is the largest entry on the diagonal of S^T S.
    """
    A = arm.weighted / K_r @ arm.weighted.mT
    W = 1 / np.einsum("kjj->kj", A).max(axis=0)
    root = np.sqrt(W)
    largest = np.linalg.eigvalsh(root[:, None] * A * root).max()
    d_max = (cell.coupling.matrix**2).sum(axis=0).max()
    return STIFFNESS * 4 * rates.Lambda / d_max * W / largest


def learning(arm: Arm, K_r: np.ndarray, omega: float, rates: Rates) -> np.ndarray:
    """Gamma, (P,), with Y Gamma Y^T <= (T_a K_r^-1 + K_r^-1 M K_r^-1/6)^-1 along the path, T_a = .5/omega."""
    scale = learning_scale(arm.parameters, arm.loaded, arm.q)
    return scale / learning_share(arm, K_r, omega, rates.Lambda, scale)


def learning_share(arm: Arm, K_r: np.ndarray, omega: float, Lambda: float, Gamma: np.ndarray) -> float:
    """How many times Y Gamma Y^T, Gamma of (P,), is what `learning` allows at most."""
    R_inv = SETTLING / omega * np.diag(1 / K_r) + arm.M / K_r[:, None] / K_r / 6
    rng, largest = np.random.default_rng(0), 0.0
    for k, (q, v, a) in enumerate(zip(arm.q, arm.v, arm.a, strict=True)):
        jolts = TRANSIENT * rng.choice((-1.0, 1.0), (2, 2, len(q))) * Lambda
        for e_dot, e_ddot in ((0.0, 0.0), *jolts):
            Y = arm.parameters.regressor(q, v, v + e_dot, a + Lambda * e_ddot) * np.sqrt(Gamma)
            largest = max(largest, np.linalg.eigvals(R_inv[k] @ Y @ Y.T).real.max())
    return largest


# -- parts -------------------------------------------------------------------------------------------------


def fastest(period: float | None, dt: float) -> float:
    """The largest rate, 1/s, that the step of RK4, or the period of sampled control, can follow."""
    if period is None:
        return RK4_SHARE / positive_number("dt", dt)
    return SAMPLED_SHARE / positive_number("period", period)


def usual_load(robot: Robot, payload: float | None = None) -> float:
    """What a robot may carry without being told of, kg: what is given, or what `Gains.suggest` says."""
    mass = robot.inertial_parameters[::10].sum()
    return min(LOAD, LOAD_SHARE * mass) if payload is None else non_negative_number("payload", payload)


def largest_mode(M_inv: np.ndarray, K_r: np.ndarray) -> float:
    """Largest eigenvalue of M^-1 K_r, 1/s."""
    root = np.sqrt(K_r)
    return float(np.linalg.eigvalsh(root[:, None] * M_inv * root).max())


def slowest_mode(M: np.ndarray, K_r: np.ndarray) -> float:
    """Least eigenvalue of M^-1 K_r, 1/s."""
    root = 1 / np.sqrt(K_r)
    return float(1 / np.linalg.eigvalsh(root[:, None] * M * root).max())


def _warn_of_slow_modes(omega: float, rates: Rates, arms: list[Arm], K_r: list[np.ndarray]) -> None:
    slowest = {arm.name: slowest_mode(arm.M_loaded, K) for arm, K in zip(arms, K_r, strict=True)}
    modes = {"Lambda": rates.Lambda, "beta": rates.synchronized}
    modes |= {f"K_r of {name}": mode for name, mode in slowest.items()}
    slow = [f"{name} gives {mode:.3g} 1/s" for name, mode in modes.items() if mode < (1 - 1e-9) * omega]
    if slow:
        warn(
            f"expected modes of at least the bandwidth of {omega:g} rad/s, found: {'; '.join(slow)}; take a "
            "shorter dt or period, or a smaller bandwidth",
            GainWarning,
        )


def _warn_of_sag(rates: Rates, arms: list[Arm], K_r: list[np.ndarray]) -> None:
    """Say which joint of a robot sags most, where its damping was cut below what bears the load."""
    found = []
    for arm, K in zip(arms, K_r, strict=True):
        sag = arm.unknown / (K * rates.Lambda)
        joint = int(np.argmax(sag))
        if sag[joint] > (1 + 1e-6) * SAG:
            found.append(f"{arm.name}, joint {joint + 1}: {sag[joint]:.3g} {arm.robot.joint_units[joint]}")
    if found:
        warn(
            f"expected at most {SAG:g} rad (m) of sag until an unknown load is learned, found up to: "
            f"{'; '.join(found)}; take a shorter dt or period, or a smaller payload",
            GainWarning,
        )


def _warn_of_first_torque(cell: Cell, rates: Rates, K_r: list[np.ndarray]) -> None:
    """Say where gravity at the start, or K_r Lambda |e| beside it, is more than a joint has."""
    task = cell.task.measure(np.stack((cell.q0, cell.v0)), cell.references(np.zeros(1))[0].desired)
    still = np.zeros_like(task.e)
    ways = (cell.task.to_joints(task, xref_dot, still)[0] for xref_dot in (rates.Lambda * task.e, still))
    jump = np.abs(np.subtract(*ways))
    for i, (robot, K) in enumerate(zip(cell.robots, K_r, strict=True)):
        gravity = np.abs(robot.gravity(cell.q0[i, : robot.nv]))
        limit = joint_limits(robot).torque
        torque = gravity + K * jump[i, : robot.nv]
        joint = int(np.argmax(torque / limit))
        if torque[joint] <= limit[joint]:
            continue
        unit = robot.joint_units[joint]
        cause = f"a start {jump[i, joint] / rates.Lambda:.3g} {unit} off the path takes about"
        advice = "start closer to the path, or take a smaller bandwidth"
        if gravity[joint] > limit[joint]:
            torque, cause, advice = gravity, "gravity at the start takes", "no gains can hold the arm there"
        force = unit_for("N·m", unit)
        warn(
            f"{cell.names[i]}, joint {joint + 1}: {cause} {torque[joint]:.3g} {force}, found a limit of "
            f"{limit[joint]:.3g} {force}; {advice}",
            GainWarning,
        )
