"""The messages of a network as a loop meets them, whose own code may be anybody's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...checks import finite_array, shaped
from ...coupling.cell import Cell, Reference
from ...errors import InputError, NonFiniteError
from ..law import compute_weighted_errors
from .protocol import BoundNetwork

#: how far beyond an interval a message may be that counts as in it, as a share of its ends
ROUNDING = 1e-12
#: how far from a sample a message may be that comes with it, as a share of the period
GRID = 1e-9


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

    @staticmethod
    def end(sample: Any, period: float, start: float = 0.0) -> Any:
        """Before this time, s, a message is due with a sample or with one before; roundings do not matter.

        Args:
            sample: number of the sample, or of several, (k,).
            period: between two samples, s.
            start: when the first one is, s.
        """
        return start + (sample + GRID) * period

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
        w = self.weighted(reference, motion)
        for t in times:
            memory = self._after(t, w, memory)
        return memory

    def weighted(self, reference: Reference, motion: np.ndarray) -> np.ndarray:
        """Weighted errors and their rates, (2, n, m), of which robots tell; arguments as of `received`."""
        return compute_weighted_errors(reference.weights, self._measure(motion, reference.desired).error)

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
