"""Every error this package raises on purpose.

Each message says what was wrong, where, what was found and what is expected. All kinds derive from
`SynctrlError`, so one `except` clause catches whatever the package has to say about its input. Warnings point
to the line outside the package that led to them, see `warn`.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from types import FrameType
from typing import Any, Self

import numpy as np


class Portable(BaseException):
    """An exception that can be copied and sent to another process, with its message and all its attributes.

    Python makes an exception again by calling its class with its message, which fails where the class asks
    for more than that. Here it is put together from its parts instead. `__cause__` stays behind.
    """

    def __reduce__(self) -> tuple:
        return _remade, (type(self), self.args), *super().__reduce__()[2:]


class SynctrlError(Portable, Exception):
    """Base of all errors raised by synctrl.

    Args:
        message: what is wrong: what is expected, and what was found.
        subject, found, file, line: see below; the message then begins with the subject.

    Attributes:
        subject: the argument or part at fault, spelled and counted as in the API, for example "dt", "Lambda"
            or "robot 2, trajectory"; None if the error is not about one part alone.
        found: what was found in its place, as plain data: a number, a text, or a tuple of them; of anything
            else the name of its type. None if that is not said.
        file: the file or folder concerned, or None.
        line: of that file, counted from 1, or None.
        result: a `Result` with what a run had computed until then; None if the error did not stop a run.
        problem: the message without what it begins with.
    """

    subject: str | None = None
    found: Any = None
    file: str | None = None
    line: int | None = None
    result: Any = None
    problem: str = ""

    def __init__(
        self,
        message: str = "",
        *,
        subject: str | None = None,
        found: Any = None,
        file: str | Path | None = None,
        line: int | None = None,
    ):
        file = None if file is None else str(file)
        data = {"subject": subject, "found": plain_data(found), "file": file, "line": line or None}
        vars(self).update({name: value for name, value in data.items() if value is not None})
        self.problem = message
        super().__init__(self._whole(message))

    @classmethod
    def expected(
        cls, what: str, found: Any, subject: str | None = None, shown: str = "", **place: Any
    ) -> Self:
        """The error about something else than what is expected.

        Args:
            what: is expected, in words.
            found: what is there instead.
            subject: see `SynctrlError`.
            shown: how the message shows it; by default as Python writes it, and a float with six digits.
            place: `file` and `line`.
        """
        value = found.tolist() if isinstance(found, (np.generic, np.ndarray)) else found
        shown = shown or (f"{value:g}" if isinstance(value, float) else repr(value))
        return cls(f"expected {what}, found {shown}", subject=subject, found=found, **place)

    def about(self, subject: str | None = None, **data: Any) -> Self:
        """This error with more data, for one whose message says in words of its own what it is about."""
        found = plain_data(data.pop("found", self.found))
        vars(self).update(subject=subject, found=found, **data)
        return self

    def _whole(self, message: str) -> str:
        """The message with what it begins with."""
        return message if self.subject is None else f"{self.subject}: {message}"


class InputError(SynctrlError, ValueError):
    """A value given by the caller has the wrong type, shape, sign, or is not finite."""


class RobotError(SynctrlError):
    """A robot description is missing, refused, or inconsistent.

    Its `subject` is the link, joint or element at fault, for example "joint 'elbow', limit". If a file is at
    fault the message begins with the file and the line.
    """

    def _whole(self, message: str) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        message = super()._whole(message)
        return message if place is None else f"{place}: {message}"


class RobotWarning(UserWarning):
    """A robot description with an oddity that is harmless, or that was repaired as the message says."""


class FrameNotFound(RobotError):
    """A frame that a robot does not have.

    Attributes:
        robot: its name.
        frame: the name asked for.
        available: the names there are.
    """

    def __init__(self, robot: str, frame: str, available: Iterable[str]):
        self.robot, self.frame, self.available = robot, frame, tuple(available)
        there = (name if name.isprintable() else ascii(name) for name in self.available)
        super().__init__(
            f"robot '{robot}' has no frame '{frame}'{near(frame, self.available)}; "
            f"its frames are: {', '.join(there)}"
        )


class CouplingError(SynctrlError):
    """A coupling that cannot synchronize: no inverse of a weight, a disconnected graph, ..."""


class CouplingWarning(UserWarning):
    """A coupling for which the theorem holds, but which does not do what its name suggests."""


class SynchronizationError(CouplingError):
    """A synchronization function outside the theorem, or not satisfied by the desired motion."""


class TrajectoryError(SynctrlError):
    """A desired motion that is malformed."""


class UnreachableError(TrajectoryError):
    """A desired position outside the workspace of its robot."""


class SimulationError(SynctrlError):
    """A run that had to stop.

    Attributes:
        result: a `Result` with everything computed until then, or None if nothing was.
        time: simulated time of the failure, in s.
        robot: index of the robot concerned, counted from 0, or None.
        joint: index of its joint, counted from 0, or None if it is not about one.
        cause: why, as one word: "disturbance", "step", "period", "Lambda", "beta", "K_r", "K_eps", "Gamma",
            "friction", "network", "start", "singular", "orientation", "unstable"; "motion", "weights" or
            "part" where what a user wrote gives no finite numbers; None if it is of another kind.
    """

    def __init__(
        self,
        message: str,
        *,
        time: float | None = None,
        robot: int | None = None,
        result: Any = None,
        joint: int | None = None,
        cause: str | None = None,
    ):
        self.time, self.robot, self.result = time, robot, result
        self.joint, self.cause = joint, cause
        super().__init__(message)


class NonFiniteError(SimulationError):
    """The state became infinite or not a number, or the closed loop was running away to there."""


class SingularJacobianError(SimulationError):
    """A robot met a singular configuration in Cartesian control; `found` is the condition number, or None."""


class OrientationError(SimulationError):
    """An orientation error, `found` in rad, close to half a turn, where its direction is not defined."""


class RunInterrupted(Portable, KeyboardInterrupt):
    """A run that was interrupted, for example by Ctrl-C.

    Attributes:
        result: a `Result` with everything computed until then.
        time: simulated time of the last instant reached, s.
    """

    def __init__(self, message: str, *, time: float | None = None, result: Any = None):
        self.time, self.result = time, result
        super().__init__(message)


class GainWarning(UserWarning):
    """Gains that cannot do what was asked of them, or that ask for more than a robot has."""


class LimitWarning(UserWarning):
    """Joint positions outside the range that a robot's description states."""


