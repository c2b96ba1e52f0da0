"""What is told of many robots at once: lines that keep time with each other are one question."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..robots.forest import as_selection
from ..tasks.together import along_lines, lines, parts
from ..tasks.trajectories import Motion
from .desired import rows_of

#: robots that are asked at once at most: more do not go faster, and what is made on the way takes memory
LENGTH = 1024


def asked_together(cell: Any, robots: Sequence[int], times: np.ndarray) -> np.ndarray:
    """All that is told of some robots of a cell, (3 or more, T, number of robots, m).

    Args:
        cell: the cell.
        robots: which of its robots.
        times: (T,), s.

    Raises:
        SynctrlError, SimulationError, NonFiniteError: see `desired_motion`, for the first of the robots.
    """
    trajectories = [cell.members[i].trajectory for i in robots]
    found = np.empty((rows_of(cell.space), len(times), len(robots), cell.m))
    clocks = cell.clocks[list(robots)]
    left = set(range(len(robots)))
    if len(found) == 3 and (clocks == clocks[:1]).all():
        for rows in parts(lines(trajectories), LENGTH):
            if _fill(found, rows, along_lines([trajectories[k] for k in rows], times + clocks[0])):
                left.difference_update(rows)
    for k in sorted(left):
        found[:, :, k] = cell.told(robots[k], times)
    return found


def _fill(found: np.ndarray, rows: Sequence[int], motion: Motion) -> bool:
    """Write motions of some robots to their places, if they are finite: else each will be asked by itself."""
    if not all(np.isfinite(part).all() for part in motion):
        return False
    for place, part in zip(found, motion, strict=True):
        place[:, as_selection(rows)] = part
    return True
