"""Network: the settings of a real network, and what becomes of them between the robots of a cell."""

from __future__ import annotations

from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import choice, count, finite_array, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ..gains import Gains, spread
from .delayed import BoundDelayed
from .links import Links
from .posted import BoundPosted, Traffic
from .receivers import Extrapolate, Filter, Hold, Receiver
from .w_form import WForm

RECEIVERS = "hold", "filter", "extrapolate"
#: settings that only messages have, with what they are if nobody gives them
OF_MESSAGES = {"jitter": 0.0, "loss": 0.0, "burst": None, "event": None, "heartbeat": None}


class Network:
    """Robots that tell each other what they know of their own errors, in the W form, see `Links`.

    Delay, jitter and loss may be numbers or (n, n), where entry [i, j] is of what robot i hears from robot j;
    times are in s.

    Args:
        period: between two messages of a robot; None for exchange in continuous time, with exact delays.
        delay: how late a robot hears another.
        jitter: longest random addition to the delay of a message.
        loss: probability that a message is lost, below 1.
        burst: probabilities per message that a link goes from good to bad, and from bad to good; in between
            all its messages are lost.
        offset: how much the clock of every robot is ahead, a number or (n,): it follows what is desired at
            t + offset.
        event: threshold, in the unit of c e, a number or (m,): a robot sends only if its w is farther than
            that from what its last message predicts.
        heartbeat: longest silence with an event; by default none is too long.
        receiver: what is believed between messages, "filter", "hold" or "extrapolate", see `receivers.py`.
        omega: rate of the filter, rad/s.
        seed: of chance: losses, bursts and jitter.
        horizon: age up to which "extrapolate" does so; by default 1/(beta a) with a the largest entry of the
            diagonal of S^T S, beyond which it may make a cell diverge.

    Raises:
        InputError: no such number, probability, word or seed, or one that does not go with the others.
    """

    def __init__(
        self,
        period: float | None = None,
        delay: ArrayLike = 0.0,
        jitter: ArrayLike = 0.0,
        loss: ArrayLike = 0.0,
        burst: tuple[float, float] | None = None,
        offset: ArrayLike = 0.0,
        event: ArrayLike | None = None,
        heartbeat: float | None = None,
        receiver: str = "filter",
        omega: float = 50.0,
        seed: int = 0,
        horizon: float | None = None,
    ):
        self.period = None if period is None else positive_number("period", period)
        self.delay, self.jitter = (_at_least_0(k, v) for k, v in (("delay", delay), ("jitter", jitter)))
        self.loss, self.burst = _probability("loss", loss), _burst(burst)
        self.offset = finite_array("offset", offset)
        self.event = None if event is None else _above_0("event", event)
        self.heartbeat = None if heartbeat is None else positive_number("heartbeat", heartbeat)
        self.receiver = choice("receiver", receiver, RECEIVERS)
        self.omega, self.seed = positive_number("omega", omega), count("seed", seed, least=0)
        self.horizon = None if horizon is None else positive_number("horizon", horizon)
        self._check()

    def bind(self, cell: Cell) -> WForm:
        """This network for a cell whose gains are not known: its integrals do not leak.

        Raises:
            InputError: see `bind_for`.
        """
        return self._bound(cell, np.zeros(cell.m), np.inf)

    def bind_for(self, cell: Cell, gains: Gains) -> WForm:
        """This network for a cell and the gains of its controller.

        Raises:
            InputError: settings for another number of robots or task coordinates, or messages that are
                extrapolated too far.
        """
        beta, leak = (spread(name, getattr(gains, name), (cell.m,)) for name in ("beta", "leak"))
        share = float(Links(cell.coupling).own.max(initial=0.0)) * float(beta.max(initial=0.0))
        return self._bound(cell, leak, 1 / share if share > 0 else np.inf)

    def as_dict(self) -> dict[str, Any]:
        """Name, and the settings that are not what they are by default, as plain data."""
        default = {name: parameter.default for name, parameter in signature(Network).parameters.items()}
        own = {name: plain(value) for name, value in vars(self).items()}
        return {"name": "Network", **{k: v for k, v in own.items() if v != default.get(k)}}

    # -- internals ----------------------------------------------------------------------------------------

    def _check(self) -> None:
        """Refuse settings that do not go together."""
        given = {name: plain(getattr(self, name)) != plain(default) for name, default in OF_MESSAGES.items()}
        if self.period is None and any(given.values()):
            name = next(name for name, is_given in given.items() if is_given)
            found = plain(getattr(self, name))
            raise InputError.expected("a period with it: only messages have one", found, name)
        if self.heartbeat is not None and self.event is None:
            raise InputError.expected("an event with it", self.heartbeat, "heartbeat")
        if self.horizon is not None and self.receiver != "extrapolate":
            raise InputError.expected("receiver='extrapolate' with it", self.horizon, "horizon")

    def _bound(self, cell: Cell, leak: np.ndarray, limit: float) -> WForm:
        links = Links(cell.coupling)
        delay, jitter, loss = (links.of(self._of_links(name, cell.n)) for name in ("delay", "jitter", "loss"))
        self.clocks(cell.n)
        if self.period is not None:
            oldest = self.period + float((delay + jitter).max(initial=0.0))
            event = None if self.event is None else spread("event", self.event, (cell.m,))
            heartbeat = np.inf if self.heartbeat is None else self.heartbeat
            traffic = Traffic(self.period, delay, jitter, loss, self.burst, event, heartbeat, self.seed)
            return BoundPosted(cell, leak, self._receiver(oldest, limit), traffic)
        return BoundDelayed(cell, leak, delay) if delay.any() else WForm(cell, leak)

    def clocks(self, n: int) -> np.ndarray:
        """How much the clock of every robot is ahead, (n,), s.

        Raises:
            InputError: for another number of robots.
        """
        return spread("offset", self.offset, (n,))

    def _of_links(self, name: str, n: int) -> np.ndarray:
        """A setting of every link, (n, n)."""
        value = getattr(self, name)
        if value.shape not in ((), (n, n)):
            raise InputError.expected(f"a number or shape ({n}, {n})", value.shape, name)
        return value

    def _receiver(self, oldest: float, limit: float) -> Receiver:
        """What is believed between messages.

        Args:
            oldest: age of a message when the next one comes, if none is lost, s.
            limit: how far it may be extrapolated, s.
        """
        if self.receiver != "extrapolate":
            return Filter(self.omega) if self.receiver == "filter" else Hold()
        horizon = limit if self.horizon is None else self.horizon
        if horizon > limit:
            raise InputError.expected(
                f"at most 1/(beta a) = {limit:.3g} s, beyond which extrapolation may make a cell diverge",
                horizon, "horizon",
            )  # fmt: skip
        if self.horizon is None and oldest > limit:
            raise InputError.expected(
                f"messages that are at most 1/(beta a) = {limit:.3g} s old when the next one comes: a "
                "shorter period and delay, a horizon that says how far to extrapolate, or receiver='filter'",
                oldest, "receiver='extrapolate'",
            )  # fmt: skip
        return Extrapolate(horizon)


