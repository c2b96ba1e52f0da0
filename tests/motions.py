"""Functions of time with right and with wrong derivatives, of all sizes and rates."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from synctrl.tasks.derivatives import Misfit, Sample, difference, find_misfit, spread_windows


class Case(NamedTuple):
    """A vector function with its derivative, a run, and instants at which it may jump."""

    sample: Sample
    duration: float
    size: int = 1
    breaks: tuple[float, ...] = ()

    def misfit(self, count: int = 24) -> Misfit | None:
        windows = spread_windows(0.0, self.duration, self.breaks, count)
        return find_misfit(self.sample, windows, [slice(0, self.size)], 0.0, difference)

    def spoilt(self, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Case:
        """The same with another derivative, `change(t, derivative)`."""

        def sample(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            value, derivative = self.sample(t)
            return value, change(t, derivative)

        return self._replace(sample=sample)


def random_sines(seed: int, least: float = 1e-6) -> Case:
    """Sines of 0.01 to 200 Hz and of 1e-6 (or `least`) to 1e3 times their offset, or without one."""
    rng = np.random.default_rng(seed)
    d = int(rng.integers(1, 4))
    offset = rng.choice([-1, 0, 1]) * 10 ** rng.uniform(-3, 3)
    largest = max(abs(offset), 1e-3)
    a = largest * 10 ** rng.uniform(np.log10(least), 3, d)
    if least > 1e-6:
        a = np.full(d, a[0])
    w, p = 2 * np.pi * 10 ** rng.uniform(-2, np.log10(200), d), rng.uniform(0, 6, d)
    duration = 10 ** rng.uniform(-1.5, 2)

    def sample(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = w * np.asarray(t)[:, None] + p
        return offset + a * np.sin(angle), a * w * np.cos(angle)

    return Case(sample, duration, d)


def scalar(f: Callable, g: Callable, duration: float = 2.0, breaks: tuple[float, ...] = ()) -> Case:
    return Case(lambda t: (f(t)[:, None], g(t)[:, None]), duration, 1, breaks)


def table(rate: float, step: float) -> Case:
    """A sine between the rows of tables, as recorded motions come."""
    t = np.arange(0.0, 2 + 2 * step, step)
    w = 2 * np.pi * rate
    return scalar(lambda s: np.interp(s, t, np.sin(w * t)), lambda s: np.interp(s, t, w * np.cos(w * t)), 2.0)


def triangle(t: np.ndarray) -> np.ndarray:
    return np.abs(np.mod(t, 0.2) - 0.1)


def slope(t: np.ndarray) -> np.ndarray:
    return np.sign(np.mod(t, 0.2) - 0.1)


#: right derivatives that are hard to recognize as such
HARD = {
    "still": scalar(lambda t: 0 * t + 1, lambda t: 0 * t),
    "still but for rounding": scalar(
        lambda t: 1 + 1e-16 * np.sin(1e9 * t), lambda t: 1e-17 * np.cos(1e9 * t)
    ),
    "a line": scalar(lambda t: 1e6 + t, lambda t: 0 * t + 1),
    "stiff": scalar(lambda t: np.exp(-1e3 * t), lambda t: -1e3 * np.exp(-1e3 * t)),
    "a short pulse": scalar(
        lambda t: np.tanh(1e3 * (t - 0.7)), lambda t: 1e3 * (1 - np.tanh(1e3 * (t - 0.7)) ** 2)
    ),
    "kinks with breaks": scalar(triangle, slope, 2.0, tuple(np.arange(1, 20) * 0.1)),
    "kinks without breaks": scalar(triangle, slope),
    "steps with breaks": scalar(lambda t: np.where(t < 0.5, 1.0, 5.0), lambda t: 0 * t, 1.0, (0.5,)),
    "switching": scalar(lambda t: triangle(20 * t) / 20, lambda t: slope(20 * t)),
    "single precision": scalar(
        lambda t: np.sin(3 * t.astype(np.float32)).astype(float),
        lambda t: 3 * np.cos(3 * t.astype(np.float32)).astype(float),
    ),
    "a table": table(1.0, 2e-3),
    "a chirp": scalar(lambda t: np.sin(300 * t**2), lambda t: 600 * t * np.cos(300 * t**2)),
    "a root": scalar(lambda t: np.sqrt(t), lambda t: 0.5 / np.sqrt(np.maximum(t, 1e-12))),
}
