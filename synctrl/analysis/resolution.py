"""What encoders that count do to a cell: a bound on its errors, since no margin knows of a count.

A reading is off by n, at most half a count, whatever it does in time. To the frozen cell without delay this
is an input, x' = A x + B n, and y stays within the sum over joints of int |h(t)| dt times half a count, where
h is the response of y to an impulse of n. Velocities by differences with a lag T_v read n' too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array
from ..control.gains import Gains, spread
from ..coupling.cell import Cell
from .equipped import Equipment, equipment, equipped
from .frozen import Frozen, freeze

#: instants per decade at which the response is looked at, and shares of the fastest and slowest time
PER_DECADE, FIRST, LAST = 300, 1e-3, 30.0


def resolution_error(
    cell: Cell,
    gains: Gains,
    step: ArrayLike,
    *,
    sensors: Sequence[Any] = (),
    actuators: Sequence[Any] = (),
    control_period: float | None = None,
) -> np.ndarray:
    """How far joints may stay off their places because encoders count, (n, nv), rad: a bound without delay.

    Args:
        cell, gains: the cell and its gains, see `delay_margin`; it has to be stable with these devices.
        step: resolution of the encoders, a number, (nv,) or (n, nv), rad per count.
        sensors, actuators, control_period: what lags, see `equipment`.

    Raises:
        InputError: numbers that do not fit, or devices that need a period.
    """
    steps = spread("step", finite_array("step", step), (cell.n, cell.nv))
    parts, frozen = equipment(sensors, actuators, control_period), freeze(cell, gains)
    counts = np.concatenate([row[:k] for row, k in zip(steps, frozen.joints, strict=True)])
    bounds = peak_gain(frozen, parts) @ (0.5 * counts)
    found, ends = np.zeros((cell.n, cell.nv)), np.cumsum(frozen.joints)
    for row, k, end in zip(found, frozen.joints, ends, strict=True):
        row[:k] = bounds[end - k : end]
    return found


def peak_gain(frozen: Frozen, parts: Equipment) -> np.ndarray:
    """int |h(t)| dt from what is read of every joint to where every joint is, (J, J)."""
    N, J, X = frozen.leak.size, sum(frozen.joints), len(frozen.own)
    whole = equipped(frozen, parts)
    A = whole.own + whole.delayed
    B, y = A[:, N : N + J], np.eye(len(A))[N : N + J]
    if parts.velocity_lag:
        B = B + A[:, X : X + J] / parts.velocity_lag
    rates, modes = np.linalg.eig(A)
    moving = np.abs(rates) > 1e-7 * np.abs(rates).max()
    rates, out = rates[moving], (y @ modes)[:, moving]
    into = np.linalg.solve(modes, B.astype(complex))[moving]
    first, last = FIRST / np.abs(rates).max(), LAST / np.abs(rates.real).min()
    t = np.concatenate(([0.0], np.geomspace(first, last, int(PER_DECADE * np.log10(last / first)))))
    h = np.stack([((out * np.exp(rates * instant)) @ into).real for instant in t])
    return np.trapezoid(np.abs(h), t, axis=0)
