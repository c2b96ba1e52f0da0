"""Checks of numbers that come from outside: one place, one wording."""

from __future__ import annotations

from math import isfinite
from typing import Any
from unicodedata import category

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError

#: characters of a name or a unit
LONGEST_LABEL = 1000
#: numbers of an array that Python looks through before numpy has begun
FEW = 50


def finite_array(name: str, value: ArrayLike, shape: tuple[int | None, ...] | None = None) -> np.ndarray:
    """`value` as a read-only float array of the given shape (None in `shape` stands for any length).

    Raises:
        InputError: not numbers, another shape, or not finite.
    """
    array = numbers(name, value, shape)
    if not _finite(array):
        where = np.argwhere(~np.isfinite(array))[0]
        entry = f" at index {tuple(int(k) for k in where)}" if array.ndim else ""
        found = array[tuple(where)]
        raise InputError(f"expected finite numbers, found {found}{entry}", subject=name, found=float(found))
    array.flags.writeable = False
    return array


def numbers(name: str, value: ArrayLike, shape: tuple[int | None, ...] | None = None) -> np.ndarray:
    """`value` as a new float array of the given shape; whether its numbers are finite is not asked.

    Raises:
        InputError: not numbers, or another shape.
    """
    try:
        if value is None or np.asarray(value).dtype.kind in "UScMm":  # "1", 1j and dates are none
            raise TypeError
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError.expected("numbers", value, name) from error
    if shape is not None and not _fits(array.shape, shape):
        raise InputError.expected(f"shape {_show(shape)}", array.shape, name)
    return array


def per_joint(name: str, value: ArrayLike, nv: int) -> np.ndarray:
    """`value`, a number or one per joint, as a read-only float array, (nv,).

    Raises:
        InputError: not numbers, another shape, or not finite.
    """
    array = finite_array(name, value)
    if array.shape not in ((), (nv,)):
        raise InputError.expected(f"a number or shape ({nv},)", array.shape, name)
    return np.broadcast_to(array, (nv,))


def symmetric_matrix(name: str, value: ArrayLike, size: int) -> np.ndarray:
    """`value` as a read-only symmetric float array, (size, size).

    Raises:
        InputError: not numbers, another shape, not finite, or not symmetric to 1e-12.
    """
    array = finite_array(name, value, (size, size))
    if not np.allclose(array, array.T, rtol=1e-12, atol=0):
        raise InputError.expected("a symmetric matrix", array, name)
    return array


def rotation_matrix(name: str, value: ArrayLike) -> np.ndarray:
    """`value` as a read-only rotation matrix, (3, 3).

    Raises:
        InputError: another shape, not orthonormal to 1e-6, or a reflection.
    """
    R = finite_array(name, value, (3, 3))
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > 1e-6 or np.linalg.det(R) < 0:
        kind = "a reflection" if off <= 1e-6 else f"one whose R R^T differs from 1 by {off:.2g}"
        raise InputError.expected("a rotation matrix", kind, name, shown=kind)
    return R


def same_size(name: str, value: ArrayLike, m: int) -> np.ndarray:
    """An axis of as many numbers as the center has that it belongs to, (m,)."""
    axis = finite_array(name, value, (None,))
    if axis.size != m:
        raise InputError.expected(f"as many numbers as the center has, {m}", axis.size, name)
    return axis


def finite_number(name: str, value: object) -> float:
    """`value` as a finite float.

    Raises:
        InputError: not one number, or not finite; True and False are no numbers.
    """
    if type(value) is float and isfinite(value):
        return value
    if isinstance(value, (bool, np.bool_)):
        raise InputError.expected("a number", value, name)
    return float(finite_array(name, value, ()))  # type: ignore[arg-type]


def positive_number(name: str, value: object) -> float:
    """`value` as a finite float above zero.

    Raises:
        InputError: see `finite_number`; or 0 and below.
    """
    number = finite_number(name, value)
    if number <= 0:
        raise InputError.expected("a number above 0", number, name)
    return number


def non_negative_number(name: str, value: object) -> float:
    """`value` as a finite float that is not below zero.

    Raises:
        InputError: see `finite_number`; or below 0.
    """
    number = finite_number(name, value)
    if number < 0:
        raise InputError.expected("a number of at least 0", number, name)
    return number


