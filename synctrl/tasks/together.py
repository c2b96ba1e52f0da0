"""Desired motions of many robots, asked at once where one formula has them all.

A call from Python costs more than what it computes for a few instants, and large cells have thousands of
motions. Lines from point to point that keep time with each other differ in where they begin and lead alone.
The numbers are those that each of them gives by itself, bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from ..robots.forest import alike
from .trajectories import Circle, Cubic, ExponentialApproach, Hold, Motion, Trajectory

#: lines from point to point, and what their progress depends on; a subclass may be anything
LINES: dict[type, tuple[str, ...]] = {Hold: (), Cubic: ("duration",), ExponentialApproach: ("rate",)}
#: motions whose velocity and acceleration are derivatives of the position, by the formulas that they are
EXACT: tuple[type, ...] = (*LINES, Circle)


def lines(trajectories: Sequence[Trajectory]) -> list[list[int]]:
    """Which of some motions are lines that keep time with each other."""
    found = alike(map(_pace, trajectories))
    return [rows for pace, rows in found.items() if pace is not None]


def along_lines(trajectories: Sequence[Any], times: np.ndarray) -> Motion:
    """Motions of k lines that keep time with each other, (T, k, m) each, at times, (T,), s."""
    start = np.array([line.start for line in trajectories])
    way = np.array([line.end for line in trajectories]) - start
    s, s_dot, s_ddot = (part[:, None, None] for part in trajectories[0].progress(times))
    return Motion(start + s * way, s_dot * way, s_ddot * way)


def parts(groups: Iterable[list[int]], length: int) -> Iterator[list[int]]:
    """The rows of all groups, so many of a group at a time."""
    return (rows[first : first + length] for rows in groups for first in range(0, len(rows), length))


def _pace(trajectory: Trajectory) -> tuple[Any, ...] | None:
    """What lines have in common that keep time with each other; None of another motion."""
    kind = type(trajectory)
    if kind not in LINES:
        return None
    return kind, trajectory.dimension, *(getattr(trajectory, name) for name in LINES[kind])
