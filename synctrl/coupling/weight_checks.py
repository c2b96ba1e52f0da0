"""Do weights keep their inverse, and do their derivatives belong to them? Checked before anything runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import CouplingError
from ..tasks.derivatives import find_misfit_in_motion, spread_windows
from .desired import desired_weights
from .weights import DERIVATIVES, ConstantWeights, FunctionWeights, Weights, WeightSource


def check_weights(source: WeightSource, times: np.ndarray, m: int) -> None:
    """Follow the weights through a run before it starts.

    Between two neighbouring instants c changes by c c^-1 c' Delta t to first order: where an eigenvalue of
    c^-1 c' Delta t reaches 1 in size, c has lost its inverse on the way, even if both instants have one.

    Args:
        source: the weights.
        times: instants of the run, (T,), s; a few hundred of them are looked at.
        m: dimension of the task.

    Raises:
        CouplingError: a weight without an inverse, at an instant or between two, or derivatives that do not
            belong to the weights.
        SimulationError: the weights fail; with the time.
    """
    times = np.unique(times[np.linspace(0, len(times) - 1, _instants(source.robots)).astype(int)])

    def look(at: np.ndarray) -> Weights:
        return desired_weights(lambda instants: source.at(instants, m), at)

    c, c_dot, _, c_inv = look(times)
    if isinstance(source, ConstantWeights) or len(times) < 2:
        return
    if isinstance(source, FunctionWeights):
        _check_derivatives(look, source.robots, float(times[0]), float(times[-1]), m)
    gaps = np.gradient(times)[:, None]
    change = np.abs(np.linalg.eigvals(c_inv @ c_dot).real).max(axis=-1) * gaps
    if change.max() >= 1:
        k, i = np.unravel_index(np.argmax(change), change.shape)
        raise CouplingError(
            f"the weight c of the robot at index {i} loses its inverse near t = {times[k]:g} s, where it is "
            f"{c[k, i].tolist()} and changes at {c_dot[k, i].tolist()} per second"
        )


def _instants(robots: int) -> int:
    """How many instants to look at: fewer for many robots."""
    return int(np.clip(200_000 // robots, 200, 2000))


def _check_derivatives(
    look: Callable[[np.ndarray], Weights], n: int, start: float, stop: float, m: int
) -> None:
    """Compare c' and c'' with differences of c and c'."""
    entries = m * m
    groups = [slice(i * entries, (i + 1) * entries) for i in range(n)]
    windows = spread_windows(start, stop, (), int(np.clip(1000 // n, 4, 24)))
    found = find_misfit_in_motion(
        lambda t: [part.reshape(len(t), -1) for part in look(t)[:3]], windows, groups
    )
    if found is not None:
        order, misfit = found
        i, entry = divmod(misfit.coordinate, entries)
        name, derivative = DERIVATIVES[order - 1 : order + 1]
        raise CouplingError(
            f"{derivative} of the robot at index {i} is not the derivative of {name}: near "
            f"t = {misfit.time:.6g} s entry {divmod(entry, m)} of {name} changes by "
            f"{misfit.expected:.6g} per second, but {derivative} says {misfit.found:.6g}"
        )
