"""Functions that users wrote, asked at some instants: whatever fails in them is named, with its time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..errors import NonFiniteError, SynctrlError, failed

Found = TypeVar("Found")
Parts = TypeVar("Parts", bound="tuple[np.ndarray, ...]")


def asked(call: Callable[[np.ndarray], Found], times: np.ndarray, what: str, robot: int | None) -> Found:
    """What a function of the user's gives at some times.

    Args:
        call: times -> what it gives.
        times: (T,), s.
        what: whose function it is, for example "the weights of the coupling".
        robot: index of the robot concerned, counted from 0, or None.

    Raises:
        SynctrlError: what the function raises of this kind.
        SimulationError: it raises anything else; with robot and time.
    """
    try:
        return call(times)
    except SynctrlError:
        raise
    except Exception as error:
        raise failed(what, _first_failure(call, times), error, robot) from error


def finite_weights(call: Callable[[np.ndarray], Parts], times: np.ndarray) -> Parts:
    """Weights at some times, (T,), known to be numbers.

    Args:
        call: times -> weights.
        times: (T,), s.

    Raises:
        SynctrlError: what the weights raise of this kind.
        SimulationError: they raise anything else; with the time.
        NonFiniteError: they are infinite or not numbers; with robot and time.
    """
    weights = asked(call, times, "the weights of the coupling", None)
    for name, value in zip(("c", "c'", "c''"), weights, strict=False):
        if not np.isfinite(value).all():
            k, i = (int(index) for index in np.argwhere(~np.isfinite(value))[0][:2])
            what, found = f"{name} of the robot at index {i}", str(value[k, i].tolist())
            raise not_finite(what, found, float(times[k]), i, "weights")
    return weights


def not_finite(what: str, found: str, time: float, robot: int, cause: str) -> NonFiniteError:
    """The error about numbers of a function of the user's that are infinite or no numbers.

    Args:
        what: they belong to.
        found: the numbers, in words.
        time: s.
        robot: index of the robot concerned.
        cause: as in `NonFiniteError`.
    """
    return NonFiniteError(
        f"{what} is not finite at t = {time:g} s: {found}; expected finite numbers at all times of the run",
        time=time,
        robot=robot,
        cause=cause,
    )


def _first_failure(call: Callable[[np.ndarray], Any], times: np.ndarray) -> float:
    """The first of the times at which a call fails; the first of all if it only fails for many at once."""
    for t in np.unique(times):
        try:
            call(np.array([t]))
        except Exception:
            return float(t)
    return float(times.min())