def plain(value: Any) -> Any:
    """A setting as plain data."""
    return (
        value.tolist()
        if isinstance(value, np.ndarray)
        else list(value)
        if isinstance(value, tuple)
        else value
    )


def _at_least_0(name: str, value: ArrayLike) -> np.ndarray:
    array = finite_array(name, value)
    if array.min(initial=0.0) < 0:
        raise InputError.expected("times of at least 0, s", float(array.min()), name)
    return array


def _above_0(name: str, value: ArrayLike) -> np.ndarray:
    array = finite_array(name, value)
    if array.min(initial=np.inf) <= 0:
        raise InputError.expected("numbers above 0", float(array.min()), name)
    return array


def _probability(name: str, value: ArrayLike) -> np.ndarray:
    array = _at_least_0(name, value)
    if array.max(initial=0.0) >= 1:
        raise InputError.expected(
            "probabilities below 1, or nothing would ever come", float(array.max()), name
        )
    return array


def _burst(value: Any) -> tuple[float, float] | None:
    """Probabilities of turning bad, and of healing."""
    if value is None:
        return None
    turns, heals = finite_array("burst", value, (2,)).tolist()
    if not (0 <= turns <= 1 and 0 < heals <= 1):
        wanted = "probabilities of turning bad, 0 to 1, and of turning good, above 0"
        raise InputError.expected(wanted, (turns, heals), "burst")
    return turns, heals
