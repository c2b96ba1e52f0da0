"""What becomes of a run that is interrupted, or in which a function of the user's fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from traceback import walk_tb
from typing import Any, TypeVar

from ..errors import SimulationError, SynctrlError, failed

Made = TypeVar("Made")
Progress = Callable[[float], Any]

#: packages in which no function of the user's stands
LIBRARIES = frozenset({"synctrl", "numpy", "scipy", "pinocchio", "mujoco", "casadi"})


def user_failure(error: Exception, t: float) -> SimulationError:
    """The error of a run that an exception ended which nobody foresaw, with the function that it came from.

    Args:
        error: the exception, with its traceback.
        t: simulated time of the last instant reached, s.
    """
    frames = [(frame, line) for frame, line in walk_tb(error.__traceback__)]
    own = [entry for entry in frames if _package(entry[0]) not in LIBRARIES]
    frame, line = (own or frames)[-1]
    code = frame.f_code
    return failed(f"'{code.co_qualname}' ({code.co_filename}, line {line})", t, error)


def date(error: SynctrlError, t: float) -> None:
    """Say when a failure happened that was raised where the time was not known.

    Args:
        error: the failure.
        t: simulated time of the last instant reached, s.
    """
    if isinstance(error, SimulationError) and error.time is None:
        error.time, error.args = t, (f"{error}, in the step from t = {t:g} s",)


def tell(progress: Progress | None, t: float) -> None:
    """Report the time reached to whoever wants to know.

    Raises:
        SimulationError: the function of the user's failed.
    """
    if progress is None:
        return
    try:
        progress(t)
    except SynctrlError:
        raise
    except Exception as error:
        raise failed("the function given as progress", t, error) from error


def up_to_a_failure(make: Callable[[int, int], Made], first: int, last: int) -> Iterator[Made]:
    """What is made for the steps [first, last) in one go, or, if that fails, for those before the failure.

    Args:
        make: first, last -> what is made.
        first, last: the steps.

    Raises:
        Exception, KeyboardInterrupt: what `make` raised for the first step for which it fails. An interrupt
            that does not come again was not of its doing, and is raised at once.
    """
    made, failure = _attempt(make, first, last)
    if failure is None:
        yield made  # type: ignore[misc]
        return
    good, bad = first, last
    while bad - good > 1:
        middle = (good + bad) // 2
        found = _attempt(make, good, middle)[1]
        good, bad, failure = (middle, bad, failure) if found is None else (good, middle, found)
    again = _attempt(make, good, bad)[1]
    if again is not None and good > first:
        yield make(first, good)
    raise failure if again is None else again


def _attempt(
    make: Callable[[int, int], Made], first: int, last: int
) -> tuple[Made | None, BaseException | None]:
    try:
        return make(first, last), None
    except (Exception, KeyboardInterrupt) as error:
        return None, error


def _package(frame: Any) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]
