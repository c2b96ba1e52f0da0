"""Small errors of a cell that is held at one place: what learns, rubs and is sampled is among it.

The frozen cell x = (W, y, y') of `frozen` with p = Y tilde, the torque that estimates lack:

    y'' = (as there) + M^-1 (p - F_b s - F_o y'),      p' = -G s,      G = Y Gamma Y^T,

where F_b is friction that the regressor has, F_o friction that it has not, and Y is that of the desired
motion there. Any adaptation has its own G, see `learned`. Sampled control holds torque, and moves W and p on
with the rates of the sample:

    y'' = a_k - M^-1 F_o y' until the next sample,     W_{k+1} = W_k + T W'_k,     p_{k+1} = p_k + T p'_k.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..control.controller import Controller
from ..control.gains import Gains
from ..control.laws.sun_mills import BoundSunMills
from ..errors import InputError
from ..robots.parameters import FrictionParameters
from ..simulation.closed_loop import ClosedLoop
from ..simulation.rates import learned
from .frozen import Frozen, frozen_with_slips
from .period_margin import first_loss

#: share of the largest rate below which a rate counts as 0
ZERO = 1e-9
#: steps looked at, times the largest rate: no step of RK4 beyond 4 is stable, no period beyond 8
STEPS = np.geomspace(0.02, 4.0, 400)
PERIODS = np.geomspace(0.05, 8.0, 24)
#: by how much gains are changed to see what moves, and how much more another gain has to move a mode than
#: those before it
NUDGE, MORE = 0.01, 1.1


class Place(NamedTuple):
    """Where a cell is held: time, s, joint positions, (n, nv), and velocities and accelerations wanted."""

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


class Mode(NamedTuple):
    """One mode of small errors.

    Attributes:
        pole: real part, 1/s, and imaginary part, rad/s, not below 0.
        robot, joint: that move most, counted from 0.
        gain: the gain that moves it most, for its size.
    """

    pole: complex
    robot: int
    joint: int
    gain: str

    @property
    def rate(self) -> float:
        """How fast it falls, 1/s."""
        return -self.pole.real

    @property
    def damping(self) -> float:
        """Damping ratio: 1 does not swing, 0 swings for ever."""
        return -self.pole.real / abs(self.pole)

    def as_dict(self) -> dict[str, Any]:
        """Plain data: real and imaginary part of the pole, damping, and what it is of, counted from 0."""
        place = {"robot": self.robot, "joint": self.joint, "gain": self.gain}
        return {"real": self.pole.real, "imag": self.pole.imag, "damping": self.damping, **place}


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """x' = A x, x = (W, y, y', p), (N + 3 J,).

    Attributes:
        frozen: the first three of them, parameters known and without friction.
        A: (X, X).
        s: velocity errors s_q are s x, (J, X).
        M: mass matrices of all robots, (J, J).
        outside: slope of friction that the regressor does not have, (J,), N·m·s/rad.
    """

    frozen: Frozen
    A: np.ndarray
    s: np.ndarray
    M: np.ndarray
    outside: np.ndarray

    @property
    def parts(self) -> tuple[slice, slice, slice, slice]:
        """Where W, y, y' and p are in x."""
        N, J = self.frozen.leak.size, len(self.s)
        ends = np.cumsum([0, N, J, J, J]).tolist()
        W, y, v, p = (slice(a, b) for a, b in pairwise(ends))
        return W, y, v, p

    @cached_property
    def poles(self) -> np.ndarray:
        """Eigenvalues of A that are not 0, the slowest first, 1/s; what nothing excites here stays at 0."""
        values = np.linalg.eigvals(self.A)
        moving = values[np.abs(values) > ZERO * np.abs(values).max()]
        return moving[np.argsort(-moving.real)]

    @property
    def longest_step(self) -> float:
        """Longest step of RK4 that is stable with all poles that fall, s."""
        poles = self.poles[self.poles.real < 0]
        z = STEPS[:, None] / np.abs(poles) * poles
        lost = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) > 1
        first = np.where(lost.any(axis=0), lost.argmax(axis=0), len(STEPS) - 1)
        return float((STEPS[first] / np.abs(poles)).min())

    def sampled(self, period: float) -> np.ndarray:
        """x_k -> x_{k+1} under torque that is held for a period, s, (X, X)."""
        _, y, v, _ = self.parts
        J, size = len(self.s), len(self.A)
        step = np.eye(size) + period * self.A
        held = _held(np.linalg.solve(self.M, np.diag(self.outside)), period)
        moved = np.zeros((2 * J, size))
        moved[:, y], moved[:, v] = held[: 2 * J, :J], held[: 2 * J, J : 2 * J]
        step[y.start : v.stop] = moved + held[: 2 * J, 2 * J :] @ self.asked
        return step

    def multiplier(self, period: float) -> float:
        """Size of the largest eigenvalue of `sampled`, without those at 1 of what nothing excites."""
        values = np.linalg.eigvals(self.sampled(period))
        still = len(self.A) - len(self.poles)
        return float(np.abs(values[np.argsort(np.abs(values - 1))[still:]]).max())

    @property
    def longest_period(self) -> float:
        """Longest period of sampled control up to which every shorter one is stable, s."""
        fastest = float(np.abs(np.linalg.eigvals(self._without_friction)).max())
        return first_loss(lambda T: self.multiplier(T) > 1, PERIODS / fastest)

    @property
    def asked(self) -> np.ndarray:
        """y'' without the friction that no torque answers, (J, X)."""
        return self._without_friction[self.parts[2]]

    @property
    def _without_friction(self) -> np.ndarray:
        """A without the friction that no torque answers."""
        v = self.parts[2]
        A = self.A.copy()
        A[v, v] += np.linalg.solve(self.M, np.diag(self.outside))
        return A


