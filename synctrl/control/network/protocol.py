"""What a network is: what the robots of a cell know of each other's errors, and the messages that bring it.

A network of one's own is a class with a `bind` that returns an object with the methods of `BoundNetwork`. It
may have memory, which becomes a part of the state of the loop: it is integrated, logged and replayed. It may
have messages: what it hears at instants of its own, between which it knows nothing new.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from ..gains import Gains


class Received(NamedTuple):
    """What has come over the network at one instant.

    Attributes:
        epsilon, epsilon_dot: synchronization errors and their rates, (p, m), for the log and for V.
        shares: E, sigma and sigma', (3, n, m): what every robot makes of its own errors and of what it heard.
            The laws need E' = sigma - leak E, and sigma' to be the rate of sigma.
        memory_dot: rate of the memory, of its shape.
        slips: of a network that was asked for it, what every robot heard of the r of others, (2, n, m):
            sum_j |A_ij|, in all columns, and sum_j A_ij r_j, over those of whom something counts.
    """

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    shares: np.ndarray
    memory_dot: np.ndarray
    slips: np.ndarray | None = None


class BoundNetwork(Protocol):
    """A network between the robots of one cell.

    It may also have

    - `leak`, (m,), 1/s, the rate at which its integrals are forgotten, which has to be that of the gains.
    - `outside`, without arguments: what the theorem does not know of it, in words, or None if the theorem
      holds with it. Without one its runs are outside the theorem, and certificates say so.
    - `jumps`, whether what robots know of each other jumps at its messages; by default it does, if there are
      any, and V with it.
    - `gap(t, memory)`: what the rates of E and sigma have beyond sigma - leak E and sigma', (2, n, m), where
      the laws do not get what they need.
    - `breaks`: further instants at which what is heard jumps, s.
    - `continuous`, True where robots hear each other in continuous time and late: sampled control refuses it.
    - `theorem`: for networks of what kind a proof covers it, in words; None if it needs none, or has none.
    - `suspicion`: what to think of where a run ran away for no other reason, in words, or None.
    - `account(log)`: outputs of a run by name, each an array with its unit and the names of its axes.
    - `messages(start, end)` and `meet(t, w, memory)`: the instants of its messages with start <= t < end, in
      order, s, and its memory after the one at instant t, with w as in `exchange`; without side effects. With
      continuous control a message arrives at its instant, with sampled control at the first sample that is
      not before it. Messages of periods that a `DiscreteController` holds are lost.
    """

    def start(self) -> np.ndarray:
        """Its memory at the beginning, an array of any one shape."""

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        """What is received when all robots send.

        Args:
            t: time, s; NaN where nobody knows it.
            w: weighted errors c e and their rates, (2, n, m), each known to its robot.
            memory: of the network.
        """

    def integral(self, memory: np.ndarray) -> np.ndarray:
        """Integrals of the synchronization errors, (p, m), unit of c e times s."""


class Communication(Protocol):
    """A network, before it knows the cell.

    It may have `bind_for(cell, gains)` beside `bind`, if it has to know the gains of the controller as well,
    and `bind_with_slips(cell, gains)`, if its robots can tell each other r, which a law may need.
    """

    def bind(self, cell: Cell) -> BoundNetwork:
        """This network for a cell.

        Raises:
            InputError: what does not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""


def connected(network: Communication, cell: Cell, gains: Gains) -> BoundNetwork:
    """A network between the robots of a cell, told of the gains if it asks for them.

    Raises:
        InputError: what does not fit, named.
    """
    bind_for = getattr(network, "bind_for", None)
    return network.bind(cell) if bind_for is None else bind_for(cell, gains)


def connected_with_slips(network: Communication, cell: Cell, gains: Gains) -> BoundNetwork:
    """A network whose robots tell each other r as well, for a law that needs it.

    Raises:
        InputError: a network without r, or what does not fit, named.
    """
    bind = getattr(network, "bind_with_slips", None)
    if bind is None:
        wanted = "one whose robots tell each other r, for example Network(), for diffusive coupling"
        raise InputError.expected(wanted, type(network).__name__, "network")
    return bind(cell, gains)


def check_leak(network: BoundNetwork, leak: np.ndarray) -> None:
    """Refuse a network whose integrals leak at another rate, (m,), 1/s, than the law takes for granted.

    Raises:
        InputError: it does.
    """
    own = getattr(network, "leak", np.zeros_like(leak))
    if not np.array_equal(own, leak):
        raise InputError.expected(f"the leak of the gains, {leak.tolist()}", own, "network, leak")
