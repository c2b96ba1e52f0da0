"""Sensors: what the controller is told of the joints at a sample, in place of what they do.

A sensor of one's own is a class with `bind` and `as_dict`, see `Sensor`. Sensors stand in a row: each is told
what the one before it says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...checks import positive_number
from ...control.network.settings import seed_of
from ...coupling.cell import Cell
from .settings import Device, Settings, at_joints, in_steps, numbers_of

Measure = Callable[[int, np.ndarray], np.ndarray]
"""Number of a sample, from 0, and positions and velocities of the joints, (2, n, nv), rad and rad/s, or m and
m/s -> what is measured of them, an array of its own. Samples come one after another."""


class Sensor(Device[Measure], Protocol):
    """What measures the joints of a cell."""


@dataclass(frozen=True, eq=False)
class Quantisation(Settings):
    """Encoders that count: q = step round(q / step).

    Args:
        step: resolution, a number, (nv,) or (n, nv), rad (or m) per count; 0 where it is read exactly.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    step: ArrayLike

    def __post_init__(self) -> None:
        self._set("step", numbers_of("step", self.step, 0.0))

    def bind(self, cell: Cell, period: float) -> Measure:
        return partial(_quantised, at_joints("step", self.step, cell))


@dataclass(frozen=True, eq=False)
class Noise(Settings):
    """Gaussian noise of positions and velocities, independent from sample to sample and joint to joint.

    What is drawn at a sample depends on the seed and on its number alone. Two of them in one row need two
    seeds, or they draw the same.

    Args:
        q, v: standard deviations, numbers, (nv,) or (n, nv), rad (or m) and rad/s (or m/s).
        seed: a whole number of at least 0 and below 2^63.

    Raises:
        InputError: not numbers, not finite, below 0, or no seed.
    """

    q: ArrayLike = 0.0
    v: ArrayLike = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        self._set("q", numbers_of("q", self.q, 0.0))
        self._set("v", numbers_of("v", self.v, 0.0))
        self._set("seed", seed_of(self.seed))

    def bind(self, cell: Cell, period: float) -> Measure:
        return partial(_noisy, _of_both(self, cell), self.seed)


@dataclass(frozen=True, eq=False)
class Bias(Settings):
    """Positions and velocities that are read too large by a constant.

    Args:
        q, v: by how much, numbers, (nv,) or (n, nv), rad (or m) and rad/s (or m/s).

    Raises:
        InputError: not numbers, or not finite.
    """

    q: ArrayLike = 0.0
    v: ArrayLike = 0.0

    def __post_init__(self) -> None:
        self._set("q", numbers_of("q", self.q))
        self._set("v", numbers_of("v", self.v))

    def bind(self, cell: Cell, period: float) -> Measure:
        return partial(_shifted, _of_both(self, cell))


@dataclass(frozen=True, eq=False)
class DifferencedVelocity(Settings):
    """Velocities by differences of positions and a filter, in place of those that are measured.

        v_k = a v_{k-1} + (1 - a) (q_k - q_{k-1}) / T,   a = exp(-omega T),

    with the period T, and v_0 as it is measured. They lag by T / 2 and by the filter's 1 / omega.

    Args:
        omega: cutoff of the filter, rad/s; None for none, a = 0.

    Raises:
        InputError: not above 0.
    """

    omega: float | None = None

    def __post_init__(self) -> None:
        self._set("omega", None if self.omega is None else positive_number("omega", self.omega))

    def bind(self, cell: Cell, period: float) -> Measure:
        return _Difference(0.0 if self.omega is None else float(np.exp(-self.omega * period)), period)


class _Difference:
    """Velocities by differences; it remembers the sample before."""

    def __init__(self, kept: float, period: float):
        self._kept, self._period = kept, period
        self._last: np.ndarray | None = None

    def __call__(self, k: int, motion: np.ndarray) -> np.ndarray:
        found = motion.copy()
        if self._last is not None:
            q, v = self._last
            found[1] = self._kept * v + (1 - self._kept) * (found[0] - q) / self._period
        self._last = found
        return found


def _quantised(step: np.ndarray, k: int, motion: np.ndarray) -> np.ndarray:
    q, v = motion
    return np.array((in_steps(q, step), v))


def _noisy(deviations: np.ndarray, seed: int, k: int, motion: np.ndarray) -> np.ndarray:
    drawn = np.random.Generator(np.random.Philox(key=seed, counter=(0, 0, 0, k)))
    return motion + deviations * drawn.standard_normal(motion.shape)


def _shifted(bias: np.ndarray, k: int, motion: np.ndarray) -> np.ndarray:
    return motion + bias


def _of_both(sensor: Noise | Bias, cell: Cell) -> np.ndarray:
    """The numbers of positions and of velocities, (2, n, nv)."""
    return np.array([at_joints(name, getattr(sensor, name), cell) for name in ("q", "v")])
