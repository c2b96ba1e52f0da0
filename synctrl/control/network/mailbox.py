"""The network as one robot has it: what it tells, and what it makes of the messages that it is handed.

It is `BoundPosted` without what happens on the way, which is now left to a wire: no message is on the way as
far as the robot knows, and what has come is read before the sample with which it is to count.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from .links import Links
from .posted import BoundPosted, Traffic
from .receivers import Receiver
from .wire import ROWS, Message


class Handed(Traffic):
    """Messages that somebody else carries."""

    __slots__ = ()
    on_the_way = 0


class Mailbox:
    """The network of one robot, before it knows the robot's own cell.

    Args:
        bound: the network between all robots.
        robot: which one, counted from 0.
    """

    def __init__(self, bound: BoundPosted, robot: int):
        self.robot, self.links = robot, bound.links.of_robot(robot)
        self._leak, self._receiver = bound.leak, bound.receiver
        none = np.zeros(self.links.count)
        self._traffic = Handed(*bound.traffic._replace(delay=none, jitter=none, loss=none, burst=None))

    def bind(self, cell: Cell) -> BoundMailbox:
        """This network for the robot's own cell, see `own_cell`."""
        return BoundMailbox(cell, self._leak, self._receiver, self._traffic, self.links, self.robot)

    def as_dict(self) -> dict[str, Any]:
        """What it is called, and which robots are heard."""
        return {"name": "Mailbox", "robot": self.robot, "hears": self.links.sender.tolist()}


class BoundMailbox(BoundPosted):
    """The network of one robot. Its memory is `BoundPosted`'s, of its own messages and links alone.

    Args:
        cell: its own cell.
        leak, receiver, traffic: see `BoundPosted`.
        links: the robots that it hears.
        robot: which one it is, counted from 0.
    """

    def __init__(
        self,
        cell: Cell,
        leak: np.ndarray,
        receiver: Receiver,
        traffic: Handed,
        links: Links,
        robot: int,
    ):
        super().__init__(cell, leak, receiver, traffic, links)
        self.robot, self._m = robot, cell.m
        self._kept = tuple(receiver.shapes(links.count, cell.m))
        self._link = {int(sender): k for k, sender in enumerate(links.sender)}

    def meet(self, t: float, w: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """The memory after it told the others at instant t what it had to say."""
        after = memory.copy()
        now = self.parts(after)
        says = self._has_news(t, w, now)
        now.begun[0] = 1.0
        now.sent += says
        self._remember(t, w, now, says)
        return after

    def told(self, t: float, w: np.ndarray, memory: np.ndarray) -> Message | None:
        """What it tells the others at instant t, if it has something to say: all it knows for a start."""
        now = self.parts(memory)
        if not self._has_news(t, w, now)[0]:
            return None
        rows = self.receiver.rows if now.begun[0] else ROWS
        return Message(self.robot, t, np.stack((now.W, *w), axis=1)[0, :rows])

    def read(self, inbox: Iterable[Message], latest: float, memory: np.ndarray) -> np.ndarray:
        """The memory after messages, in any order; of each sender the one with the latest stamp counts.

        Args:
            inbox: what has come.
            latest: stamps after this instant are no stamps, s.
            memory: before.

        Raises:
            InputError: a message of a robot that it does not hear, with other rows, or from the future.
        """
        after = memory.copy()
        now = self.parts(after)
        for message in inbox:
            self._note(message, self._checked(message, latest), now)
        return after

    def unheard(self, memory: np.ndarray) -> tuple[int, ...]:
        """Robots of which it has not heard anything yet."""
        return tuple(self.links.sender[self.parts(memory).come == 0].tolist())

    def share(self, memory: np.ndarray, whole: BoundPosted) -> np.ndarray:
        """What is this robot's in the memory of a network between all robots; nothing is on the way."""
        own = self.start()
        now, then = self.parts(own), whole.parts(memory)
        now.begun[0] = then.begun[0]
        for name in ("W", "sent", "told"):
            getattr(now, name)[...] = getattr(then, name)[self.robot : self.robot + 1]
        for name in ("stamp", "held", "come", *self._kept):
            getattr(now, name)[...] = getattr(then, name)[whole.links.hearer == self.robot]
        return own

    # -- internals ----------------------------------------------------------------------------------------

    def _has_news(self, t: float, w: np.ndarray, now: Any) -> np.ndarray:
        """Whether it has something to say, (1,)."""
        return self._says(t, w, now) if now.begun[0] else np.full(1, True)

    def _checked(self, message: Any, latest: float) -> int:
        """The link on which a message came."""
        if not isinstance(message, Message):
            raise InputError.expected("messages, see Message.from_bytes", message, "inbox")
        if message.sender not in self._link:
            raise InputError.expected(f"messages of {sorted(self._link)}", message.sender, "inbox, sender")
        shapes = [(rows, self._m) for rows in sorted({self.receiver.rows, ROWS})]
        if message.rows.shape not in shapes:
            expected = " or ".join(map(str, shapes))
            raise InputError.expected(f"rows of shape {expected}", message.rows.shape, "inbox, rows")
        if message.stamp > latest:
            raise InputError.expected(f"a stamp up to {latest:g} s", message.stamp, "inbox, stamp")
        return self._link[message.sender]

    def _note(self, message: Message, k: int, now: Any) -> None:
        """Let a message count on link k, if it is news."""
        first = now.come[k] == 0
        now.come[k] += 1.0
        if first:
            w = message.rows[1] if len(message.rows) > 1 else np.zeros(self._m)
            link = {name: getattr(now, name)[k : k + 1] for name in self._kept}
            self.receiver.first(w[None], SimpleNamespace(**link))
        if first or message.stamp > now.stamp[k]:
            now.stamp[k], now.held[k] = message.stamp, message.rows[: self.receiver.rows]
