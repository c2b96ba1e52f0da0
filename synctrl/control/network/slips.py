"""Robots that tell each other r beside W: what diffusive coupling needs.

Every robot knows its own

    r_i = w_i' + beta (sigma_i - leak E_i) + Lambda (w_i + beta E_i)

of what it believes of the others. With delays in continuous time r_j(t - d_ij) is made of what j believed
then: its own W, and that of who j hears, which is older by the delay from there. A message has r as one more
row; it holds until the next message, and counts while that one is not overdue.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...coupling.cell import Cell
from ..gains import Gains, spread
from .delayed import BoundDelayed
from .posted import NEAR, BoundPosted, Traffic
from .protocol import Received
from .receivers import Receiver, Shapes
from .w_form import WForm


class SlipForm(WForm):
    """The W form of robots that tell each other r too, in front of a network.

    Attributes:
        Lambda, beta: gains that are in r, (m,), 1/s.
    """

    Lambda: np.ndarray
    beta: np.ndarray

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        received = super().exchange(t, w, memory)
        own = np.array((self.parts(memory).W, *w))
        told, counts = self.slips_heard(t, own, received.shares, memory)
        return received._replace(slips=self.links.slips(told, counts))

    def slips_heard(
        self, t: float, own: np.ndarray, shares: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """r of who is heard, (l, m), and 1 for links that count, 0 for others, (l,).

        Args:
            t, own, memory: as of `heard`.
            shares: E, sigma and sigma' of every robot, (3, n, m).
        """
        return self.slip(own, shares)[self.links.sender], np.ones(self.links.count)

    def slip(self, own: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """r of robots, (k, m), that know W, w and w' and E, sigma and sigma', (3, k, m) each."""
        (_, w, w_dot), (E, sigma, _) = own, shares
        return w_dot + self.beta * (sigma - self.leak * E) + self.Lambda * (w + self.beta * E)


class DelayedSlips(SlipForm, BoundDelayed):
    """Constant delays between robots that tell each other r too; see `BoundDelayed`.

    Attributes:
        breaks: instants at which what is heard jumps, because before the beginning w did not move, s.
    """

    hops = 2

    def __init__(self, cell: Cell, leak: np.ndarray, delay: np.ndarray):
        from scipy.sparse import csr_array

        super().__init__(cell, leak, delay)
        links = self.links
        link, before = np.nonzero(links.sender[:, None] == links.hearer)
        self._ages = np.append(delay, delay[link] + delay[before])
        self._who = np.append(links.sender, links.sender[before])
        shares = np.append(links.own[links.sender, 0], links.weight[before])
        places = np.append(np.arange(links.count), link), np.arange(len(shares))
        self._shares = csr_array((shares, places))
        self.breaks = np.unique(delay[delay > 0])

    def slips_heard(
        self, t: float, own: np.ndarray, shares: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        known = self.recalled(t, self._ages, self._who, own, memory)
        shares_then = np.array([self._shares @ rows for rows in known])
        return self.slip(known[:, : self.links.count], shares_then), np.ones(self.links.count)


class PostedSlips(SlipForm, BoundPosted):
    """Messages with r as one more row; see `BoundPosted`.

    Its memory has beside: `slips`, r of messages that were sent last; `slip`, r of the message that counts on
    each link; and `counts`, 1 while the next message is not overdue on it, else 0.
    """

    def __init__(self, cell: Cell, leak: np.ndarray, receiver: Receiver, traffic: Traffic):
        super().__init__(cell, leak, receiver, traffic)
        self.jumps, self.theorem = True, None
        self._overdue = traffic.period * (1 - NEAR) + traffic.delay + traffic.jitter

    def beside(self, places: int, n: int, l: int, m: int) -> Shapes:
        return {"slips": (places, n, m), "slip": (l, m), "counts": (l,)}

    def slips_heard(
        self, t: float, own: np.ndarray, shares: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        now = self.parts(memory)
        return now.slip, now.counts

    def _begin(self, t: float, w: np.ndarray, now: Any) -> None:
        super()._begin(t, w, now)
        now.slip[...] = self._slips_now(t, w, now)[self.links.sender]

    def _send(self, k: int, w: np.ndarray, now: Any) -> None:
        super()._send(k, w, now)
        now.slips[k % self.traffic.on_the_way] = self._slips_now(k * self.traffic.period, w, now)

    def _arrive(self, t: float, now: Any) -> None:
        before = now.stamp.copy()
        super()._arrive(t, now)
        news = now.stamp > before
        place = np.rint(now.stamp[news] / self.traffic.period).astype(int) % self.traffic.on_the_way
        now.slip[news] = now.slips[place, self.links.sender[news]]
        now.counts[...] = t - now.stamp < self._overdue

    def _slips_now(self, t: float, w: np.ndarray, now: Any) -> np.ndarray:
        """r of every robot, (n, m)."""
        own = np.array((now.W, *w))
        return self.slip(own, self.links.shares(own, self.receiver.believed(t, now, self.leak)))


def with_slips(network: WForm, cell: Cell, gains: Gains) -> SlipForm:
    """A network whose robots tell each other r as well, made of one whose robots do not."""
    made: SlipForm
    if isinstance(network, BoundPosted):
        made = PostedSlips(cell, network.leak, network.receiver, network.traffic)
    elif isinstance(network, BoundDelayed):
        made = DelayedSlips(cell, network.leak, network.delay)
    else:
        made = SlipForm(cell, network.leak)
    made.Lambda, made.beta = (spread(name, getattr(gains, name), (cell.m,)) for name in ("Lambda", "beta"))
    return made
