"""Lanes: what stands side by side in the vectors of generated code, and how arrays are put there.

An array of a quantity has a row per robot or pair. In the code a number is a vector of `width` lanes. Lanes
are either runs of one cell, or robots of one run: then a row of the code is one of `width` robots, or pairs,
one after another, and lanes that are too many repeat the last one. Whatever is neither a robot's nor a pair's
is the same in all lanes. With one lane both are the arrays as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import prod
from typing import NamedTuple

import numpy as np

from ..coupling.coupling import Coupling
from .quantities import QUANTITIES, columns, owned_by

#: bytes of the widest vectors: where in memory they may begin is a multiple
ALIGNED = 64
#: what a step of so many lanes costs, as a multiple of one with one lane; only which is cheapest counts
COSTS: Mapping[int, float] = {1: 1.0, 2: 1.1, 4: 1.2, 8: 1.9}


def room(*shape: int) -> np.ndarray:
    """Zeros that begin where the widest vectors may begin, with room for one of them behind their end."""
    size = prod(shape)
    whole = np.zeros(size + 2 * ALIGNED // 8)
    skipped = -whole.ctypes.data % ALIGNED // 8
    return whole[skipped : skipped + size].reshape(shape)


def aligned(array: np.ndarray) -> np.ndarray:
    """The same numbers one after another, from where the widest vectors may begin."""
    found = room(*array.shape)
    found[...] = array
    return found


class Lanes(NamedTuple):
    """How the arrays of a cell stand in lanes.

    Attributes:
        width: number of lanes.
        scattered: whether lanes are robots of one run, rather than runs.
    """

    width: int = 1
    scattered: bool = False

    def rows(self, count: int) -> int:
        """Rows in the code of so many robots or pairs."""
        return -(-count // self.width) if self.scattered else count

    def sizes(self, sizes: Mapping[str, int]) -> dict[str, int]:
        """Lengths and numbers of rows as the code has them, see `Quantity.rows`."""
        found = {**sizes, "n": self.rows(sizes["n"]), "p": self.rows(sizes["p"])}
        return found | {"r": found["p"] * sizes["m"]} if self.scattered else found

    def members(self, count: int) -> np.ndarray:
        """Which robots, or pairs, the lanes of each row are, (rows, width)."""
        if not self.scattered:
            return np.repeat(np.arange(count)[:, None], self.width, axis=1)
        chosen = np.minimum(np.arange(self.rows(count) * self.width), max(count - 1, 0))
        return chosen.reshape(-1, self.width)

    def packed(self, name: str, array: np.ndarray, sizes: Mapping[str, int]) -> np.ndarray:
        """Arrays of a quantity in lanes.

        Args:
            name: of the quantity.
            array: (..., rows, columns); the same in all runs.
            sizes: of the cell.

        Returns:
            (..., rows in the code, columns, width), aligned.
        """
        if self.width == 1:
            return np.ascontiguousarray(array)[..., None]
        if name == "memory" and self.scattered:
            shape = (*array.shape[:-2], sizes["p"], sizes["m"])
            found = self._scattered(array.reshape(shape))
            return aligned(found.reshape(*array.shape[:-2], -1, 1, self.width))
        if QUANTITIES[name].rows in ("n", "p") and self.scattered:
            return aligned(self._scattered(array))
        return aligned(np.broadcast_to(array[..., None], (*array.shape, self.width)))

    def unpacked(self, name: str, array: np.ndarray, sizes: Mapping[str, int]) -> np.ndarray:
        """The opposite of `packed`, of one run: (rows in the code, columns, width) -> (rows, columns)."""
        if name == "memory" and self.scattered:
            pairs = array.reshape(-1, sizes["m"], self.width)
            return self._gathered(pairs, sizes["p"]).reshape(-1, 1)
        rows = QUANTITIES[name].rows
        return self._gathered(array, sizes[rows]) if rows in ("n", "p") and self.scattered else array[..., 0]

    def places(self, rows: Sequence[int] | np.ndarray, length: int) -> np.ndarray:
        """Where rows of robots or pairs begin in the code's numbers, for rows of so many columns."""
        rows = np.asarray(rows, dtype=int)
        if not self.scattered:
            return rows * length * self.width
        return rows // self.width * length * self.width + rows % self.width

    # -- internals ----------------------------------------------------------------------------------------

    def _scattered(self, array: np.ndarray) -> np.ndarray:
        """Rows in lanes, (..., rows, columns) -> (..., rows in the code, columns, width)."""
        count = array.shape[-2]
        if count % self.width == 0:
            apart = array.reshape(*array.shape[:-2], count // self.width, self.width, array.shape[-1])
        else:
            apart = array[..., self.members(count), :]
        return apart.swapaxes(-1, -2)

    def _gathered(self, array: np.ndarray, count: int) -> np.ndarray:
        return array.swapaxes(-1, -2).reshape(-1, array.shape[-2])[:count]


class Compared(NamedTuple):
    """Who is compared with whom, as the code has it; see `structs.Cell`."""

    edge: np.ndarray
    sign: np.ndarray
    first: np.ndarray
    incident: np.ndarray
    incident_sign: np.ndarray


def compared(coupling: Coupling, lanes: Lanes, m: int) -> Compared:
    """Who is compared with whom, in lanes, for tasks of m coordinates.

    Robots in the lanes of one row may be in different numbers of pairs: what is missing has the sign 0.
    """
    first, incident, signs = coupling.incidence
    pairs, robots = lanes.members(coupling.pairs), lanes.members(coupling.robots)
    degrees = np.diff(first)[robots]
    most = degrees.max(axis=1, initial=0)
    begin = np.concatenate(([0], np.cumsum(most)))
    row = np.repeat(np.arange(len(robots)), most)
    k = (np.arange(len(row)) - begin[row])[:, None]
    counts = k < degrees[row]
    places = first[robots[row]] + np.where(counts, k, 0)
    places = np.minimum(places, max(len(incident) - 1, 0))
    return Compared(
        lanes.places(coupling.edges[pairs].swapaxes(1, 2), m),
        coupling.signs[pairs].swapaxes(1, 2),
        begin,
        lanes.places(incident[places], m),
        np.where(counts, signs[places], 0.0),
    )


def narrowest(n: int, widest: int) -> int:
    """With how many lanes robots of one kind are cheapest."""
    widths = [width for width in COSTS if width <= widest]
    return min(widths, key=lambda width: -(-n // width) * COSTS[width])


def state_parts(sizes: Mapping[str, int], size: int) -> list[tuple[str, int, int]]:
    """Parts of a flat state: name, rows and columns; the last is what the plant remembers.

    Args:
        sizes: of the cell.
        size: of the state.
    """
    parts = [(name, sizes[QUANTITIES[name].rows], columns(name, sizes)) for name in owned_by("state")[:-1]]
    return [*parts, ("hidden", size - sum(rows * length for _, rows, length in parts), 1)]
