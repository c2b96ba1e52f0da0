"""How much delay between its robots a cell tolerates.

What a robot hears of the others is d old, the same d for all links. Small errors of the frozen cell then obey

    x' = A_0 x + A_1 x(t - d),    det(s - A_0 - A_1 e^{-sd}) = 0,

and the smallest d at which a root s = j omega stands on the imaginary axis is the margin. There e^{j omega d}
is an eigenvalue of absolute value 1 of

    G(j omega) = V^T (j omega - A_0)^-1 U,    A_1 = U V^T with as many columns as its rank,

which does not depend on d: where |eig G| crosses 1 gives omega, the angle of the eigenvalue gives d, and if
nothing crosses no delay does harm. Roots at s = 0 are there whatever the delay is: nobody sees integrals of
errors that all pairs leave free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import non_negative_number
from ..control.gains import Gains
from ..coupling.cell import Cell
from .equipped import Equipment, equipment, equipped
from .frozen import Frozen, freeze

#: delay beyond the margin at which `rate` is told, as a share of it
BEYOND = 1.1
#: frequencies looked at per decade, and from which share of the slowest rate on
PER_DECADE, SLOWEST = 150, 1e-3
#: how near to 1 absolute values of eigenvalues are that cross it together
SAME = 1e-7
#: matrices solved together
BLOCK = 256
#: points at which what is under way is kept
POINTS = 28


@dataclass(frozen=True)
class DelayMargin:
    """How much delay a frozen cell tolerates.

    Attributes:
        delay: smallest constant delay of all links at which it loses stability, s; infinite if every one is
            tolerated.
        robot, joint: which joint moves most in the mode that is lost, counted from 0; None if none is.
        frequency: of that mode at the margin, rad/s; None if there is none.
        rate: how fast it grows at `BEYOND` times the margin, 1/s; 0 where nothing grows.
        by: "theorem" if K_r outweighs K_eps, so that every delay is tolerated, else "analysis".
        least_eigenvalue: of K_r - a/(4 Lambda) J^T c^T K_eps c J of every robot, (n,), N·m·s/rad.
    """

    delay: float
    robot: int | None
    joint: int | None
    frequency: float | None
    rate: float
    by: str
    least_eigenvalue: tuple[float, ...]
    frozen: Frozen = field(repr=False, compare=False)

    def growth(self, delay: float) -> float:
        """Real part of the rightmost root of the frozen cell with a delay, s, in 1/s; see `growth`.

        Raises:
            InputError: no number of at least 0.
        """
        return growth(self.frozen, non_negative_number("delay", delay))

    def __str__(self) -> str:
        if np.isinf(self.delay):
            because = {"theorem": "by the theorem, K_r outweighs K_eps", "analysis": "no root crosses"}[
                self.by
            ]
            return f"every constant delay is tolerated ({because})"
        if self.robot is None or self.joint is None:
            return "not stable even without delay"
        return (
            f"stable below a delay of {1e3 * self.delay:.3g} ms, where joint {self.joint + 1} of robot "
            f"{self.robot + 1} begins to swing with {self.frequency:.3g} rad/s"
        )


def delay_margin(
    cell: Cell,
    gains: Gains,
    *,
    q: ArrayLike | None = None,
    t: float = 0.0,
    k_r_space: str | None = None,
    sensors: Sequence[Any] = (),
    actuators: Sequence[Any] = (),
    control_period: float | None = None,
) -> DelayMargin:
    """How much constant delay between its robots a cell tolerates, frozen at one place.

    Args:
        cell: robots, task and coupling.
        gains: its gains; Gamma has no part in it.
        q: joint positions, (n, nv), rad; by default those at which the cell starts.
        t: instant whose weights count, s.
        k_r_space: where the damping acts, see `Controller`.
        sensors, actuators, control_period: what else lags, see `equipment`.

    Raises:
        InputError: gains or positions of the wrong size, an unknown word, or devices that need a period.
    """
    frozen = freeze(cell, gains, q=q, t=t, k_r_space=k_r_space)
    parts = equipment(sensors, actuators, control_period)
    if parts != Equipment():
        frozen = equipped(frozen, parts)
    least = tuple(frozen.least_eigenvalue.tolist())
    if frozen.proved:
        return DelayMargin(np.inf, None, None, None, 0.0, "theorem", least, frozen)
    if (now := growth(frozen, 0.0)) > 0:
        return DelayMargin(0.0, None, None, None, now, "analysis", least, frozen)
    delay, frequency = min(crossings(frozen), default=(np.inf, 0.0))
    if np.isinf(delay):
        return DelayMargin(np.inf, None, None, None, 0.0, "analysis", least, frozen)
    lost = np.linalg.svd(_characteristic(frozen, 1j * frequency, delay))[2][-1].conj()
    rate = growth(frozen, BEYOND * delay)
    return DelayMargin(delay, *frozen.place(lost), frequency, rate, "analysis", least, frozen)


def crossings(frozen: Frozen) -> list[tuple[float, float]]:
    """All pairs of a delay, s, and a frequency, rad/s, at which a root first stands on the imaginary axis."""
    from scipy.optimize import brentq

    grid = _frequencies(frozen)
    excess = np.concatenate([np.abs(_loops(frozen, part)) - 1 for part in _parts(grid)])
    found = []
    for k, mode in zip(*np.nonzero(np.diff(np.sign(excess), axis=0)), strict=True):

        def beyond(omega: float, mode: int = int(mode)) -> float:
            return float(np.abs(_loops(frozen, np.array([omega]))[0, mode]) - 1)

        omega = float(brentq(beyond, grid[k], grid[k + 1], xtol=1e-12))
        there = _loops(frozen, np.array([omega]))[0]
        on_circle = there[np.abs(np.abs(there) - 1) < SAME]  # often in pairs, z and -z
        found += [(float(angle % (2 * np.pi)) / omega, omega) for angle in np.angle(on_circle)]
    return found


def growth(frozen: Frozen, delay: float) -> float:
    """Real part of the rightmost root with a delay, s, in 1/s, the roots at 0 left out.

    What is under way is a state of its own, kept at Chebyshev points, whose eigenvalues are near the roots;
    Newton's method makes them exact.
    """
    roots = np.linalg.eigvals(frozen.own + frozen.delayed if delay == 0 else _generator(frozen, delay))
    moving = roots[np.argsort(np.abs(roots))[frozen.still :]]
    rightmost = moving[np.argsort(-moving.real)[:8]]
    return max(float(_refined(frozen, complex(root), delay).real) for root in rightmost if root.imag >= 0)


def _frequencies(frozen: Frozen) -> np.ndarray:
    """Frequencies to look at, rad/s, up to |A_0| + |A_1|: no larger one solves the equation."""
    from scipy.linalg import matrix_balance

    rates = np.abs(np.linalg.eigvals(frozen.own + frozen.delayed))
    low = SLOWEST * rates[rates > 1e-6 * rates.max()].min()
    own, delayed = frozen.own, frozen.delayed
    _, (scale, _) = matrix_balance(np.abs(own) + np.abs(delayed), permute=False, separate=True)
    high = sum(np.linalg.norm(part * scale / scale[:, None], 2) for part in (own, delayed))
    return np.geomspace(low, high, int(PER_DECADE * np.log10(high / low)))


def _parts(grid: np.ndarray) -> list[np.ndarray]:
    return np.array_split(grid, -(-len(grid) // BLOCK))


def _loops(frozen: Frozen, omega: np.ndarray) -> np.ndarray:
    """Eigenvalues of G(j omega), (F, rank of A_1), the largest first, at some frequencies, (F,)."""
    U, V = _factors(frozen)
    G = V @ np.linalg.solve(1j * omega[:, None, None] * np.eye(len(frozen.own)) - frozen.own, U)
    values = np.linalg.eigvals(G)
    return np.take_along_axis(values, np.argsort(-np.abs(values), axis=1), axis=1)


def _factors(frozen: Frozen) -> tuple[np.ndarray, np.ndarray]:
    """U, (X, r), and V^T, (r, X), of A_1 = U V^T, which has the rank r."""
    U, S, V = np.linalg.svd(frozen.delayed)
    rank = int((1e-13 * S[0] < S).sum())
    return U[:, :rank] * S[:rank], V[:rank]


def _characteristic(frozen: Frozen, s: complex, delay: float) -> np.ndarray:
    """s - A_0 - A_1 e^{-sd}."""
    return s * np.eye(len(frozen.own)) - frozen.own - np.exp(-s * delay) * frozen.delayed


def _refined(frozen: Frozen, s: complex, delay: float) -> complex:
    """A root near s, by Newton's method for the logarithm of the determinant."""
    for _ in range(6):
        slope = np.eye(len(frozen.own)) + delay * np.exp(-s * delay) * frozen.delayed
        try:
            s -= 1 / np.trace(np.linalg.solve(_characteristic(frozen, s, delay), slope))
        except np.linalg.LinAlgError:
            break
    return s


def _generator(frozen: Frozen, delay: float) -> np.ndarray:
    """The generator of the cell with what is under way at Chebyshev points between now and `delay` ago.

    Only V^T x is kept, the part of x that acts when it arrives.
    """
    U, V = _factors(frozen)
    slope = differentiation(POINTS) * 2 / delay
    arriving = np.kron(np.eye(POINTS)[-1:], U)
    entering, along = np.kron(slope[1:, :1], V), np.kron(slope[1:, 1:], np.eye(len(V)))
    return np.block([[frozen.own, arriving], [entering, along]])


def differentiation(points: int) -> np.ndarray:
    """Values at x_k = cos(k pi / points), k = 0 .. points -> derivatives there."""
    k = np.arange(points + 1)
    x = np.cos(np.pi * k / points)
    weight = np.where((k == 0) | (k == points), 2.0, 1.0) * (-1.0) ** k
    apart = x[:, None] - x + np.eye(points + 1)
    D = np.outer(weight, 1 / weight) / apart
    return D - np.diag(D.sum(axis=1))
