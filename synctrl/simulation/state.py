"""The state of a closed loop, y = (q, v, z, memory of the network, the plant's own)."""

from __future__ import annotations

import numpy as np

from ..coupling.cell import Cell


class State:
    """Parts of a flat vector y as views of it.

    Attributes:
        flat: y.
        motion: q and v together, (2, n, nv).
        q, v: joint positions and velocities, (n, nv).
        z: state of the adaptation, (n, Z).
        memory: of the network; with `Ideal` the integrals of the synchronization errors, (p, m).
        hidden: state of the plant's own.
    """

    __slots__ = ("flat", "hidden", "memory", "motion", "q", "v", "z")

    def __init__(self, layout: Layout, flat: np.ndarray):
        a, b, c = layout.ends
        self.flat = flat
        self.motion = flat[:a].reshape(layout.motion)
        self.q, self.v = self.motion
        self.z = flat[a:b].reshape(layout.z)
        self.memory = flat[b:c].reshape(layout.memory)
        self.hidden = flat[c:]

    def ahead(self, y: State, h: float, rate: np.ndarray) -> State:
        """This state, made to y + h rate."""
        np.multiply(rate, h, self.flat)
        np.add(self.flat, y.flat, self.flat)
        return self


class Layout:
    """Where the parts are in y.

    Args:
        cell: the cell.
        z, memory: shapes of the state of the adaptation and of the memory of the network.
        hidden: size of the plant's own state.
    """

    def __init__(self, cell: Cell, z: tuple[int, ...], memory: tuple[int, ...], hidden: int):
        self.motion, self.z, self.memory = (2, cell.n, cell.nv), z, memory
        self.ends = tuple(np.cumsum([np.prod(s) for s in (self.motion, self.z, self.memory)]).tolist())
        self.size = self.ends[-1] + hidden
