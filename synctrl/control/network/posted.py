"""A network of messages: they are sent once in a period, come late, out of order, or not at all.

At t_k = k period every robot sends (t_k, W, w, w'), or W alone, to who hears it. On a link a message needs
its delay and a random part of the jitter, and is lost with a probability, or while the link is in its bad
state (Gilbert and Elliott). Of messages that have come the one with the latest stamp counts. With an event a
robot sends only what others could not have predicted: if |w - (w_s + age w_s')| of what it sent last exceeds
the threshold in some coordinate, or after the heartbeat.

What chance does to message k is a function of the seed and k alone. Everybody has heard everybody at the
beginning.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from ...coupling.cell import Cell
from .links import Links
from .receivers import Receiver, Shapes
from .w_form import ASK, WForm, check_number

#: the theorem that covers it, with a filter
FILTER = "a filter under any loss"
#: stands for an instant that does not come, in a memory of finite numbers, s
NEVER = 1e300
#: how far an instant may be from the one that it is, as a share of the period
NEAR = 1e-9


class Traffic(NamedTuple):
    """When messages are sent, and what happens to them on the way.

    Attributes:
        period: between two messages of a robot, s.
        delay, jitter: of every link, (l,), s; the jitter is the longest random addition.
        loss: probability of every link, (l,).
        burst: probabilities per message to go from good to bad, and back; None if no link is ever bad.
        event: threshold for w, (m,), or None to send always.
        heartbeat: longest silence with an event, s.
        seed: of chance.
    """

    period: float
    delay: np.ndarray
    jitter: np.ndarray
    loss: np.ndarray
    burst: tuple[float, float] | None
    event: np.ndarray | None
    heartbeat: float
    seed: int

    @property
    def on_the_way(self) -> int:
        """How many messages of a robot may be on the way at once, with the one that is just sent."""
        return int((self.delay + self.jitter).max(initial=0.0) / self.period + NEAR) + 2


class Chance:
    """What chance does to message k on every link: loss, jitter, and a change to or from bad, (3, l).

    Args:
        seed: of chance.
        links: how many there are, l.
        room: for how many messages it is kept.
    """

    def __init__(self, seed: int, links: int, room: int):
        self._given = seed, links, room
        self._drawn = lru_cache(room)(partial(_draw, seed, links))

    def __call__(self, k: int) -> np.ndarray:
        return self._drawn(k)

    def __reduce__(self) -> tuple[type, tuple[int, int, int]]:
        return type(self), self._given  # what is kept is drawn again elsewhere


class BoundPosted(WForm):
    """Messages between the robots of a cell.

    Its memory has, beside W: `begun`, whether there was a first message; `stamp` and `held`, when the message
    that counts was sent on each link, and what it says; `stamps`, `letters` and `arrivals`, what was sent
    last, in places that are used over and over again, and when it comes; `bad`, whether a link is; `sent` and
    `come`, how many messages robots sent, and how many came; `told`, what a robot sent last, with its stamp.

    Args:
        cell: the cell.
        leak: rate at which integrals are forgotten, (m,), 1/s.
        receiver: what is believed between messages.
        traffic: makes what happens to messages of the links.
        links: who hears whom, by default as the coupling says.

    Attributes:
        receiver, traffic: as given.
    """

    def __init__(
        self,
        cell: Cell,
        leak: np.ndarray,
        receiver: Receiver,
        traffic: Traffic,
        links: Links | None = None,
    ):
        n, m, l, rows = cell.n, cell.m, len(traffic.delay), receiver.rows
        places, tells = traffic.on_the_way, traffic.event is not None
        super().__init__(
            cell, leak, links, **receiver.shapes(l, m), begun=(1,), stamp=(l,), held=(l, rows, m),
            stamps=(places,), letters=(places, n, rows, m), arrivals=(places, l), bad=(l,), sent=(n,),
            come=(l,), told=(n * tells, 1 + 2 * m), **self.beside(places, n, l, m),
        )  # fmt: skip
        self.receiver, self.traffic, self.jumps = receiver, traffic, receiver.jumps
        self.theorem = None if receiver.jumps else FILTER
        advice = "it jumps then; send more often, or use receiver='filter'" if self.jumps else ASK
        self.suspicion = f"robots hear each other by messages every {traffic.period:g} s: {advice}"
        self._chances = Chance(traffic.seed, l, 4 * places + 16)

    def beside(self, places: int, n: int, l: int, m: int) -> Shapes:
        """Shapes of what else messages say, by name: nothing.

        Args:
            places: how many messages of a robot are kept.
            n, l, m: numbers of robots, links and task coordinates.
        """
        return {}

    def start(self) -> np.ndarray:
        memory = np.zeros(self.parts.size)
        self.parts(memory).arrivals[...] = NEVER
        return memory

    def heard(self, t: float, own: np.ndarray, memory: np.ndarray) -> np.ndarray:
        return self.receiver.believed(t, self.parts(memory), self.leak)

    def memory_rates(self, t: float, memory: np.ndarray) -> Mapping[str, np.ndarray]:
        return self.receiver.rates(self.parts(memory))

    def gap(self, t: float, memory: np.ndarray) -> np.ndarray:
        found = self.receiver.gap(t, self.parts(memory), self.leak)
        return self.links.shares(np.zeros((2, len(self.links.own), found.shape[-1])), found)

    def outside(self) -> str | None:
        return "what robots believe of each other jumps at messages" if self.jumps else None

    # -- messages -----------------------------------------------------------------------------------------

    def messages(self, start: float, end: float) -> np.ndarray:
        """Instants at which messages are sent or may arrive, with start <= t < end, s."""
        period, longest = self.traffic.period, self.traffic.on_the_way
        check_number(start, end, period, "period")
        first = max(0, int(np.floor(start / period)) - longest)
        numbers = np.arange(first, int(np.ceil(end / period)) + 1)
        sent = numbers * period
        found = np.unique(np.concatenate((sent, *self._arriving(numbers[numbers > 0]))))
        return found[(found >= start) & (found < end)]

    def meet(self, t: float, w: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """The memory after the instant t, at which messages are sent, arrive, or both."""
        after = memory.copy()
        now, k = self.parts(after), round(t / self.traffic.period)
        due = abs(t - k * self.traffic.period) <= NEAR * self.traffic.period
        if not now.begun[0]:
            self._begin(t, w, now)
        elif due:
            self._send(k, w, now)
        self._arrive(t, now)
        return after

    def account(self, log: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Outputs of a run: messages that robots sent and links brought until then, and their age, s."""
        now = self.parts(log["network_state"])
        age = np.maximum(log["t"][:, None] - now.stamp, 0.0)
        return {
            "messages_sent": (now.sent.copy(), "1", ("time", "robot")),
            "messages_heard": (now.come.copy(), "1", ("time", "link")),
            "message_age": (age, "s", ("time", "link")),
        }

    # -- internals ----------------------------------------------------------------------------------------

    def _arriving(self, numbers: np.ndarray) -> list[np.ndarray]:
        """When the messages with these numbers may come."""
        if self.traffic.jitter.any():
            return [self._arrival(k) for k in numbers.tolist()]
        return [numbers * self.traffic.period + delay for delay in np.unique(self.traffic.delay)]

    def _arrival(self, k: int) -> np.ndarray:
        """When message k comes on every link, if it does, (l,), s."""
        traffic = self.traffic
        sent = k * traffic.period + traffic.delay
        return sent + traffic.jitter * self._chances(k)[1] if traffic.jitter.any() else sent

    def _begin(self, t: float, w: np.ndarray, now: Any) -> None:
        """Let everybody hear everybody."""
        letters, sender = self._letters(w, now), self.links.sender
        now.begun[0], now.stamp[...], now.held[...] = 1.0, t, letters[sender]
        now.sent += 1.0
        now.come += 1.0
        self._remember(t, w, now, np.full(len(now.sent), True))
        self.receiver.first(w[0][sender], now)

    def _send(self, k: int, w: np.ndarray, now: Any) -> None:
        """Let robots send message k, as far as they have something to say."""
        t, place = k * self.traffic.period, k % self.traffic.on_the_way
        says = self._says(t, w, now)
        now.sent += says
        self._remember(t, w, now, says)
        now.stamps[place], now.letters[place] = t, self._letters(w, now)
        comes = says[self.links.sender] & ~self._lost(k, now)
        now.arrivals[place] = np.where(comes, self._arrival(k), NEVER)

    def _letters(self, w: np.ndarray, now: Any) -> np.ndarray:
        """What every robot has to say, (n, rows, m)."""
        return np.stack((now.W, *w), axis=1)[:, : self.receiver.rows]

    def _says(self, t: float, w: np.ndarray, now: Any) -> np.ndarray:
        """Which robots send, (n,)."""
        if self.traffic.event is None:
            return np.full(len(now.sent), True)
        since = t - now.told[:, :1]
        w_sent, w_dot_sent = np.split(now.told[:, 1:], 2, axis=1)
        surprising = (np.abs(w[0] - (w_sent + since * w_dot_sent)) > self.traffic.event).any(axis=1)
        silent = since[:, 0] >= self.traffic.heartbeat * (1 - NEAR)
        return surprising | silent

    def _remember(self, t: float, w: np.ndarray, now: Any, says: np.ndarray) -> None:
        """Let robots that send remember what, if they will have to compare with it."""
        if len(now.told):
            now.told[says, 0], now.told[says, 1:] = t, np.concatenate(w, axis=1)[says]

    def _lost(self, k: int, now: Any) -> np.ndarray:
        """On which links message k is lost, (l,); links turn bad or good before it."""
        chance = self._chances(k)
        if self.traffic.burst is None:
            return chance[0] < self.traffic.loss
        turns, heals = self.traffic.burst
        now.bad[...] = np.where(now.bad > 0, chance[2] >= heals, chance[2] < turns)
        return (chance[0] < self.traffic.loss) | (now.bad > 0)

    def _arrive(self, t: float, now: Any) -> None:
        """Let what has come count, as far as it is news."""
        come = now.arrivals <= t + NEAR * self.traffic.period
        if not come.any():
            return
        stamps = np.where(come, now.stamps[:, None], -NEVER)
        place, newest = stamps.argmax(axis=0), stamps.max(axis=0)
        news = newest > now.stamp
        now.stamp[news] = newest[news]
        now.held[news] = now.letters[place[news], self.links.sender[news]]
        now.come += come.sum(axis=0)
        now.arrivals[come] = NEVER


def _draw(seed: int, links: int, k: int) -> np.ndarray:
    """See `Chance`."""
    source = np.random.Philox(key=seed, counter=[0, k, 0, 0])
    return np.random.Generator(source).random((3, links))
