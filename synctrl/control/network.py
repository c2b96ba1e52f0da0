"""Network: what the robots of a cell know of each other's errors.

A network of one's own is a class with a `bind` that returns an object with the methods of `BoundNetwork`. It
may have memory, which becomes a part of the state of the loop: it is integrated, logged and replayed.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from ..coupling.cell import Cell
from ..coupling.coupling import Coupling
from ..errors import InputError


class Received(NamedTuple):
    """What has come over the network at one instant.

    Attributes:
        epsilon, epsilon_dot: synchronization errors and their rates, (p, m), for the log and for V.
        shares: E, sigma and sigma', (3, n, m): what every robot makes of its own errors and of what it heard.
            The laws need E' = sigma, and sigma' to be the rate of sigma.
        memory_dot: rate of the memory, of its shape.
    """

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    shares: np.ndarray
    memory_dot: np.ndarray


class BoundNetwork(Protocol):
    """A network between the robots of one cell.

    It may also have

    - `outside`, without arguments: what the theorem does not know of it, in words, or None if the theorem
      holds with it. Without one its runs are outside the theorem, and certificates say so.
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


class Network(Protocol):
    """A network, before it knows the cell."""

    def bind(self, cell: Cell) -> BoundNetwork:
        """This network for a cell.

        Raises:
            InputError: what does not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""


class Ideal:
    """Everybody knows at once what the coupling compares, as the paper assumes."""

    def bind(self, cell: Cell) -> BoundIdeal:
        """This network for a cell."""
        return BoundIdeal(cell.coupling, cell.m)

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Ideal"}


class BoundIdeal:
    """`Ideal` between the robots of a cell: its memory are the integrals of epsilon, (p, m)."""

    def __init__(self, coupling: Coupling, m: int):
        self._shape = coupling.pairs, m
        self._compare, self._distribute = coupling.products

    def start(self) -> np.ndarray:
        return np.zeros(self._shape)

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        epsilon, epsilon_dot = self._compare(w)  # (7), (28), and the derivative
        shares = self._distribute(np.array((memory, epsilon, epsilon_dot)))
        return Received(epsilon, epsilon_dot, shares, epsilon)

    def integral(self, memory: np.ndarray) -> np.ndarray:
        return memory

    def outside(self) -> str | None:
        return None


def connected(network: Network | None) -> Network:
    """The network of a controller: the one given, or `Ideal`.

    Raises:
        InputError: something that is no network.
    """
    if network is None:
        return Ideal()
    if not hasattr(network, "bind") or isinstance(network, type):
        raise InputError(f"expected, for example, Ideal(), found {network!r}", subject="network")
    return network