def _held(friction: np.ndarray, period: float) -> np.ndarray:
    """(y, y', a) -> the same a period later, where y'' = a - friction y', (3 J, 3 J)."""
    from scipy.linalg import expm

    J, one = len(friction), np.eye(len(friction))
    rates = np.zeros((3 * J, 3 * J))
    rates[:J, J : 2 * J], rates[J : 2 * J, J : 2 * J], rates[J : 2 * J, 2 * J :] = one, -friction, one
    return np.asarray(expm(period * rates))


def check_law(controller: Controller) -> None:
    """Refuse another law than the paper's.

    Raises:
        InputError: its gains are others.
    """
    if type(controller.law) is not BoundSunMills:
        found = type(controller.law).__name__.removeprefix("Bound")
        raise InputError.expected("the law SunMills, without injection or diffusion", found, "law")


class Linearized:
    """What a linear loop is put together from, so that gains can be changed one by one.

    Args:
        loop: the closed loop.
        place: where it is held.
        slopes: of friction, (n, nv), N·m·s/rad, for example `plant.viscous`; that of Coulomb friction at rest
            is `plant.coulomb / plant.smoothing`, from which joints that move are soon gone.

    Raises:
        InputError: another law than the paper's.
    """

    def __init__(self, loop: ClosedLoop, place: Place, slopes: np.ndarray):
        check_law(loop.controller)
        self.controller, self.place, cell = loop.controller, place, loop.cell
        self.joints = [robot.nv for robot in cell.robots]
        self.slopes = slopes
        self.M, self.G, self.inside, self.outside = (_diagonal(part) for part in zip(
            *(self._robot(loop, i) for i in range(cell.n)), strict=True
        ))  # fmt: skip

    @property
    def size(self) -> int:
        """Number of states of small errors."""
        return self.controller.cell.n * self.controller.cell.m + 3 * sum(self.joints)

    def loop(self, gains: Gains | None = None, learning: float = 1.0) -> LinearLoop:
        """The linear loop, with other gains, and with what learns so many times as fast."""
        given = self.controller
        gains = given.gains if gains is None else gains
        again = Controller(given.cell, gains.replace(Gamma=0.0), k_r_space=given.k_r_space)
        frozen, s = frozen_with_slips(again, self.place.q, self.place.t)
        N, J = frozen.leak.size, len(s)
        s = np.hstack((s, np.zeros((J, J))))
        v, p = slice(N + J, N + 2 * J), slice(N + 2 * J, N + 3 * J)
        A = np.zeros((N + 3 * J,) * 2)
        A[: N + 2 * J, : N + 2 * J] = frozen.own + frozen.delayed
        A[v] -= np.linalg.solve(self.M, self.inside @ s)
        A[v, v] -= np.linalg.solve(self.M, self.outside)
        A[v, p] = np.linalg.inv(self.M)
        A[p] = -learning * self.G @ s
        return LinearLoop(frozen, A, s, self.M, np.diag(self.outside))

    def _robot(self, loop: ClosedLoop, i: int) -> tuple[np.ndarray, ...]:
        """M, G, F_b and F_o of one robot, (nv, nv) each."""
        cell, k = loop.cell, self.joints[i]
        q, v, a = (row[i, :k] for row in self.place[1:])
        Y = cell.parameters[i].regressor(q, v, v, a)
        G = learned(loop, i, np.pad(Y, ((0, 0), (0, cell.theta.shape[1] - Y.shape[1]))))
        slope, told = np.diag(self.slopes[i, :k]), isinstance(cell.parameters[i], FrictionParameters)
        viscous = np.diag(loop.plant.viscous[i, :k])
        inside = viscous if told else 0 * slope
        outside = 0 * slope if told else slope
        return cell.robots[i].mass_matrix(q), (G + G.T) / 2, inside, outside


def modes_of(whole: Linearized, gains: Gains | None = None) -> list[Mode]:
    """The modes of a linear loop, the slowest first; of two that are conjugate the one that turns forward.

    Args:
        whole: the loop.
        gains: other gains than its own.
    """
    from scipy.linalg import eig

    linear = whole.loop(gains)
    values, left, right = eig(linear.A, left=True)
    changes = {name: loop.A - linear.A for name, loop in _nudged(whole, gains)}
    found = []
    for k in np.argsort(-values.real):
        if abs(values[k]) <= ZERO * np.abs(values).max() or values[k].imag < 0:
            continue
        moved = {name: abs(left[:, k].conj() @ dA @ right[:, k]) for name, dA in changes.items()}
        most = max(moved.values())
        gain = next(name for name, value in moved.items() if MORE * value >= most)
        found.append(Mode(complex(values[k]), *linear.frozen.place(right[:, k]), gain))
    return found


def _nudged(whole: Linearized, gains: Gains | None) -> Iterator[tuple[str, LinearLoop]]:
    """The loop with each of the gains that are there a little larger; first what learns."""
    gains = whole.controller.gains if gains is None else gains
    if whole.G.any():
        yield "Gamma", whole.loop(gains, 1 + NUDGE)
    for name in ("Lambda", "beta", "K_r", "K_eps"):
        if (value := getattr(gains, name)).any():
            yield name, whole.loop(gains.replace(**{name: (1 + NUDGE) * value}))


def _diagonal(parts: Sequence[np.ndarray]) -> np.ndarray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*parts))
