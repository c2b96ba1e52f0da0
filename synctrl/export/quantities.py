"""Quantity: an array of a result with what each of its entries is; every format is written from these."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..checks import instance
from ..simulation.result import LAYOUT, Result
from .names import ARRAYS, OUTPUTS, coordinate_units, own_names, shared_names


class Entry(NamedTuple):
    """One number of a quantity at one instant.

    Attributes:
        at: its index, without that of time.
        row: what its first axis says it belongs to, such as a robot or a pair; empty if there is none.
        column: what its further axes say, such as a joint; empty if there are none.
        unit: its unit; `1` if it has none.
    """

    at: tuple[int, ...]
    row: str
    column: str
    unit: str


@dataclass(frozen=True, eq=False)
class Quantity:
    """An array of a result over time.

    Attributes:
        name: under which it is exported; no two of a result have the same.
        values: with time as the first axis.
        axes: names of the axes after time.
        labels: what the entries along each of these axes are called.
        own: what the entries along the second of these axes are called at each robot, if robots differ; no
            more than there are. Shorter rows belong to robots that have fewer.
        units: of its entries, see `Result.units`.
        unit: all of them in one text.
        long_name: what it is, in words.
        equation: numbers of the paper's equations that define it; empty if there are none.
    """

    name: str
    values: np.ndarray
    axes: tuple[str, ...]
    labels: tuple[Sequence[str], ...]
    own: Sequence[Sequence[str]] | None
    units: tuple[tuple[str, ...], ...]
    unit: str
    long_name: str
    equation: str

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Its numbers at one instant, without those of joints or parameters that a robot does not have."""
        return tuple(self._entries())

    def _entries(self) -> Iterator[Entry]:
        for at in np.ndindex(self.values.shape[1:]):
            if self.own is None or at[1] < len(self.own[at[0]]):
                words = [self._word(at, k) for k in range(len(at))]
                yield Entry(at, words[0] if at else "", ", ".join(words[1:]), self._unit(at) or "1")

    def _word(self, at: tuple[int, ...], k: int) -> str:
        return self.own[at[0]][at[1]] if self.own is not None and k == 1 else self.labels[k][at[k]]

    def _unit(self, at: tuple[int, ...]) -> str:
        if self.axes[-1:] == ("coordinate",):
            return coordinate_units(self.unit, self.values.shape[-1])[at[-1]]
        known = len(at) == 2 and len(self.units) > at[0] and len(self.units[at[0]]) > at[1]
        return self.units[at[0]][at[1]] if known else self.unit

    @cached_property
    def columns(self) -> np.ndarray:
        """Where the entries are among all numbers of an instant."""
        shape = self.values.shape[1:]
        found = [np.ravel_multi_index(entry.at, shape) if shape else 0 for entry in self.entries]
        return np.array(found, dtype=int)

    def flat(self, rows: slice = slice(None)) -> np.ndarray:
        """Numbers of the entries over some instants, (T, entries)."""
        part = self.values[rows]
        return part.reshape(len(part), int(np.prod(part.shape[1:])))[:, self.columns]

    def masked(self) -> np.ndarray:
        """The array, with NaN in place of joints and parameters that a robot does not have."""
        if self.own is None or len(self.entries) == int(np.prod(self.values.shape[1:])):
            return self.values
        counts = np.array([len(names) for names in self.own])
        has = np.arange(self.values.shape[2]) < counts[:, None]
        has = has.reshape(has.shape + (1,) * (self.values.ndim - 3))
        return np.where(has, self.values, np.asarray(np.nan, self.values.dtype))


#: axes of arrays, and what is exported beside arrays
AXES = ("time", "robot", "pair", "axis", "joint", "parameter")
BESIDE = (
    *("theta", "torque_limit", "info", "joint_name", "joint_unit", "parameter_name", "held_joint_name"),
    *("robots", "pairs", "axes", "quantities", "references", "tf", "scene"),
)


def quantities(result: Result) -> list[Quantity]:
    """All that a result has over time but its times: its arrays, then its outputs.

    An output that is called like an array, an axis of one, or something else that is exported, becomes
    `output_` and its name.

    Raises:
        InputError: no result.
    """
    instance("result", result, Result, "a Result")
    arrays = [
        _quantity(result, name, getattr(result, name), axes[1:], *ARRAYS[name])
        for name, (axes, _) in LAYOUT.items()
        if name != "t"
    ]
    about = result.info.get("outputs", {})
    taken = {*LAYOUT, *AXES, *BESIDE}
    outputs = []
    for name, values in result.outputs.items():
        words = OUTPUTS.get(name, name.replace("_", " "))
        found = _quantity(result, name, values, tuple(about[name]["axes"][1:]), words, "", taken)
        taken.add(found.name)
        outputs.append(found)
    return arrays + outputs


def _quantity(
    result: Result,
    name: str,
    values: np.ndarray,
    axes: tuple[str, ...],
    long_name: str,
    equation: str,
    taken: Collection[str] = (),
) -> Quantity:
    """One of the arrays, or of the outputs, under a name that is not taken."""
    labels = [shared_names(result, axis, k) for axis, k in zip(axes, values.shape[1:], strict=True)]
    own = own_names(result, axes[1]) if len(axes) > 1 and axes[0] == "robot" else None
    if own is not None and max(map(len, own), default=0) > values.shape[2]:
        own = None
    if own and all(names == own[0] for names in own) and len(own[0]) == values.shape[2]:
        labels[1], own = own[0], None
    called = name
    while called in taken:
        called = f"output_{called}"
    units, unit = result.units(name), result.unit(name)
    return Quantity(called, values, axes, tuple(labels), own, units, unit or "1", long_name, equation)
