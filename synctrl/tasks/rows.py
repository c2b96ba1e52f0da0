"""Rows of arrays that have one row per robot, padded where a robot has fewer joints than the largest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ..robots.robot import Robot

Rows = Callable[[np.ndarray], Iterable[np.ndarray]]
"""(n, ..., nv) -> n views without padding."""


def joint_rows(robots: Sequence[Robot]) -> Rows:
    """How to go through the rows of these robots, each cut to the joints that its robot has."""
    counts = [robot.nv for robot in robots]
    if len(set(counts)) == 1:
        return iter
    return lambda array: [row[..., :count] for row, count in zip(array, counts, strict=True)]
