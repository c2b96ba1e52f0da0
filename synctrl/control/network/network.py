"""Network: the settings of a real network, and what becomes of them between the robots of a cell."""

from __future__ import annotations

from inspect import signature
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ...checks import choice, positive_number
from ...coupling.cell import Cell
from ...errors import InputError
from ..gains import Gains, spread
from .delayed import BoundDelayed
from .links import Links
from .posted import BoundPosted, Traffic
from .receivers import Extrapolate, Filter, Hold, Receiver
from .settings import (
    above_0,
    burst_of,
    is_given,
    not_too_large,
    of_pairs,
    plain,
    probability,
    row_of,
    seed_of,
)
from .slips import with_slips
from .w_form import WForm

RECEIVERS = "hold", "filter", "extrapolate"
#: settings that only messages have
OF_MESSAGES = "jitter", "loss", "burst", "event", "heartbeat"
#: how many messages of a robot may be on the way at once: they are all part of the state
ON_THE_WAY = 10_000


class Network:
    """Robots that tell each other what they know of their own errors, in the W form, see `Links`.

    Delay, jitter and loss may be numbers or (n, n), where entry [i, j] is of what robot i hears from robot j,
    and the diagonal does not count; times are in s.

    Args:
        period: between two messages of a robot; None for exchange in continuous time, with exact delays.
        delay: how late a robot hears another; in continuous time 0 or at least 1e-6.
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
        self.period = None if period is None else not_too_large("period", positive_number("period", period))
        self.delay, self.jitter = of_pairs("delay", delay), of_pairs("jitter", jitter)
        self.loss, self.burst = probability("loss", loss), burst_of(burst)
        self.offset = not_too_large("offset", row_of("offset", offset))
        self.event = None if event is None else above_0("event", event)
        self.heartbeat = None if heartbeat is None else positive_number("heartbeat", heartbeat)
        self.receiver = choice("receiver", receiver, RECEIVERS)
        self.omega, self.seed = not_too_large("omega", positive_number("omega", omega)), seed_of(seed)
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
        fastest = cell.coupling.degree * float(beta.max(initial=0.0))
        return self._bound(cell, leak, 1 / fastest if fastest > 0 else np.inf)

    def bind_with_slips(self, cell: Cell, gains: Gains) -> WForm:
        """`bind_for` of robots that tell each other r as well, for a law that needs it.

        Raises:
            InputError: see `bind_for`.
        """
        return with_slips(self.bind_for(cell, gains), cell, gains)

    def replace(self, **changes: Any) -> Self:
        """This network with some of its settings changed.

        Raises:
            InputError: no setting of that name, or values that such a network cannot have.
        """
        known = signature(Network).parameters
        if unknown := sorted(set(changes) - set(known)):
            raise InputError.expected(f"some of {', '.join(known)}", ", ".join(unknown), "network")
        return type(self)(**{**vars(self), **changes})

    def as_dict(self) -> dict[str, Any]:
        """Name, and the settings that are not what they are by default, as plain data."""
        return {"name": "Network", **self._given()}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self._given().items())})"

    # -- internals ----------------------------------------------------------------------------------------

    def _given(self) -> dict[str, Any]:
        """The settings that are not what they are by default, as plain data."""
        default = {name: parameter.default for name, parameter in signature(Network).parameters.items()}
        own = {name: plain(value) for name, value in vars(self).items()}
        return {name: value for name, value in own.items() if value != default[name]}

    def _check(self) -> None:
        """Refuse settings that do not go together."""
        given = [name for name in OF_MESSAGES if is_given(getattr(self, name))]
        if self.period is None and given:
            found = plain(getattr(self, given[0]))
            raise InputError.expected("a period with it: only messages have one", found, given[0])
        if self.heartbeat is not None and self.event is None:
            raise InputError.expected("an event with it", self.heartbeat, "heartbeat")
        if self.horizon is not None and self.receiver != "extrapolate":
            raise InputError.expected("receiver='extrapolate' with it", self.horizon, "horizon")

    def _bound(self, cell: Cell, leak: np.ndarray, limit: float) -> WForm:
        links = Links(cell.coupling)
        delay, jitter, loss = (links.of(self._of_links(name, cell.n)) for name in ("delay", "jitter", "loss"))
        self.clocks(cell.n)
        if self.period is not None:
            longest = float((delay + jitter).max(initial=0.0))
            self._check_on_the_way(longest)
            event = None if self.event is None else spread("event", self.event, (cell.m,))
            heartbeat = np.inf if self.heartbeat is None else self.heartbeat
            traffic = Traffic(self.period, delay, jitter, loss, self.burst, event, heartbeat, self.seed)
            return BoundPosted(cell, leak, self._receiver(self.period + longest, limit), traffic)
        return BoundDelayed(cell, leak, delay) if delay.any() else WForm(cell, leak)

    def clocks(self, n: int) -> np.ndarray:
        """How much the clock of every robot is ahead, (n,), s.

        Raises:
            InputError: for another number of robots.
        """
        return spread("offset", self.offset, (n,))

    def _check_on_the_way(self, longest: float) -> None:
        """Refuse messages that need longer than the state can keep them, s."""
        room = ON_THE_WAY * (self.period or 0.0)
        if longest > room:
            raise InputError.expected(
                f"delay and jitter up to {room:g} s, with which {ON_THE_WAY} messages of a robot are on "
                "the way at once", longest, "delay",
            )  # fmt: skip

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
