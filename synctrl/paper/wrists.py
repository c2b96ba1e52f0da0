"""How far the wrists of the A460 pair are from each other: what they carry is drawn, not simulated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..coupling.cell import Cell
from ..simulation.result import Result


def wrist_distance(cell: Cell, q: np.ndarray) -> np.ndarray:
    """Distance of the tips of two robots, (T,), m, at joint angles (T, 2, m)."""
    first, second = cell.robots
    return np.array([np.linalg.norm(first.tip_position(a) - second.tip_position(b)) for a, b in q])


def about_wrists(runs: Mapping[str, Result], cell: Cell) -> str:
    """How much the desired paths change the wrist distance, and how much the errors add, in words.

    Args:
        runs: by what they are called; all of the same desired paths.
        cell: whose joints are the coordinates.
    """
    first = next(iter(runs.values())).decimated(20)
    desired = 1e3 * wrist_distance(cell, first.x_desired)
    added = [f"{_added(run, cell):.2g} mm {name}" for name, run in runs.items()]
    return (
        f"Table I's angles put the wrists {desired[0]:.1f} mm apart at the start and {desired[-1]:.1f} mm at "
        f"the end; between, with a cubic for each joint, the distance is as small as {desired.min():.1f} mm: "
        f"the desired motion itself changes it by {np.ptp(desired):.1f} mm. Errors change it by at most "
        f"{' and '.join(added)} beside that. ε compares joints and does not know of this distance."
    )


def _added(run: Result, cell: Cell) -> float:
    """Largest difference of the wrist distance from the desired one, mm."""
    thin = run.decimated(20)
    return float(1e3 * np.abs(wrist_distance(cell, thin.x) - wrist_distance(cell, thin.x_desired)).max())
