"""How much torque may act on robots that their model does not have, before anything runs: D of Theorem A.

    D^2 = int sum_i d_i^T K_r^-1 d_i dt

Bounded joint by joint: what is stated, and Coulomb coefficients, and viscous ones times a speed that is
stated, and pushes, which are known with their length. Friction in the regressor is part of the model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..control.gains import spread
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.parameters import FrictionParameters
from ..simulation.schedules import Disturbance, DisturbanceSchedule


def unmodelled_friction(cell: Cell, speed: ArrayLike | None) -> np.ndarray:
    """Bound of the friction of the plant that the regressors do not have, (n, nv), N·m.

    Args:
        cell: the robots.
        speed: bound of joint speeds, a number, (nv,) or (n, nv), rad/s.

    Raises:
        InputError: viscous friction without a bound of speeds, or speeds below 0 or of another size.
    """
    bound, fast = np.zeros((cell.n, cell.nv)), None if speed is None else _at_least_0("speed", speed, cell)
    for i, (member, parameters) in enumerate(zip(cell.members, cell.parameters, strict=True)):
        if isinstance(parameters, FrictionParameters):
            continue
        nv, friction = member.robot.nv, member.friction
        if friction.viscous.any() and fast is None:
            wanted = "a bound of joint speeds, for there is viscous friction that the regressor does not have"
            raise InputError.expected(wanted, None, "speed")
        bound[i, :nv] = friction.coulomb + friction.viscous * (0.0 if fast is None else fast[i, :nv])
    return bound


def torque_norm(
    cell: Cell, K_r: np.ndarray, bound: ArrayLike, pushes: Sequence[Disturbance], duration: float
) -> float:
    """A bound of D over a time, sqrt(N·m).

    Args:
        cell: the robots.
        K_r: damping of the joints, (n, nv), 0 for joints that a robot does not have.
        bound: of what may act all the time, a number, (nv,) or (n, nv), N·m.
        pushes: torques from outside that are known.
        duration: s.

    Raises:
        InputError: a bound below 0, or sizes that do not fit.
    """
    always = _at_least_0("torque", bound, cell)
    schedule = DisturbanceSchedule(cell, pushes)
    edges = np.array([0.0, *(edge for edge in schedule.edges if 0 < edge < duration), duration])
    compliance = np.divide(1.0, K_r, out=np.zeros_like(K_r), where=K_r > 0)
    d = always + np.abs([schedule.torque(t) for t in edges[:-1]])
    return float(np.sqrt(np.diff(edges) @ (d * compliance * d).sum((1, 2))))


def _at_least_0(name: str, value: ArrayLike, cell: Cell) -> np.ndarray:
    """A bound for each joint, (n, nv)."""
    bound = spread(name, finite_array(name, value), (cell.n, cell.nv))
    if bound.min() < 0:
        raise InputError.expected("a bound of at least 0", float(bound.min()), name)
    return bound
