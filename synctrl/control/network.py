"""Network: what the robots of a cell know of each other's errors, and the messages that bring it.

A network of one's own is a class with a `bind` that returns an object with the methods of `BoundNetwork`. It
may have memory, which becomes a part of the state of the loop: it is integrated, logged and replayed. It may
have messages: what it hears at instants of its own, between which it knows nothing new.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..checks import finite_array, shaped
from ..coupling.cell import Cell, Reference
from ..coupling.coupling import Coupling
from ..errors import InputError, NonFiniteError
from .gains import spread
from .law import compute_weighted_errors

#: how far beyond an interval a message may be that counts as in it, as a share of its ends
ROUNDING = 1e-12


class Received(NamedTuple):
    """What has come over the network at one instant.

    Attributes:
        epsilon, epsilon_dot: synchronization errors and their rates, (p, m), for the log and for V.
        shares: E, sigma and sigma', (3, n, m): what every robot makes of its own errors and of what it heard.
            The laws need E' = sigma - leak E, and sigma' to be the rate of sigma.
        memory_dot: rate of the memory, of its shape.
    """

    epsilon: np.ndarray
    epsilon_dot: np.ndarray
    shares: np.ndarray
    memory_dot: np.ndarray


class BoundNetwork(Protocol):
    """A network between the robots of one cell.

    It may also have

    - `leak`, (m,), 1/s, the rate at which its integrals are forgotten, which has to be that of the gains.
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
    """Everybody knows at once what the coupling compares, as the paper assumes.

    Args:
        leak: rate at which integrals of synchronization errors are forgotten, a number or (m,), 1/s, that
            of the gains.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    def __init__(self, leak: ArrayLike = 0.0):
        self.leak = finite_array("leak", leak)
        if self.leak.min(initial=0.0) < 0:
            raise InputError.expected("rates of at least 0", float(self.leak.min()), "leak")

    def bind(self, cell: Cell) -> BoundIdeal:
        """This network for a cell.

        Raises:
            InputError: another number of leaks than task coordinates.
        """
        return BoundIdeal(cell.coupling, cell.m, spread("leak", self.leak, (cell.m,)))

    def as_dict(self) -> dict[str, Any]:
        return {"name": "Ideal", **({"leak": self.leak.tolist()} if self.leak.any() else {})}


class BoundIdeal:
    """`Ideal` between the robots of a cell: its memory are the integrals of epsilon, (p, m)."""

    def __init__(self, coupling: Coupling, m: int, leak: np.ndarray | None = None):
        self._shape = coupling.pairs, m
        self.leak = np.zeros(m) if leak is None else leak
        self._leaks = bool(self.leak.any())
        self._compare, self._distribute = coupling.products

    def start(self) -> np.ndarray:
        return np.zeros(self._shape)

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        epsilon, epsilon_dot = self._compare(w)  # (7), (28), and the derivative
        shares = self._distribute(np.array((memory, epsilon, epsilon_dot)))
        memory_dot = epsilon - self.leak * memory if self._leaks else epsilon
        return Received(epsilon, epsilon_dot, shares, memory_dot)

    def integral(self, memory: np.ndarray) -> np.ndarray:
        return memory

    def outside(self) -> str | None:
        return None


def check_leak(network: BoundNetwork, leak: np.ndarray) -> None:
    """Refuse a network whose integrals leak at another rate, (m,), 1/s, than the law takes for granted.

    Raises:
        InputError: it does.
    """
    own = getattr(network, "leak", np.zeros_like(leak))
    if not np.array_equal(own, leak):
        raise InputError.expected(f"the leak of the gains, {leak.tolist()}", own, "network, leak")


class Messages:
    """The messages of a network; none of one that does not say when they come.

    Args:
        cell: the cell.
        network: its network.
    """

    def __init__(self, cell: Cell, network: BoundNetwork):
        self._measure, self._network = cell.task.measure, network
        self._times: Any = getattr(network, "messages", None)

    @property
    def sent(self) -> bool:
        """Whether the network has messages at all."""
        return self._times is not None

    def between(self, start: float, end: float) -> list[float]:
        """Instants of the messages with start <= t < end, in order, s.

        Raises:
            InputError: the network gives something else.
        """
        if not self.sent:
            return []
        where = f"network {type(self._network).__qualname__}, messages"
        times = finite_array(where, self._times(start, end), (None,))
        slack = ROUNDING * max(abs(start), abs(end))
        inside = bool(((times >= start - slack) & (times <= end + slack)).all())
        if not inside or (np.diff(times) < 0).any():
            raise InputError.expected(
                f"instants in order with {start:g} <= t < {end:g} s", times, where, shown=f"{times!s:.80}"
            )
        return times.tolist()

    def received(
        self, times: Sequence[float], reference: Reference, motion: np.ndarray, memory: np.ndarray
    ) -> np.ndarray:
        """Memory of the network after messages, which all robots send as they are now.

        Args:
            times: when the messages were due, s.
            reference: what is desired now.
            motion: joint positions and velocities, (2, n, nv).
            memory: of the network, before.

        Raises:
            InputError: the network makes memory of another shape.
            NonFiniteError: it makes finite memory infinite.
        """
        if not times:
            return memory
        w = compute_weighted_errors(reference.weights, self._measure(motion, reference.desired).error)
        for t in times:
            memory = self._after(t, w, memory)
        return memory

    def _after(self, t: float, w: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """Memory after one message, looked at."""
        network: Any = self._network
        found = np.asarray(network.meet(t, w, memory), dtype=float)
        where = f"network {type(network).__qualname__}, meet"
        shaped(where, found, memory.shape)
        sound = np.isfinite(memory).all() and np.isfinite(w).all()
        if sound and not np.isfinite(found).all():
            raise NonFiniteError(
                f"{where}: expected finite memory after the message of {t:g} s, found {found.tolist()}",
                cause="part",
            ).about(where, found=found)
        return found
