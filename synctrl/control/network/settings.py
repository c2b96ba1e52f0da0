"""Checks of the settings of a network: each gives a setting as it is kept, or refuses it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import count, finite_array
from ...errors import InputError

#: no time of a network is longer, s, and no filter faster, rad/s; squares of it are still numbers
LARGEST = 1e9
#: seeds are below it, as whole numbers in files are
SEEDS = 2**63


def plain(value: Any) -> Any:
    """A setting as plain data."""
    return (
        value.tolist()
        if isinstance(value, np.ndarray)
        else list(value)
        if isinstance(value, tuple)
        else value
    )


def is_given(value: Any) -> bool:
    """Whether a setting is neither None nor 0 throughout."""
    return value is not None and bool(np.any(value))


def _array(name: str, value: ArrayLike) -> np.ndarray:
    """A setting of numbers; True and False are none."""
    array = finite_array(name, value)
    if np.asarray(value).dtype.kind == "b":
        raise InputError.expected("numbers", value, name)
    return array


def row_of(name: str, value: ArrayLike) -> np.ndarray:
    """A number, or one for each of something."""
    array = _array(name, value)
    if array.ndim > 1:
        raise InputError.expected("a number, or a row of numbers", array.shape, name)
    return array


def _apart(value: Any) -> Any:
    """A setting of pairs, with 0 where a robot would hear itself; anything else as it came."""
    try:
        given = np.asarray(value)
    except ValueError:  # rows of different lengths
        return value
    if given.ndim != 2 or given.dtype.kind not in "iuf":
        return value
    return np.where(np.eye(*given.shape) > 0, 0, given)


def of_pairs(name: str, value: ArrayLike, unit: str = ", s") -> np.ndarray:
    """A number of at least 0, or (n, n) of them, with 0 for the diagonal whatever was given."""
    array = _array(name, _apart(value))
    if array.ndim not in (0, 2) or array.shape != array.shape[::-1]:
        raise InputError.expected("a number, or (n, n) of them", array.shape, name)
    if array.min(initial=0.0) < 0:
        raise InputError.expected(f"numbers of at least 0{unit}", float(array.min()), name)
    not_too_large(name, array)
    return array


def not_too_large(name: str, value: Any) -> Any:
    """A time or a rate, if it is one of this world."""
    if (largest := float(np.max(np.abs(value), initial=0.0))) > LARGEST:
        raise InputError.expected(f"numbers up to {LARGEST:g}", largest, name)
    return value


def seed_of(value: Any) -> int:
    """A whole number from 0 that files can keep."""
    seed = count("seed", value, least=0)
    if seed >= SEEDS:
        raise InputError.expected("a whole number below 2^63", seed, "seed", shown=f"{hex(seed):.40}")
    return seed


def above_0(name: str, value: ArrayLike) -> np.ndarray:
    """A number above 0, or a row of such."""
    array = row_of(name, value)
    if not array.size or array.min() <= 0:
        raise InputError.expected("numbers above 0", array.tolist(), name)
    return array


def probability(name: str, value: ArrayLike) -> np.ndarray:
    """A probability below 1, or (n, n) of such."""
    array = of_pairs(name, value, unit="")
    if array.max(initial=0.0) >= 1:
        raise InputError.expected(
            "probabilities below 1, or nothing would ever come", float(array.max()), name
        )
    return array


def burst_of(value: Any) -> tuple[float, float] | None:
    """Probabilities of turning bad, and of healing."""
    if value is None:
        return None
    pair = _array("burst", value)
    if pair.shape != (2,):
        raise InputError.expected("two probabilities", pair.tolist(), "burst")
    turns, heals = pair.tolist()
    if not (0 <= turns <= 1 and 0 < heals <= 1):
        wanted = "probabilities of turning bad, 0 to 1, and of turning good, above 0"
        raise InputError.expected(wanted, (turns, heals), "burst")
    return turns, heals
