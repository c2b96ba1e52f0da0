"""How seldom robots may send: the frozen cell between messages, and over one period of them.

All robots send W, w and w' at t = k period, a message arrives a delay later, and a receiver makes of the last
one what a robot hears until the next, see `Receiver`. Over one period all of that is one matrix, whose
eigenvalues are below 1 in size where the cell is stable.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice, non_negative_number, positive_number
from ..control.gains import Gains
from ..control.network.network import RECEIVERS
from ..coupling.cell import Cell
from .frozen import Frozen, freeze

#: periods looked at per factor of ten, and the shortest one, s
PER_DECADE, SHORTEST = 25, 1e-3
#: of a period or delay that is searched for, as a share of it
PRECISION = 1e-4


@dataclass(frozen=True)
class Exchange:
    """How often robots send, and what becomes of it.

    Attributes:
        period: between two messages of a robot, s.
        delay: from sending to hearing, s.
        receiver: "hold", "extrapolate" or "filter".
        omega: of the filter, rad/s.
        horizon: how long a message may be extrapolated, s.

    Raises:
        InputError: numbers that are not positive, a negative delay, or an unknown receiver.
    """

    period: float
    delay: float = 0.0
    receiver: str = "filter"
    omega: float = 50.0
    horizon: float = np.inf

    def __post_init__(self) -> None:
        positive_number("period", self.period), positive_number("omega", self.omega)
        non_negative_number("delay", self.delay)
        choice("receiver", self.receiver, RECEIVERS)

    @property
    def lasting(self) -> float:
        """For how long a message moves what a receiver has, s."""
        return self.horizon if self.receiver == "extrapolate" else np.inf


@dataclass(frozen=True)
class Receiver:
    """The three numbers that a receiver keeps of each coordinate of a sender.

    They move with `flow`, a message changes them to keep (them) + take (W, w, w'), and `read` gives what the
    robot uses for W, w and w', all (3 N, 3 N).
    """

    flow: np.ndarray
    read: np.ndarray
    keep: np.ndarray
    take: np.ndarray


def receiver_of(exchange: Exchange, leak: np.ndarray) -> Receiver:
    """What a receiver does with what it hears of N coordinates that leak at some rates, (N,), 1/s.

    Integrals that leak are extrapolated exactly here, and by the network itself to the second order.
    """
    from scipy.linalg import expm

    ahead, one, each = np.eye(3, k=1), np.eye(3), np.eye(leak.size)
    if exchange.receiver == "hold":
        return Receiver(*(np.kron(part, each) for part in (0 * one, one, 0 * one, one)))
    if exchange.receiver == "extrapolate":
        moves = np.kron(ahead, each) - np.kron(np.diag([1.0, 0.0, 0.0]), np.diag(leak))
        aged = expm(min(exchange.delay, exchange.horizon) * moves)
        return Receiver(moves, np.kron(one, each), 0 * moves, aged)
    omega, sent = exchange.omega, np.diag([1.0, 0.0, 0.0])
    pull = np.array([omega**2, -(omega**2), -2 * omega])
    flow, read = np.vstack((0 * pull, ahead[1], pull)), np.vstack((ahead[0], ahead[1], pull))
    forgotten = np.kron(np.diag([0.0, 1.0, 1.0]) @ ahead.T @ ahead, np.diag(leak))
    moves, reads, keep, take = (np.kron(part, each) for part in (flow, read, one - sent, sent))
    return Receiver(moves, reads + forgotten, keep, take)


def monodromy(frozen: Frozen, exchange: Exchange) -> np.ndarray:
    """The cell, its receivers and the messages under way, just before robots send -> a period later.

    Messages stand behind the receivers in the order in which they were sent, the newest first; the oldest is
    the one that arrives within this period.
    """
    receiver = receiver_of(exchange, frozen.leak)
    X, R = len(frozen.own), len(receiver.flow)
    periods, rest = divmod(exchange.delay, exchange.period)
    size = X + R * (2 + int(periods))
    whole, arrival = np.zeros((size, size)), np.eye(size)
    whole[: X + R, : X + R] = np.eye(X + R)
    whole[X + R : X + 2 * R, :X] = frozen.sent
    whole[X + 2 * R :, X + R : -R] = np.eye(size - X - 2 * R)
    arrival[X : X + R, X : X + R], arrival[X : X + R, -R:] = receiver.keep, receiver.take
    old = exchange.delay - rest + exchange.period
    whole[: X + R] = between(frozen, receiver, old, rest, exchange.lasting) @ whole[: X + R]
    whole = arrival @ whole
    left = exchange.period - rest
    whole[: X + R] = between(frozen, receiver, exchange.delay, left, exchange.lasting) @ whole[: X + R]
    return whole


def between(frozen: Frozen, receiver: Receiver, age: float, duration: float, lasting: float) -> np.ndarray:
    """Cell and receivers over a time without messages, s, after a message of an age, s."""
    moving = min(duration, max(0.0, lasting - age))
    return _flow(frozen, receiver, duration - moving, 0.0) @ _flow(frozen, receiver, moving, 1.0)


def _flow(frozen: Frozen, receiver: Receiver, duration: float, moves: float) -> np.ndarray:
    """The same where receivers move, moves = 1, or have stopped to, 0."""
    from scipy.linalg import expm

    size = len(frozen.own) + len(receiver.flow)
    if duration <= 0:
        return np.eye(size)
    still = np.zeros((len(receiver.flow), len(frozen.own)))
    rates = np.block([[frozen.own, frozen.heard @ receiver.read], [still, moves * receiver.flow]])
    return expm(duration * rates)


def multiplier(frozen: Frozen, exchange: Exchange) -> float:
    """Size of the largest eigenvalue of `monodromy`, those at 1 left out that are there for every period."""
    whole = monodromy(frozen, exchange)
    counts = whole.any(axis=0)  # what is nowhere remembered has eigenvalues 0
    values = np.linalg.eigvals(whole[np.ix_(counts, counts)])
    moving = values[np.argsort(np.abs(values - 1))[frozen.still :]]
    return float(np.abs(moving).max())


def sampled_growth(frozen: Frozen, exchange: Exchange) -> float:
    """How fast the slowest mode grows between robots that send once a period, 1/s."""
    return float(np.log(multiplier(frozen, exchange)) / exchange.period)


def period_margin(
    cell: Cell,
    gains: Gains,
    *,
    receiver: str = "filter",
    omega: float = 50.0,
    delay: float = 0.0,
    horizon: float | None = None,
    longest: float = 1.0,
    q: ArrayLike | None = None,
    t: float = 0.0,
    k_r_space: str | None = None,
) -> float:
    """The longest period of messages up to which every shorter one is stable, frozen at one place, s.

    No message is lost, control is continuous, and errors are small.

    Args:
        cell, gains, q, t, k_r_space: see `delay_margin`.
        receiver: what robots do between messages: "hold", "extrapolate" or "filter".
        omega: of the filter, rad/s.
        delay: of every message, s.
        horizon: how long a message may be extrapolated, s; by default 1/(beta a), a = max (S^T S)_ii.
        longest: period up to which is looked, s.

    Returns:
        The period, s; infinite if the cell is stable up to `longest`, 0 if it is nowhere.

    Raises:
        InputError: a value that does not fit, named.
    """
    frozen = freeze(cell, gains, q=q, t=t, k_r_space=k_r_space)
    horizon = frozen.horizon if horizon is None else horizon
    first = Exchange(SHORTEST, delay, receiver, omega, horizon)

    def lost(period: float) -> bool:
        return multiplier(frozen, replace(first, period=period)) > 1

    count = int(PER_DECADE * np.log10(positive_number("longest", longest) / SHORTEST)) + 2
    return first_loss(lost, np.geomspace(SHORTEST, longest, count))


def first_loss(lost: Callable[[float], bool], grid: np.ndarray) -> float:
    """Where something is first lost, to `PRECISION`: infinite if nowhere on a grid, 0 if at once."""
    at = next((k for k, value in enumerate(grid) if lost(float(value))), None)
    if at is None or at == 0:
        return np.inf if at is None else 0.0
    low, high = float(grid[at - 1]), float(grid[at])
    while high - low > PRECISION * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if lost(middle) else (middle, high)
    return low
