"""Where task coordinates mean nothing any more: what spaces tell the guard of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .redundancy import determinant


class Invalid(NamedTuple):
    """What makes the task coordinates of a robot mean nothing.

    Attributes:
        check: "orientation" and "condition" are the package's own, for errors near pi and singular Jacobians;
            a space of another kind may say here in its own words what is too large, for example "distance".
        robot: which one, counted from 0.
        value: the number that was too large: an angle, rad, a condition number, or the space's own.
    """

    check: str
    robot: int = 0
    value: float = 0.0


def too_singular(J: np.ndarray, J_inv: np.ndarray, limit: float) -> Invalid | None:
    """The first robot with too large a condition number, by the Frobenius norm.

    Args:
        J, J_inv: Jacobians and their inverses, (n, m, nv) and (n, nv, m).
        limit: from which condition number on.
    """
    if _total(J) * _total(J_inv) < limit**2:  # then it holds for every robot
        return None
    condition = np.sqrt((J * J).sum((1, 2)) * (J_inv * J_inv).sum((1, 2)))
    i = int(np.argmax(~(condition < limit)))
    return None if condition[i] < limit else Invalid("condition", i, float(condition[i]))


def too_turned(e: np.ndarray, limit: float) -> Invalid | None:
    """The robot with the largest orientation error, if that is too large.

    Args:
        e: orientation errors, (n, 3), rad.
        limit: the largest angle that is not, rad.
    """
    angle = np.nan_to_num(np.linalg.norm(e, axis=1), nan=0.0)
    i = int(np.argmax(angle))
    return Invalid("orientation", i, float(angle[i])) if angle[i] > limit else None


def determinant_sides(J: np.ndarray, square: np.ndarray) -> np.ndarray:
    """On which side of a singular configuration robots are, (n,): 1 or -1, or 0 where there are no sides.

    Args:
        J: Jacobians, (n, m, nv).
        square: which robots have as many joints as task coordinates, (n,).
    """
    found = np.zeros(len(J), dtype=np.int8)
    found[square] = np.where(determinant(J[square, :, : J.shape[1]]) > 0, 1, -1)
    return found


def _total(A: np.ndarray) -> float:
    """Sum of the squares of all entries."""
    entries = A.ravel()
    return float(entries.dot(entries))
