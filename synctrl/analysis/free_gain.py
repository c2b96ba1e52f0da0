"""The one gain of a law that a comparison may turn: which it is, and which factor on it does what is asked.

Laws with a gain of their own say so by `free_gain`, its name, and `scaled(factor)`, the law with that gain
multiplied; with all others Lambda is turned. A law that asks for estimates that stand still says so by
`adaptive`, which is False.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ..control.adaptation import Gradient
from ..control.laws import PDGravity
from ..errors import InputError
from ..simulation.simulate import Experiment

#: largest factor tried, and the accuracy of its logarithm
LARGEST_FACTOR, TOLERANCE = 64.0, 3e-4
#: relative excess that counts as any larger one: runs about to diverge tell a search nothing
MUCH = 10.0
#: relative excess that is left of a root at most; a jump from too little to too much is none
ACCURACY = 1e-2


def under(experiment: Experiment, law: Any) -> Experiment:
    """An experiment under another law; without beta and K_eps if the law has no place for them.

    Nothing is adapted under a law whose `adaptive` is False. Damping acts where it did, unless the law says
    where.

    Raises:
        InputError: the law does not fit the cell, or contradicts where the damping acts.
    """
    changes: dict[str, Any] = {"law": law, "reference_acceleration": None}
    gains = experiment.gains
    if not hasattr(law, "k_r_space"):
        changes["k_r_space"] = getattr(experiment.law, "k_r_space", experiment.k_r_space)
    if not getattr(law, "adaptive", True):
        gains, changes["adaptation"] = gains.replace(Gamma=None), Gradient(0.0)
    try:
        return replace(experiment, gains=gains, **changes)
    except InputError as error:
        if error.subject != "gains":
            raise
    return replace(experiment, gains=gains.independent(), **changes)


def free_gain(experiment: Experiment) -> tuple[str, Any]:
    """Name of the gain that is turned, and its value."""
    name = getattr(experiment.law, "free_gain", "Lambda")
    return name, getattr(experiment.gains if name == "Lambda" else experiment.law, name)


def scaled(experiment: Experiment, factor: float) -> Experiment:
    """The experiment with its free gain multiplied."""
    if hasattr(experiment.law, "free_gain"):
        return replace(experiment, law=experiment.law.scaled(factor))  # type: ignore[union-attr]
    gains = experiment.gains
    return replace(experiment, gains=gains.replace(Lambda=factor * gains.Lambda))


def pole_of(experiment: Experiment) -> float:
    """The rate at which the slowest of the errors common to all robots die out, see `with_pole`, 1/s."""
    if isinstance(experiment.law, PDGravity):
        return slowest_rate(experiment)
    return float(np.min(experiment.gains.Lambda))


def with_pole(experiment: Experiment, rate: float) -> Experiment | None:
    """The experiment in which errors common to all robots die out as exp(-rate t), if a gain does it.

    Laws that hold r = 0, or e'' + 2 Lambda e' + Lambda^2 e = 0, do so with a smallest Lambda of this rate.
    `PDGravity` gets the K_p with which its slowest mode at the start has it.

    Args:
        experiment: under the law.
        rate: 1/s.
    """
    if not isinstance(experiment.law, PDGravity):
        gains = experiment.gains
        return replace(experiment, gains=gains.replace(Lambda=rate / pole_of(experiment) * gains.Lambda))
    factor = factor_for(lambda factor: slowest_rate(scaled(experiment, factor)) / rate - 1)
    return None if factor is None else scaled(experiment, factor)


def slowest_rate(experiment: Experiment) -> float:
    """Smallest decay of M q'' + K_r q' + J^T K_p J q = 0 at the start, over all robots, 1/s.

    Damping in task space has J^T K_r J for K_r. Motions of spare joints, which the spring does not see, stand
    still and are left out.
    """
    cell, controller = experiment.cell, experiment.closed_loop().controller
    K_p = np.broadcast_to(experiment.law.K_p, (cell.m,))  # type: ignore[union-attr]
    task = cell.task.measure(np.stack((cell.q0, cell.v0)), cell.references(np.zeros(1))[0].desired)
    rates = []
    for i, robot in enumerate(cell.robots):
        nv = robot.nv
        J = np.eye(nv) if task.J is None else task.J[i][:, :nv]
        M_inv = np.linalg.inv(robot.mass_matrix(cell.q0[i, :nv]))
        damped = J if controller.k_r_space == "task" else np.eye(nv)
        spring, damper = (A.T @ (K[: len(A), None] * A) for A, K in ((J, K_p), (damped, controller.K_r[i])))
        A = np.block([[np.zeros((nv, nv)), np.eye(nv)], [-M_inv @ spring, -M_inv @ damper]])
        decay = -np.linalg.eigvals(A).real
        rates.append(decay[decay > 1e-9 * decay.max()].min())
    return float(min(rates))


def factor_for(excess: Callable[[float], float]) -> float | None:
    """A factor from 1/64 to 64 with which a relative excess is zero, or None.

    It is looked for upwards from 1, in steps of 2, and only if there is none, downwards: where several do,
    a law gets the one next above the gain it was given.

    Args:
        excess: as a function of the factor.
    """
    from scipy.optimize import brentq

    known = cache(lambda logarithm: min(excess(float(np.exp(logarithm))), MUCH))
    for low, high in _brackets(known):
        root = next((end for end in (low, high) if known(end) == 0), None)
        root = float(brentq(known, low, high, xtol=TOLERANCE)) if root is None else root
        if abs(known(root)) <= ACCURACY:
            return float(np.exp(root))
    return None


def _brackets(excess: Callable[[float], float]) -> Iterator[tuple[float, float]]:
    """Pairs of logarithms of the factor between which the excess changes its sign."""
    step = float(np.log(2.0))
    for direction in (1, -1):
        for k in range(round(np.log2(LARGEST_FACTOR))):
            near, far = direction * k * step, direction * (k + 1) * step
            if excess(near) * excess(far) <= 0:
                yield min(near, far), max(near, far)
