"""Unit quaternions over time, x y z w, one per row."""

from __future__ import annotations

import numpy as np

from ..errors import InputError

TINY = 1e-6  # m: too short to have a direction


def continuous(quaternion: np.ndarray) -> np.ndarray:
    """The same rotations, with the sign of each quaternion chosen so that neighbours in time are near."""
    turns = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(turns, -1.0, 1.0)]))
    return quaternion * signs[:, None]


def towards(along: np.ndarray) -> np.ndarray:
    """Quaternions, (T, 4), that turn z to the directions `along`, (T, 3); none for one without length."""
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    x, y, z = np.where(lengths > TINY, along / np.maximum(lengths, TINY), [0, 0, 1.0]).T
    # (z x d, 1 + z . d), normalized; towards -z every axis across z will do.
    turn = np.stack([-y, x, np.zeros_like(x), 1 + z], axis=1)
    turn[z < -1 + 1e-12] = [1, 0, 0, 0]
    return continuous(turn / np.linalg.norm(turn, axis=1, keepdims=True))


def unit(name: str, quaternion: np.ndarray) -> np.ndarray:
    """Quaternions, (T, 4), at length 1, each with the sign that is nearest to the one before.

    Raises:
        InputError: one is no rotation; the message begins with `name`.
    """
    norms = np.linalg.norm(quaternion, axis=1, keepdims=True)
    if norms.min() < TINY:
        raise InputError(f"{name}: quaternion: expected a rotation, found one of length {norms.min():g}")
    return continuous(quaternion / norms)
