"""When and how much singular configurations were damped during a run."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.controller import Signals


class DampingLog:
    """Damping of every robot at all logged instants, as a list of intervals.

    Args:
        instants: number of logged instants.
        robots: number of robots.
    """

    def __init__(self, instants: int, robots: int):
        self._damping = np.zeros((instants, robots))
        self._lost = np.zeros((instants, robots))

    def add(self, k: int, signals: Signals) -> None:
        """Log one instant: lambda, and the part of xref' = c^-1 u that J v_ref leaves out."""
        task = signals.task
        if task.J is None or task.inversion is None or task.inversion.damping is None:
            return
        lost = np.matvec(signals.reference.c_inv, signals.u) - np.matvec(task.J, signals.v_ref)
        self._damping[k] = task.inversion.damping[:, 0]
        self._lost[k] = np.linalg.norm(lost, axis=1)

    def report(self, t: np.ndarray) -> list[dict[str, Any]]:
        """Intervals in which the damping of a robot was above zero, in order of their start.

        Args:
            t: instants logged so far, (T,), s.

        Returns:
            One entry per interval: `robot`, counted from 0; `start`, `stop`, s: first and last instant;
            `largest_damping`: of lambda; `largest_velocity_lost`: of |xref' - J v_ref|, task unit per s.
        """
        found = []
        for robot, damping in enumerate(self._damping[: len(t)].T):
            for first, last in spans(damping > 0):
                part = slice(first, last + 1)
                found.append(
                    {
                        "robot": robot,
                        "start": float(t[first]),
                        "stop": float(t[last]),
                        "largest_damping": float(damping[part].max()),
                        "largest_velocity_lost": float(self._lost[part, robot].max()),
                    }
                )
        return sorted(found, key=lambda entry: (entry["start"], entry["robot"]))


def spans(active: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True in a row, (T,)."""
    if not active.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(int), [0]))))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
