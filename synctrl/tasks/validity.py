"""Where task coordinates mean nothing any more: what the guard of a run looks at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np


def condition_number(J: np.ndarray, J_inv: np.ndarray) -> np.ndarray:
    """Condition numbers of Jacobians by the Frobenius norm, (..., 1).

    Args:
        J, J_inv: Jacobians and their inverses, (..., m, nv) and (..., nv, m).
    """
    return np.sqrt(_total(J) * _total(J_inv))


def orientation_angle(e: np.ndarray) -> np.ndarray:
    """Sizes of orientation errors, (..., 1), rad, of errors of poses, (..., 6)."""
    return np.sqrt((e[..., 3:] ** 2).sum(-1, keepdims=True))


#: what may be watched, by name, as a function of a `Measurement`
WATCHED: Mapping[str, Callable[[Any], np.ndarray]] = MappingProxyType(
    {
        "orientation": lambda task: orientation_angle(task.e),
        "condition": lambda task: condition_number(task.J, task.J_inv),
    }
)


def _total(A: np.ndarray) -> np.ndarray:
    """Sum of the squares of all entries, (..., 1)."""
    return (A * A).reshape(*A.shape[:-2], -1).sum(-1, keepdims=True)
