"""Two runs of one cell compared, instant by instant: how far apart two judges of the physics are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import instance
from ..errors import InputError
from ..simulation.result import Result

#: what counts as agreement, relative to the largest error
AGREEMENT = 1e-4


@dataclass(frozen=True, eq=False)
class Comparison:
    """How far the errors of two runs are apart.

    Attributes:
        title: of the first run.
        t: (T,), s.
        tracking, sync: largest difference of tracking and of synchronization errors over all robots or pairs
            and axes, relative to the largest error of the first run, (T,).
    """

    title: str
    t: np.ndarray
    tracking: np.ndarray
    sync: np.ndarray

    @property
    def agrees(self) -> bool:
        """Whether both errors are the same to `AGREEMENT` at every instant."""
        return bool(max(self.tracking.max(), self.sync.max()) <= AGREEMENT)


def compare_runs(ours: Result, theirs: Result) -> Comparison:
    """Compare two runs of one cell at equal instants.

    Raises:
        InputError: other instants, or another cell.
    """
    for run in (ours, theirs):
        instance("runs", run, Result, "a Result")
    if not len(ours.t):
        raise InputError(
            "expected at least one logged instant, found none", subject=f"run '{ours.info['title']}'"
        )
    if not np.array_equal(ours.t, theirs.t) or ours.x.shape != theirs.x.shape:
        raise InputError(
            f"expected the same instants of the same cell, found {ours!r} and {theirs!r}", subject="runs"
        )
    tracking, sync = (
        _relative(getattr(ours, kind), getattr(theirs, kind)) for kind in ("tracking_error", "sync_error")
    )
    return Comparison(str(ours.info["title"]), ours.t, tracking, sync)


def _relative(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return np.abs(ours - theirs).max(axis=(1, 2)) / np.abs(ours).max()
