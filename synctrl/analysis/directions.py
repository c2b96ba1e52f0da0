"""Directions of small errors, in words: which robot's, and which base parameter or error."""

from __future__ import annotations

import numpy as np

from .small_errors import Coordinates

#: terms of a combination that are named, and coefficients below which one is rounding
TERMS, TINY = 3, 1e-6
#: what the parts of z are called, beside base parameters
CALLED = {"s": "velocity error s_q", "e*": "coupled error e*"}


def describe_unexcited(z: Coordinates) -> tuple[str, ...]:
    """Combinations of base parameters that the motion does not excite, each by as few names as can be."""
    found = []
    for i, (L, count) in enumerate(zip(z.L, z.unexcited, strict=True)):
        for row in _reduced(L[:, L.shape[1] - count :].T):
            found.append(f"{z.controller.cell.names[i]}: {_combination(row, _names(z, i))}")
    return tuple(found)


def describe_slowest(z: Coordinates, left: np.ndarray, right: np.ndarray) -> str:
    """Where in z an eigenvector lives, by its participation factors, which do not depend on units.

    Args:
        z: the coordinates.
        left, right: eigenvectors of one multiplier, (size,).
    """
    share = left.conj() * right
    names = z.controller.cell.names
    parts = {
        f"{names[i]}: {word}": abs(share[part].sum())
        for kind, word in CALLED.items()
        for i, part in enumerate(z.parts[kind])
    }
    parts["integrals of epsilon"] = abs(share[z.parts["i"][0]].sum())
    base: dict[int, np.ndarray] = {}
    for i, part in enumerate(z.parts["u"]):
        t, dual = z.L[i] @ right[part], np.linalg.pinv(z.L[i]).T @ left[part]
        base[i] = np.abs(dual.conj() * t)
        parts[f"{i}"] = abs(share[part].sum())
    largest = max(parts, key=lambda name: parts[name])
    if not largest.isdigit():
        return largest
    i = int(largest)
    return f"{names[i]}: base parameter {_names(z, i)[int(base[i].argmax())]}"


def _names(z: Coordinates, i: int) -> list[str]:
    """Base parameters of one robot by the parameter that stands first in each."""
    parameters = z.controller.cell.parameters[i].names
    return [parameters[k] for k in z.groupings[i].columns]


def _reduced(rows: np.ndarray) -> np.ndarray:
    """A basis of the same rows with a leading one in each, where no other row has anything."""
    rows = rows.copy()
    taken: list[int] = []
    for k in range(len(rows)):
        free = np.abs(rows[k:])
        free[:, taken] = 0.0
        pivot, column = map(int, np.unravel_index(int(free.argmax()), free.shape))
        rows[[k, k + pivot]] = rows[[k + pivot, k]]
        rows[k] /= rows[k, column]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, column], rows[k])
        taken.append(column)
    return rows


def _combination(row: np.ndarray, names: list[str]) -> str:
    """A direction in words, its largest terms first."""
    order = [k for k in np.argsort(-np.abs(row), kind="stable") if abs(row[k]) > TINY]
    terms = [names[k] if np.isclose(row[k], 1.0) else f"{row[k]:.4g} {names[k]}" for k in order[:TERMS]]
    return " + ".join(terms + ["..."] * (len(order) > TERMS)).replace("+ -", "- ")
