"""The outline of a flat object: a polygon with a thickness, which figures and scenes draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import finite_array, positive_number
from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Outline:
    """A plate: its rim in the plane of the object's x and y axes, and half of its thickness on either side.

    Args:
        points: corners of the rim in order, (k, 2), m; the last is joined to the first.
        thickness: m, above 0.

    Raises:
        InputError: fewer than three points, two neighbours at the same place, a rim that crosses itself or
            goes round no area, or no thickness.
    """

    points: Any
    thickness: float

    def __post_init__(self) -> None:
        rim = finite_array("outline, points", self.points, (None, 2))
        if len(rim) < 3:
            raise InputError.expected("at least three points", len(rim), "outline, points")
        sides = np.roll(rim, -1, axis=0) - rim
        if not (sides != 0).any(axis=1).all():
            k = int(np.flatnonzero((sides == 0).all(axis=1))[0])
            words = f"expected neighbours apart, found point {k + 1} and the next at the same place"
            raise InputError(words, subject="outline, points", found=k)
        if (pair := _crossing(rim, sides)) is not None:
            a, b = pair
            words = f"expected a rim that does not cross itself, found sides {a + 1} and {b + 1} crossing"
            raise InputError(words, subject="outline, points", found=pair)
        area = 0.5 * abs(float((rim[:, 0] * sides[:, 1] - rim[:, 1] * sides[:, 0]).sum()))
        if not 1e-12 * float((sides * sides).sum()) < area < np.inf:
            raise InputError.expected("a rim that goes round an area", area, "outline, points")
        object.__setattr__(self, "points", rim)
        object.__setattr__(self, "thickness", positive_number("outline, thickness", self.thickness))

    def as_dict(self) -> dict[str, Any]:
        """Its numbers as plain data."""
        return {"points": self.points.tolist(), "thickness": self.thickness}


def _crossing(rim: np.ndarray, sides: np.ndarray) -> tuple[int, int] | None:
    """The first two sides, counted from 0, that cross; None if none do."""
    ends = rim + sides
    start_left, end_left = (_left_of(rim, sides, points) for points in (rim, ends))
    apart = start_left * end_left < 0  # [i, j]: the ends of side j lie on different sides of side i
    found = np.argwhere(np.triu(apart & apart.T))
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


def _left_of(starts: np.ndarray, along: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Above 0 at [i, j] where point j lies left of the line from start i along side i."""
    way = points[None] - starts[:, None]
    return along[:, None, 0] * way[..., 1] - along[:, None, 1] * way[..., 0]
