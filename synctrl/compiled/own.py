"""Measures of a user's own: numbers of an instant, traced, compiled and counted up beside the others."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from warnings import catch_warnings, filterwarnings

import numpy as np

from ..errors import CompilationError, InputError
from ..simulation.closed_loop import ClosedLoop
from ..simulation.instant import Instant
from . import processor
from .build import cached_library, content_key, require_casadi
from .emit import written_own
from .header import largest, prelude
from .kind import Kind, classify
from .lanes import aligned, room
from .quantities import LOGS, shape
from .structs import Quantities

#: a number of an instant
Value = Callable[[Instant], Any]


def own_function(values: Sequence[Value], sizes: Mapping[str, int]) -> Any:
    """A CasADi function of the quantities of all robots: one number per measure.

    Args:
        values: the measures.
        sizes: of the cell.

    Raises:
        InputError: one of them cannot be traced, or gives something else than one number.
    """
    import casadi as ca

    given = {name: ca.SX.sym(name, int(np.prod(shape(LOGS[name], sizes)))) for name in Instant._fields}
    instant = Instant(
        **{name: _array(given[name]).reshape(shape(LOGS[name], sizes)) for name in Instant._fields}
    )
    found = [_traced(k, value, instant) for k, value in enumerate(values)]
    names = [LOGS[name] for name in Instant._fields]
    return ca.Function("own", [*given.values()], ca.cse([ca.vertcat(*found)]), names, ["numbers"])


def own_library(
    values: Sequence[Value], kinds: list[Kind], sizes: Mapping[str, int], width: int
) -> ctypes.CDLL:
    """The measures of a cell as a library with the function `own`, found or built.

    Args:
        values: the measures.
        kinds: kinds of its robots.
        sizes: of the cell.
        width: number of lanes.

    Raises:
        InputError: see `own_function`.
        MissingDependencyError, CompilationError: see `cached_library`.
    """
    source = prelude(kinds, width) + written_own(own_function(values, sizes))
    key = content_key("own measures", source, require_casadi())
    return cached_library(key, lambda: iter([source]), _check)


class OwnNumbers:
    """Own measures of instants that were logged, by the library that takes them while runs go: the same bits.

    Args:
        values: the measures.
        loop: a closed loop of the cell.

    Raises:
        InputError: see `own_function`.
        MissingDependencyError, CompilationError: see `cached_library`.
    """

    def __init__(self, values: Sequence[Value], loop: ClosedLoop):
        kinds = classify(loop).kinds
        sizes = {**largest(kinds), "n": loop.cell.n, "p": loop.cell.coupling.pairs}
        self._width, self._count = processor.widest(), len(values)
        self._library = own_library(values, kinds, sizes, self._width)

    def of(self, logged: Instant) -> np.ndarray:
        """A row for each measure with its numbers at all instants, (measures, T).

        Args:
            logged: arrays of the instants, (T, rows, columns) each.
        """
        count, width = len(logged.q), self._width
        packs = {LOGS[name]: _packed(array, width) for name, array in logged._asdict().items()}
        quantities, found = Quantities(), room(-(-count // width), self._count, width)
        for k, numbers in enumerate(found):
            for name, packed in packs.items():
                setattr(quantities, name, packed[k].ctypes.data)
            self._library.own(ctypes.byref(quantities), ctypes.c_void_p(numbers.ctypes.data))
        return np.moveaxis(found, 1, 0).reshape(self._count, -1)[:, :count]


# -- internals --------------------------------------------------------------------------------------------


def _packed(array: np.ndarray, width: int) -> np.ndarray:
    """Instants in lanes, (T, rows, columns) as (packs, rows, columns, width); the last fills the rest."""
    packs = -(-len(array) // width)
    chosen = np.minimum(np.arange(packs * width), len(array) - 1).reshape(packs, width)
    return aligned(np.moveaxis(array[chosen], 1, -1))


def _array(column: Any) -> np.ndarray:
    """The entries of a column of symbols."""
    found = np.empty(column.numel(), dtype=object)
    for k in range(column.numel()):
        found[k] = column[k]
    return found


def _traced(k: int, value: Value, instant: Instant) -> Any:
    """The number that a measure makes of symbols."""
    import casadi as ca

    try:
        with catch_warnings():
            filterwarnings("ignore", r"\s*casadi: a numpy function", FutureWarning)
            found = np.asarray(value(instant), dtype=object)
        number = ca.SX(found.item()) if found.size == 1 else None
    except Exception as error:
        raise InputError(
            f"it cannot be traced with symbols: {type(error).__name__}: {error}", subject=f"own measure {k}"
        ) from error
    if number is None:
        raise InputError.expected("one number", found.shape, f"own measure {k}")
    return number


def _check(library: ctypes.CDLL) -> None:
    if not hasattr(library, "own"):
        raise CompilationError("the library was made from other code", subject="own measures")
