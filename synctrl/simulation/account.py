"""What a plant says of its own state in a result, looked at before it is believed.

A plant of a user's own may carry a state through a run that nobody else understands, see `Plant`. At the end
of the run its methods `report` and `outputs` say what became of it. Both are code of the user's, so what they
give is checked here before it gets into a `Result`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from .plant import Output, Plant


class Account(NamedTuple):
    """What a plant adds to a result: entries of `info`, and outputs by name."""

    report: Mapping[str, Any]
    outputs: Mapping[str, Output]


#: of a plant that has nothing to say
NOTHING = Account({}, {})


def account_of(
    plant: Plant, hidden: np.ndarray, taken: Collection[str], lengths: Mapping[str, int]
) -> Account:
    """Ask a plant.

    Args:
        plant: the plant.
        hidden: its own state at the logged instants, (T, size of the state).
        taken: names of entries and outputs that are not the plant's to give.
        lengths: of the axes that have one in this run, "time" among them.

    Raises:
        InputError: something else than entries by name, a name that is taken, or an output that is no array
            with a unit and one axis per dimension, time first.
        Exception: what the plant raises.
    """
    found = Account(plant.report(hidden), plant.outputs(hidden))
    for what, entries in found._asdict().items():
        where = f"plant {type(plant).__qualname__}, {what}"
        if not isinstance(entries, Mapping):
            raise InputError(f"{where}: expected entries by name, found {entries!r:.80}")
        for name in entries:
            if not isinstance(name, str) or not name.isidentifier() or name in taken:
                raise InputError(f"{where}: expected names that are not taken, found {name!r:.80}")
    for name, output in found.outputs.items():
        _check_output(f"plant {type(plant).__qualname__}, outputs, {name}", output, lengths)
    return found


def _check_output(where: str, output: Any, lengths: Mapping[str, int]) -> None:
    try:
        array, unit, axes = output
        named = isinstance(unit, str) and axes[0] == "time" and all(isinstance(axis, str) for axis in axes)
        fits = all(lengths.get(axis, k) == k for axis, k in zip(axes, array.shape, strict=True))
        sound = named and fits and array.dtype == np.float64
    except (TypeError, ValueError, AttributeError, IndexError):
        sound = False
    if not sound:
        raise InputError(
            f"{where}: expected an array of floats over {lengths['time']} instants, its unit, and the names "
            f"of its axes, of which the first is 'time', found {output!r:.80}"
        )
