"""How fast small errors decay over delay and loss of messages: the frozen cell with chance in its links.

Robots send at t = k period, every message of a link is lost or not by itself, and comes whole periods later.
Then all periods are alike but for what comes: a product of matrices of which chance chooses the factors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..checks import count, finite_array, instance, positive_number
from ..control.gains import Gains
from ..control.network import Links, Network
from ..coupling.cell import Cell
from ..errors import InputError
from .frozen import Frozen, freeze
from .period_margin import Exchange, between, receiver_of

#: settings of a network that a map has no place for
ELSEWHERE = "jitter", "burst", "event", "offset"
#: errors as a share of all that moves, below which they are rounding
ROUNDING = 1e-9
#: periods of a trial after the first message has come
FEWEST = 8


@dataclass(frozen=True)
class DelayMap:
    """How fast small errors grow, by delay and loss of the messages.

    Attributes:
        delays: (D,), s, whole periods.
        losses: (P,), probabilities.
        growth: slope of log |(y, y')|, the errors of all joints and their rates, in the trial in which they
            fell least, over the second half of the time in which they are more than rounding, (D, P), 1/s.
        period: between two messages of a robot, s.
    """

    delays: np.ndarray
    losses: np.ndarray
    growth: np.ndarray
    period: float

    @property
    def stable(self) -> np.ndarray:
        """Whether errors fell in every trial, (D, P)."""
        return self.growth < 0


def delay_map(
    cell: Cell,
    gains: Gains,
    network: Network,
    delays: ArrayLike,
    losses: ArrayLike,
    *,
    seed: int = 0,
    trials: int = 5,
    duration: float = 4.0,
    q: ArrayLike | None = None,
    t: float = 0.0,
    k_r_space: str | None = None,
) -> DelayMap:
    """The decay of small errors over a grid of constant delay and independent loss, frozen at one place.

    All points of the grid have the same chances: what is lost with one loss is lost with a larger one too.

    Args:
        cell, gains, q, t, k_r_space: see `delay_margin`.
        network: its period and its receiver; delay and loss are those of the grid.
        delays, losses: (D,), s, which are rounded to whole periods, and (P,), probabilities below 1.
        seed: of chance.
        trials: how often each point is tried; the worst one counts.
        duration: of a trial, s.

    Raises:
        InputError: a value that does not fit, or a network that a map has no place for, named.
    """
    links = Links(cell.coupling)
    frozen = by_link(freeze(cell, gains, q=q, t=t, k_r_space=k_r_space), links)
    exchange = _exchange(network, frozen)
    late = np.rint(_within("delays", delays, np.inf) / exchange.period).astype(int)
    losses, trials = _within("losses", losses, 1.0), count("trials", trials)
    steps, rng = _steps(duration, exchange, late), np.random.default_rng(count("seed", seed, least=0))
    lost = (rng.random((steps, links.count, 1, trials)) < losses[:, None]).reshape(steps, links.count, -1)
    start = np.tile(_start(frozen, rng, trials), losses.size)
    slopes = [_slopes(*_trial(frozen, exchange, int(k), lost, start), exchange.period) for k in late]
    worst = np.reshape(slopes, (late.size, losses.size, trials)).max(axis=2)
    return DelayMap(late * exchange.period, losses, worst, exchange.period)


def _steps(duration: float, exchange: Exchange, late: np.ndarray) -> int:
    """How many periods a trial lasts, in which messages come so many periods late, (D,)."""
    steps, least = int(positive_number("duration", duration) / exchange.period), FEWEST + int(late.max())
    if steps < least:
        expected = f"at least {exchange.period * least:g} s, for the delay"
        raise InputError.expected(expected, duration, "duration")
    return steps


def by_link(frozen: Frozen, links: Links) -> Frozen:
    """The same cell with a sender for every link in the place of one for every robot.

    What robots hear and send has three rows per link and coordinate then, (3 l m,), instead of (3 n m,).
    """
    n, moved, N = len(frozen.joints), sum(frozen.joints), frozen.leak.size
    each = np.arange(N).reshape(n, -1)[links.sender].ravel()
    every = np.concatenate([kind * N + each for kind in range(3)])
    robots = np.zeros((len(frozen.own), n))
    robots[N + moved : N + 2 * moved] = np.repeat(np.eye(n), frozen.joints, axis=0)
    hears = np.tile(robots[:, links.hearer].repeat(N // n, axis=1), 3)
    heard = frozen.heard[:, every] * hears
    return replace(frozen, heard=heard, sent=frozen.sent[every], leak=frozen.leak[each])


def _exchange(network: Network, frozen: Frozen) -> Exchange:
    """Period and receiver of a network."""
    instance("network", network, Network, "a Network")
    if network.period is None:
        raise InputError.expected("a period, for messages are what may be lost", None, "network.period")
    for name in ELSEWHERE:
        value = getattr(network, name)
        if value is not None and np.any(value):
            raise InputError.expected("none, which a map has no place for", value, f"network.{name}")
    horizon = frozen.horizon if network.horizon is None else network.horizon
    return Exchange(network.period, 0.0, network.receiver, network.omega, horizon)


def _within(name: str, values: ArrayLike, below: float) -> np.ndarray:
    array = finite_array(name, values, (None,))
    if array.size == 0 or array.min() < 0 or array.max() >= below:
        raise InputError.expected(f"one or more numbers from 0 to below {below:g}", array.tolist(), name)
    return array


def _start(frozen: Frozen, rng: np.random.Generator, trials: int) -> np.ndarray:
    """Errors of all joints and their rates at random, and integrals of 0, (X, trials)."""
    x = rng.standard_normal((len(frozen.own), trials))
    x[: len(x) - 2 * sum(frozen.joints)] = 0.0
    return x


def _trial(
    frozen: Frozen, exchange: Exchange, late: int, lost: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cells with messages of which some are lost, C of them at once, each in a column.

    Args:
        frozen: with a sender for every link.
        exchange: period and receiver.
        late: how many periods a message takes.
        lost: whether a message is, (steps, l, C).
        x: where the cells start, (X, C).

    Returns:
        Errors as a share of all that moves after every period, (steps, C), and the log of them, (steps, C).
    """
    exchange = replace(exchange, delay=late * exchange.period)
    receiver, X, errors = receiver_of(exchange, frozen.leak), len(x), 2 * sum(frozen.joints)
    kinds, flows = _flows(frozen, exchange, len(lost))
    link = np.tile(np.arange(lost.shape[1]).repeat(frozen.leak.size // lost.shape[1]), 3)
    under_way, since = np.zeros((late + 1, link.size, x.shape[1])), np.zeros(lost.shape[1:], int)
    held, scale = receiver.take @ (frozen.sent @ x), np.zeros(x.shape[1])
    shares, logs = np.empty((2, len(lost), x.shape[1]))
    for k in range(len(lost)):
        under_way[k % (late + 1)] = frozen.sent @ x
        came = ~lost[k - late] & (k >= late)
        news = receiver.keep @ held + receiver.take @ under_way[(k + 1) % (late + 1)]
        held, since = np.where(came[link], news, held), np.where(came, 0, since + 1)
        x, held = np.split(_moved(flows, np.concatenate((x, held)), kinds[since][link]), [X])
        size = np.linalg.norm(x, axis=0)
        x, held, under_way, scale = x / size, held / size, under_way / size, scale + np.log(size)
        shares[k] = np.linalg.norm(x[X - errors :], axis=0)
        logs[k] = scale + np.log(shares[k])
    return shares, logs


def _flows(frozen: Frozen, exchange: Exchange, longest: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Cell and receivers over a period, by how long receivers move in it.

    Returns:
        By the number of periods since a message came, 0 .. longest, which matrix counts, and the matrices.
    """
    receiver = receiver_of(exchange, frozen.leak)
    ages = exchange.delay + exchange.period * np.arange(longest + 1)
    moves = np.clip(exchange.lasting - ages, 0.0, exchange.period)
    _, first, kinds = np.unique(moves, return_index=True, return_inverse=True)
    flows = [between(frozen, receiver, ages[k], exchange.period, exchange.lasting) for k in first]
    return kinds, flows


def _moved(flows: list[np.ndarray], state: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """Cells and what they hold, (X + 3 l m, C), after a period; kinds: of what is held, (3 l m, C)."""
    X = len(state) - len(kinds)
    every = np.concatenate((np.zeros((X, state.shape[1]), int), kinds))  # nothing of the cell depends on them
    return np.sum([flow @ np.where(every == kind, state, 0.0) for kind, flow in enumerate(flows)], axis=0)


def _slopes(shares: np.ndarray, logs: np.ndarray, period: float) -> np.ndarray:
    """Slope of the second half of every column of logs, up to where its errors are rounding, (C,), 1/s."""
    slopes = []
    for share, log in zip(shares.T, logs.T, strict=True):
        end = max(FEWEST, int(np.argmax(share < ROUNDING)) or len(log))
        half = np.arange(end // 2, end)
        slopes.append(np.polyfit(half * period, log[half], 1)[0])
    return np.array(slopes)
