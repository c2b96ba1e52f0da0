"""Rows of different lengths side by side, as robots with different numbers of joints have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def padded(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Rows of different lengths as one array, (n, longest), filled up with zeros."""
    array = np.zeros((len(rows), max(len(row) for row in rows)))
    for target, row in zip(array, rows, strict=True):
        target[: len(row)] = row
    return array
