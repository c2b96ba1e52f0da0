"""An adaptation for some of the robots that it was bound to, as the specimen has them.

Generated code is compared with the reference engine on a small closed loop, the specimen, which has one robot
of each kind. An adaptation of a user's own was bound to the whole cell, and perhaps to numbers of each of its
robots; so it is not bound anew, but asked for those robots that stand in the specimen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..control.adaptation import BoundAdaptation, Seen
from ..coupling.cell import Cell


class Chosen:
    """The adaptation of a larger cell, asked robot by robot, the others at rest.

    Args:
        adaptation: of the larger cell.
        robots: which of its robots stands in each row; one may stand in several.
        nv, parameters: sizes of rows there.
    """

    def __init__(self, adaptation: BoundAdaptation, robots: Sequence[int], nv: int, parameters: int):
        self._adaptation, self._robots = adaptation, robots
        self._sizes = {"gradient": parameters}, nv
        self._z0 = adaptation.start()

    def bind(self, cell: Cell) -> Chosen:
        """Itself: it knows its robots."""
        self._P = cell.theta.shape[1]
        return self

    def as_dict(self) -> dict[str, Any]:
        return {"name": type(self._adaptation).__name__}

    def start(self) -> np.ndarray:
        return self._z0[list(self._robots)]

    def estimate(self, z: np.ndarray) -> np.ndarray:
        rows = self._each(z, lambda full, _: self._adaptation.estimate(full))
        return rows[:, : self._P]

    def rate(self, z: np.ndarray, seen: Seen) -> np.ndarray:
        return self._each(z, lambda full, row: self._adaptation.rate(full, self._alone(seen, row)))

    def settle(self, z: np.ndarray) -> np.ndarray:
        return z

    def _each(self, z: np.ndarray, ask: Callable[[np.ndarray, int], np.ndarray]) -> np.ndarray:
        """What is asked of the larger cell with one robot's state after the other put in its place."""
        rows = []
        for row, robot in enumerate(self._robots):
            full = self._z0.copy()
            full[robot] = z[row]
            rows.append(ask(full, row)[robot])
        return np.array(rows)

    def _alone(self, seen: Seen, row: int) -> Seen:
        """What one robot sees, in the larger cell."""
        robot, found = self._robots[row], {}
        special, nv = self._sizes
        for name in (field.name for field in fields(Seen) if field.name != "regressor"):
            value = getattr(seen, name)[row]
            rows = np.zeros((len(self._z0), special.get(name, nv)))
            rows[robot, : len(value)] = value
            found[name] = rows
        return Seen(**found, regressor=None)
