"""The outline of a flat object: a polygon with a thickness, which figures and scenes draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import finite_array, positive_number
from ..errors import InputError
from ..tasks.closed_curve import crossing


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
        if (pair := crossing(rim)) is not None:
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
