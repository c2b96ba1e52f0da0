"""Runs with robots in lanes, and what of a run may be compared bit for bit."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import pytest

from synctrl import Experiment, Result
from synctrl.compiled import program
from synctrl.compiled.engine import Compiled
from synctrl.errors import SimulationError
from synctrl.simulation.result import LAYOUT

#: numbers of lanes that there are
WIDTHS = 1, 2, 4, 8
AGREEMENT = 1e-9


class Outcome(NamedTuple):
    """What became of a run.

    Attributes:
        arrays: everything that was logged, by name.
        info: what is said of the run, without the name of its engine.
        error: kind, message, time, robot and what else the error says that ended it; None without one.
    """

    arrays: dict[str, np.ndarray]
    info: dict[str, Any]
    error: tuple | None

    @property
    def bits(self) -> dict[str, bytes]:
        """Its arrays, bit for bit."""
        return {name: array.tobytes() for name, array in self.arrays.items()}


@contextmanager
def lanes(width: int) -> Iterator[None]:
    """Let robots stand in so many lanes, however few they are, if their kind allows more than one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(program, "narrowest", lambda n, widest: width)
        yield


def outcome(experiment: Experiment, engine: Any, **options: Any) -> Outcome:
    """Make a run; nothing is warned of."""
    error = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = experiment.simulate(engine=engine, **options)
        except SimulationError as caught:
            result = caught.result
            error = (
                type(caught),
                str(caught),
                *(getattr(caught, x, None) for x in ("time", "robot", "joint", "cause", "found")),
            )
    info = {name: value for name, value in result.info.items() if name != "engine"}
    return Outcome(arrays_of(result), info, error)


def in_lanes(experiment: Experiment, width: int, libraries: dict | None = None, **options: Any) -> Outcome:
    """Make a run with robots in so many lanes."""
    with lanes(width):
        return outcome(experiment, Compiled(libraries), **options)


def arrays_of(result: Result) -> dict[str, np.ndarray]:
    """Everything that was logged, by name."""
    return {**{name: getattr(result, name) for name in LAYOUT}, **result.outputs}


def differing(one: Outcome, other: Outcome) -> list[str]:
    """Names of what is not the same, bit for bit."""
    assert one.arrays.keys() == other.arrays.keys()
    found = [name for name, bits in one.bits.items() if other.bits[name] != bits]
    found += [name for name in {**one.info, **other.info} if one.info.get(name) != other.info.get(name)]
    return found + ["error"] * (one.error != other.error)


def apart(expected: Outcome, found: Outcome) -> dict[str, float]:
    """Arrays that do not agree, and by how much of their largest number they differ; 0 may be rounded."""
    assert expected.arrays.keys() == found.arrays.keys()
    differences = {}
    for name, array in expected.arrays.items():
        assert array.shape == found.arrays[name].shape, name
        scale = np.abs(array).max(initial=0.0) + 1e-12
        differences[name] = float(np.abs(found.arrays[name] - array).max(initial=0.0) / scale)
    return {name: share for name, share in differences.items() if not share <= AGREEMENT}


def assert_same_in_all_lanes(
    experiment: Experiment, widths: tuple[int, ...] = WIDTHS, **options: Any
) -> None:
    """A run has the same bits with robots in any number of lanes, and is that of the reference engine."""
    first, *others = (in_lanes(experiment, width, **options) for width in widths)
    for width, other in zip(widths[1:], others, strict=True):
        assert not differing(first, other), width
    reference = outcome(experiment, "pinocchio", **options)
    assert reference.error is None
    assert not apart(reference, first)
