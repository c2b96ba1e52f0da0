"""How much torque may act on robots that their model does not have, before anything runs: D of Theorem A.

    D^2 = int sum_i d_i^T K_r^-1 d_i dt

Bounded joint by joint: what is stated, and Coulomb coefficients, and pushes, which are known with their
length, and viscous friction. Friction in the regressor is part of the model.

Viscous friction F v needs a bound of joint speeds that is stated, but for joint space with diagonal weights
that do not change. There v = qd' - e', and w' is p G r and a free motion, with |p G| <= 1 at all frequencies:

    D <= D_0 + gamma X,      gamma = max over axes of max_i F_i / (K_r,i^1/2 |c_i|) max_i |c_i| / K_r,i^1/2

with qd' and the free w' in D_0; and X^2 <= V(0) + X (D_0 + gamma X) bounds X if gamma < 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..control.controller import Controller
from ..control.gains import spread
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.parameters import FrictionParameters
from ..simulation.schedules import Disturbance, DisturbanceSchedule
from ..tasks.spaces import JointSpace
from .modal_filter import ModalFilter

#: instants at which desired speeds are looked at
INSTANTS = 1001


class Outside(NamedTuple):
    """Bounds of the torque outside the model.

    Attributes:
        always: of what may act all the time, (n, nv), N·m.
        viscous: coefficients of friction at speeds that nobody states, (n, nv), N·m·s/rad.
        pushes: torques from outside that are known.
    """

    always: np.ndarray
    viscous: np.ndarray
    pushes: Sequence[Disturbance]


def outside(cell: Cell, torque: ArrayLike, pushes: Sequence[Disturbance], speed: ArrayLike | None) -> Outside:
    """What may act on a cell.

    Args:
        cell: the robots.
        torque: bound of what else may act all the time, a number, (nv,) or (n, nv), N·m.
        pushes: torques from outside that are known.
        speed: bound of joint speeds, if there is one, a number, (nv,) or (n, nv), rad/s.

    Raises:
        InputError: a bound below 0, or sizes that do not fit.
    """
    always = _at_least_0("torque", torque, cell)
    viscous = np.zeros_like(always)
    for i, (member, parameters) in enumerate(zip(cell.members, cell.parameters, strict=True)):
        if not isinstance(parameters, FrictionParameters):
            nv = member.robot.nv
            always[i, :nv] += member.friction.coulomb
            viscous[i, :nv] = member.friction.viscous
    if speed is None:
        return Outside(always, viscous, pushes)
    return Outside(always + viscous * _at_least_0("speed", speed, cell), 0 * viscous, pushes)


def largest_norm(controller: Controller, acting: Outside, V0: float, w: np.ndarray, duration: float) -> float:
    """A bound of D over a time, sqrt(N·m).

    Args:
        controller: one with the paper's law.
        acting: what may act.
        V0: V(0).
        w: w(0), (n, m).
        duration: s.

    Raises:
        InputError: viscous friction without a bound of speeds, where one is needed.
    """
    D = _norm(controller, acting, duration)
    if not acting.viscous.any():
        return D
    gamma, free = _fed_back(controller, acting.viscous, w)
    D += free
    X = (D + float(np.sqrt(D**2 + 4 * (1 - gamma) * V0))) / (2 * (1 - gamma))
    return D + gamma * X


def _norm(controller: Controller, acting: Outside, duration: float) -> float:
    """D with the desired speeds for the actual ones."""
    cell, K_r = controller.cell, controller.K_r
    schedule = DisturbanceSchedule(cell, acting.pushes)
    edges = np.array([0.0, *(edge for edge in schedule.edges if 0 < edge < duration), duration])
    viscous = np.zeros_like(acting.viscous)[None]
    if acting.viscous.any():
        edges = np.union1d(edges, np.linspace(0.0, duration, INSTANTS))
        speeds = np.abs(cell.reference_table(edges).desired[:, 1])
        viscous = acting.viscous * np.maximum(speeds[:-1], speeds[1:])
    d = acting.always + viscous + np.abs([schedule.torque(t) for t in edges[:-1]])
    compliance = np.divide(1.0, K_r, out=np.zeros_like(K_r), where=K_r > 0)
    return float(np.sqrt(np.diff(edges) @ (d * compliance * d).sum((1, 2))))


def _fed_back(controller: Controller, viscous: np.ndarray, w: np.ndarray) -> tuple[float, float]:
    """gamma, and what the free motion adds to D."""
    cell, c = controller.cell, controller.cell.coupling.weights(np.array([0.0]), controller.cell.m).c[0]
    size = np.abs(np.diagonal(c, axis1=-2, axis2=-1))
    straight = cell.coupling.is_constant and np.array_equal(np.abs(c), size[:, None] * np.eye(cell.m))
    if type(cell.space) is not JointSpace or not straight:
        wanted = "a bound of joint speeds, for there is viscous friction that the regressor does not have"
        raise InputError.expected(wanted, None, "speed")
    root = np.sqrt(controller.K_r)
    felt = (viscous / (root * size)).max(0)
    gamma = float((felt * (size / root).max(0)).max())
    if gamma >= 1:
        wanted = "a bound of joint speeds, or damping above the viscous friction outside the regressor"
        raise InputError.expected(wanted, gamma, "speed", shown=f"friction of {gamma:.3g} times the damping")
    rates = ModalFilter.of(controller).free_rate_norm()
    return gamma, float(np.linalg.norm(felt * rates * np.linalg.norm(w, axis=0)))


def _at_least_0(name: str, value: ArrayLike, cell: Cell) -> np.ndarray:
    """A bound for each joint, (n, nv)."""
    bound = spread(name, finite_array(name, value), (cell.n, cell.nv))
    if bound.min() < 0:
        raise InputError.expected("a bound of at least 0", float(bound.min()), name)
    return bound
