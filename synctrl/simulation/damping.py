"""When and how much singular configurations were damped during a run."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.controller import Signals
from ..tasks.redundancy import velocity_lost


class DampingLog:
    """Damping of every robot at all logged instants, as a list of intervals.

    Args:
        instants: number of logged instants.
        robots: number of robots.

    Attributes:
        arrays: lambda, and the part of xref' that J v_ref leaves out, (instants, robots) each.
    """

    def __init__(self, instants: int, robots: int):
        self.arrays = {name: np.zeros((instants, robots)) for name in ("damping", "velocity_lost")}

    def add(self, k: int, signals: Signals) -> None:
        """Log one instant."""
        task = signals.task
        if task.J is None or task.inversion is None or task.inversion.damping is None:
            return
        lost = velocity_lost(task.J, signals.v_ref, signals.asked.xref_dot)
        self.arrays["damping"][k], self.arrays["velocity_lost"][k] = task.inversion.damping[:, 0], lost[:, 0]

    def report(self, t: np.ndarray) -> list[dict[str, Any]]:
        """Intervals in which the damping of a robot was above zero, in order of their start.

        Args:
            t: instants logged so far, (T,), s.

        Returns:
            One entry per interval: `robot`, counted from 0; `start`, `stop`, s: first and last instant;
            `largest_damping`: of lambda; `largest_velocity_lost`: of |xref' - J v_ref|, task unit per s.
        """
        found = []
        logged = (array[: len(t)].T for array in self.arrays.values())
        for robot, (damping, lost) in enumerate(zip(*logged, strict=True)):
            for first, last in spans(damping > 0):
                part = slice(first, last + 1)
                found.append(
                    {
                        "robot": robot,
                        "start": float(t[first]),
                        "stop": float(t[last]),
                        "largest_damping": float(damping[part].max()),
                        "largest_velocity_lost": float(lost[part].max()),
                    }
                )
        return sorted(found, key=lambda entry: (entry["start"], entry["robot"]))


def spans(active: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True in a row, (T,)."""
    if not active.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(int), [0]))))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
