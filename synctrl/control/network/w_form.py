"""What all networks between robots that tell each other W have in common."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...coupling.cell import Cell
from ...errors import InputError
from .links import Links, Parts
from .protocol import Received

#: where a reader finds how late robots may hear each other
ASK = "synctrl.analysis.delay_margin says how late they may"

#: how many instants of messages are made at once: an hour of one in a millisecond
MOST = 3_600_000


class WForm:
    """Robots that integrate their own errors, and hear the others at once.

    Args:
        cell: the cell.
        leak: rate at which integrals are forgotten, (m,), 1/s.
        links: who hears whom, by default as the coupling says.
        further: shapes of what its memory has beside W, (n, m), by name.

    Attributes:
        links: who hears whom, see `Links`.
        leak: as given.
        parts: names for the parts of the memory, a flat vector.
        jumps: whether what robots know of each other jumps at messages.
        suspicion: what to think of where a run ran away for no other reason, in words, or None.
        theorem: for networks of what kind the proof covers this one, in words; None if it needs none, or
            there is none.
    """

    jumps = False
    theorem: str | None = None
    suspicion: str | None = None

    def __init__(self, cell: Cell, leak: np.ndarray, links: Links | None = None, **further: tuple[int, ...]):
        self.links, self.leak = Links(cell.coupling) if links is None else links, leak
        self.parts = Parts({"W": (cell.n, cell.m), **further})
        self._compare, _ = cell.coupling.products

    def start(self) -> np.ndarray:
        return np.zeros(self.parts.size)

    def exchange(self, t: float, w: np.ndarray, memory: np.ndarray) -> Received:
        own = np.array((self.parts(memory).W, *w))
        epsilon, epsilon_dot = self._compare(w)  # for the log and for V; no robot knows them
        memory_dot = np.zeros(memory.shape)
        rates = self.parts(memory_dot)
        rates.W[...] = own[1] - self.leak * own[0]
        for name, rate in self.memory_rates(t, memory).items():
            getattr(rates, name)[...] = rate
        return Received(epsilon, epsilon_dot, self.links.shares(own, self.heard(t, own, memory)), memory_dot)

    def heard(self, t: float, own: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """W, w and w' of who is heard, as the one who hears believes it, (3, l, m).

        Args:
            t: time, s.
            own: W, w and w' of every robot, (3, n, m).
            memory: of the network.
        """
        return own[:, self.links.sender]

    def memory_rates(self, t: float, memory: np.ndarray) -> Mapping[str, np.ndarray]:
        """Rates of what the memory has beside W, by name; what is not named does not change."""
        return {}

    def gap(self, t: float, memory: np.ndarray) -> np.ndarray:
        """What the rates of E and sigma have beyond sigma - leak E and sigma', (2, n, m)."""
        return np.zeros((2, *self.parts(memory).W.shape))

    def integral(self, memory: np.ndarray) -> np.ndarray:
        return self._compare(self.parts(memory).W)

    def outside(self) -> str | None:
        return None


def check_number(start: float, end: float, step: float, setting: str) -> None:
    """Refuse a setting, s, with which a stretch of time, s, has more messages than can be made.

    Raises:
        InputError: it has.
    """
    if end - start > MOST * step:
        words = f"at least {(end - start) / MOST:.3g} s, with {MOST} messages in {end - start:g} s"
        raise InputError.expected(words, float(step), setting)
