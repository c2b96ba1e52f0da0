"""Bars between the tips of robots that are compared, one set for every synchronization error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np


class Bar(NamedTuple):
    """A bar of a scene.

    Attributes:
        name: what the controls call it.
        row: which synchronization error it shows, counted from 0.
        start, end: its ends over time, (T, 3), m.
    """

    name: str
    row: int
    start: np.ndarray
    end: np.ndarray


def bars(compared: Sequence[Sequence[int]], tips: np.ndarray, name: str) -> Iterator[Bar]:
    """The bars of all synchronization errors.

    Two robots have one bar from tip to tip. More than two that are compared all at once, as by
    `Coupling.sum`, have one each, from the middle of their tips.

    Args:
        compared: the robots of each synchronization error, counted from 0.
        tips: positions of the tips, (T, n, 3), m.
        name: of the bars, to which their numbers are added.
    """
    for k, robots in enumerate(compared):
        if len(robots) == 2:
            yield Bar(f"{name} {k + 1}", k, tips[:, robots[0]], tips[:, robots[1]])
        else:
            middle = tips[:, robots].mean(axis=1)
            yield from (Bar(f"{name} {k + 1}, robot {i + 1}", k, middle, tips[:, i]) for i in robots)