def count(name: str, value: object, least: int = 1) -> int:
    """`value` as a whole number of at least `least`.

    Raises:
        InputError: no whole number, or a smaller one.
    """
    instance(name, value, (int, np.integer), "a whole number")
    if isinstance(value, bool) or value < least:  # type: ignore[operator]
        raise InputError.expected(f"a whole number of at least {least}", value, name)
    return int(value)  # type: ignore[call-overload]


def index(name: str, value: object, count: int) -> int:
    """`value` as the index of one of so many things, counted from 0.

    Raises:
        InputError: no whole number, or outside of 0 to count - 1.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not 0 <= value < count:  # type: ignore[operator]
        raise InputError.expected(f"an index from 0 to {count - 1}", value, name, shown=repr(value))
    return int(value)  # type: ignore[call-overload]


def window(name: str, start: object, stop: object) -> tuple[float, float]:
    """Two times, s, of which the second is later than the first; None stands for no end.

    Raises:
        InputError: not two finite numbers with 0 <= start < stop.
    """
    first = finite_number(f"{name}, start", start)
    last = np.inf if stop is None else finite_number(f"{name}, stop", stop)
    if not 0 <= first < last:
        words = f"expected 0 <= start < stop, found {first:g} and {last:g} s"
        raise InputError(words, subject=name, found=(first, last))
    return first, last


def limits(name: str, value: ArrayLike | None, shape: tuple[int, ...]) -> np.ndarray:
    """Limits, which may be infinite; without any, infinite ones.

    Raises:
        InputError: another shape, not numbers, or below 0.
    """
    if value is None:
        return np.full(shape, np.inf)
    array = numbers(name, value, shape)
    if not (array >= 0).all():
        raise InputError.expected("numbers of at least 0", array[~(array >= 0)][0], name)
    return array


def boolean(name: str, value: object) -> bool:
    """`value` if it is True or False.

    Raises:
        InputError: it is something else.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise InputError.expected("True or False", value, name)
    return bool(value)


def instance(name: str, value: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Refuse a value of another type.

    Raises:
        InputError: `value` is no instance of `kind`.
    """
    if not isinstance(value, kind):
        its_kind = type(value).__name__
        raise InputError.expected(expected, its_kind, name, shown=its_kind)


def offers(name: str, value: Any, parts: tuple[str, ...], expected: str) -> None:
    """Refuse what does not offer all of some attributes, and a class in place of an object.

    Raises:
        InputError: `value` is a class, or lacks one.
    """
    if isinstance(value, type) or not all(hasattr(value, part) for part in parts):
        raise InputError.expected(expected, value, name)


def shaped(name: str, value: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array of another shape.

    Raises:
        InputError: `value` has another shape.
    """
    if np.shape(value) != shape:
        raise InputError.expected(f"an array of shape {shape}", np.shape(value), name)


def choice(name: str, value: object, known: tuple[str, ...]) -> str:
    """`value` if it is one of the known words.

    Raises:
        InputError: it is none of them.
    """
    if not isinstance(value, str) or value not in known:
        raise InputError.expected(f"one of {', '.join(map(repr, known))}", value, name)
    return str(value)


def label(name: str, value: object) -> str:
    """`value` if it is a text of one line, which files, pages and figures can hold.

    Raises:
        InputError: no text, a longer one, or control characters in it.
    """
    instance(name, value, str, "a text")
    line = str(value)
    if len(line) > LONGEST_LABEL or unprintable(line):
        raise InputError.expected(
            f"a text of one line, up to {LONGEST_LABEL} characters", line, name, shown=f"{line!a:.80}"
        )
    return line


def unprintable(text: str) -> str | None:
    """The first control character or half of a surrogate pair in a text; None if there is none."""
    if text.isprintable():  # which refuses some more, but is quick
        return None
    return next((c for c in text if category(c) in ("Cc", "Cs")), None)


def printable(text: str) -> str:
    """A text of one or more lines with everything that cannot be shown replaced."""
    return "".join(c if c in "\n\t" or unprintable(c) is None else "\ufffd" for c in text)


def _finite(array: np.ndarray) -> bool:
    if array.size <= FEW:
        return all(map(isfinite, array.ravel().tolist()))
    return bool(np.isfinite(array).all())


def _fits(found: tuple[int, ...], expected: tuple[int | None, ...]) -> bool:
    if found == expected:
        return True
    return len(found) == len(expected) and all(
        e is None or e == f for f, e in zip(found, expected, strict=True)
    )


def _show(shape: tuple[int | None, ...]) -> str:
    return "(" + ", ".join("any" if k is None else str(k) for k in shape) + ("," * (len(shape) == 1)) + ")"