class SaturationWarning(UserWarning):
    """Torque was cut off at its limits, while the controller adapted and integrated as if it were not."""


class StepWarning(UserWarning):
    """A run whose step was too long: its own estimate of the error is above what is trusted."""


class ResultError(SynctrlError):
    """A file of results that is missing, damaged, of another kind, or that cannot be written."""


class SweepError(SynctrlError):
    """A sweep that cannot go on; runs that were finished are kept."""


class SweepFileError(SweepError, ResultError):
    """A line in the folder of a sweep that cannot be of that sweep; `file` and `line` say which."""


class CompilationError(SynctrlError):
    """Generated code that could not be compiled, kept, or trusted."""


class MissingDependencyError(SynctrlError, ImportError):
    """An optional package is needed for what was asked."""


def warn(message: str, category: type[Warning]) -> None:
    """Warn whoever called the package: the warning has the nearest line on the stack that is outside of it.

    Args:
        message: what is odd, where, and what to do.
        category: kind of the warning.
    """
    package, level = __name__.partition(".")[0], 1
    frame: FrameType | None = sys._getframe()
    while frame is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level - (frame is None))


def failed(what: str, t: float, error: Exception, robot: int | None = None) -> SimulationError:
    """The error of a run in which a function of the user's raised an exception.

    Args:
        what: whose function it is, for example "the desired motion of robot 2".
        t: simulated time, s.
        error: what it raised.
        robot: index of the robot concerned, counted from 0, or None.
    """
    message = f"{what} failed at t = {t:g} s with {type(error).__name__}: {error}"
    return SimulationError(message, time=t, robot=robot).about(what, found=type(error).__name__)


def _remade(kind: type[BaseException], args: tuple) -> BaseException:
    """An exception of a kind that is told its message only; its attributes are set afterwards."""
    error = kind.__new__(kind, *args)
    builtin = next(base for base in kind.__mro__ if base.__module__ == "builtins")
    builtin.__init__(error, *args)  # type: ignore[misc]
    return error


def plain_data(value: Any, depth: int = 8) -> Any:
    """`value` as data that hold nothing of the caller's: a number, a text, None, or a tuple of them.

    Arrays and lists become tuples. Of anything else, and below this depth, only the name of its type is left.
    """
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, (list, tuple)) and depth:
        return tuple(plain_data(each, depth - 1) for each in value)
    return value if value is None or isinstance(value, (int, float, complex, str)) else type(value).__name__


def near(name: str, known: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"` when a known name resembles `name`, else an empty string."""
    matches = get_close_matches(name, list(known), n=3)
    return f" (did you mean {' or '.join(repr(m) for m in matches)}?)" if matches else ""
