"""Can robots with one mechanism follow their paths? Most can, which is seen for many of them at once.

From where it is, every robot goes to its next target by steps such as `inverse_kinematics` begins with. If
they lead there, joint positions for the path exist. If they do not it is only in doubt, and has to be looked
at with more patience.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..robots.mechanism import Mechanism
from ..robots.tips import TipPlaces, tip_places
from .inverse_kinematics import TOLERANCE
from .pose import PoseSpace
from .spaces import CartesianSpace

#: steps to a target at most: quadratic convergence needs few
STEPS = 10
#: of least squares, as `inverse_kinematics` begins with
DAMPING = 1e-6
#: targets that differ by less than this are one, m; and the share of the tolerance that is left for that
GRAIN, SURE = 1e-9, 0.99


def can_be_followed(space: Any) -> bool:
    """Whether a space misses targets by the package's own formula, which serves many robots at once."""
    return getattr(type(space), "miss", None) in (CartesianSpace.miss, PoseSpace.miss)


def follow(
    space: Any, fixed: Mechanism, bases: tuple[np.ndarray, np.ndarray], q0: np.ndarray, targets: np.ndarray
) -> np.ndarray:
    """Which of k robots are seen to reach all their targets one after another, (k,); others are in doubt.

    Args:
        space: one that `can_be_followed`.
        fixed: their mechanism.
        bases: rotation and position of the first joint of each, (k, 3, 3) and (k, 3), m.
        q0: where they start, (k, nv).
        targets: (T, k, m).
    """
    first, which = _distinct(space, bases, q0, targets)
    R, p = (part[first] for part in bases)
    with np.errstate(all="ignore"):
        try:
            return _follow(space, fixed, R, p, q0[first], targets[:, first])[which]
        except np.linalg.LinAlgError:
            return np.zeros(len(q0), dtype=bool)


def _distinct(
    space: Any, bases: tuple[np.ndarray, np.ndarray], q0: np.ndarray, targets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First robot of each motion that is another one as seen from its base, and which one each robot has."""
    (R, p), axes = bases, getattr(space, "rows", [0, 1, 2])
    seen = np.array(targets)
    seen[..., : len(axes)] -= p[:, axes]
    with np.errstate(over="ignore"):
        grains = np.rint(seen / GRAIN).swapaxes(0, 1)
    parts = [part.reshape(len(R), -1) + 0.0 for part in (R, q0, grains)]  # -0 counts as 0
    rows = np.concatenate(parts, axis=1)
    place: dict[bytes, int] = {}
    which = np.array([place.setdefault(row.tobytes(), len(place)) for row in rows])
    return np.unique(which, return_index=True)[1], which


def _follow(
    space: Any, fixed: Mechanism, R: np.ndarray, p: np.ndarray, q: np.ndarray, targets: np.ndarray
) -> np.ndarray:
    """`follow` for robots of which no two have the same to do."""
    sure, q = np.ones(len(q), dtype=bool), q.copy()
    places = tip_places(fixed, R, p, q)
    for target in targets:
        for left in reversed(range(STEPS + 1)):
            error, J = space.missed(target, *places)
            off = sure & ~(np.abs(error).max(axis=-1) < SURE * TOLERANCE)
            if not off.any():
                break
            if not left:
                sure &= ~off
                break
            rows = np.flatnonzero(off)
            q[rows] += _step(error[rows], J[rows])
            _put(places, rows, tip_places(fixed, R[rows], p[rows], q[rows]))
    return sure


def _step(error: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Damped least squares, (k, nv), of errors, (k, m), and Jacobians, (k, m, nv)."""
    square = J @ J.mT + DAMPING * np.eye(error.shape[-1])
    return np.vecmat(np.linalg.solve(square, error[..., None])[..., 0], J)


def _put(places: TipPlaces, rows: np.ndarray, moved: TipPlaces) -> None:
    for part, new in zip(places, moved, strict=True):
        part[rows] = new
