"""Every error this package raises on purpose.

Each message says what was wrong, where, what was found and what is expected. All kinds derive from
`SynctrlError`, so one `except` clause catches whatever the package has to say about its input.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any


class SynctrlError(Exception):
    """Base of all errors raised by synctrl."""


class InputError(SynctrlError, ValueError):
    """A value given by the caller has the wrong type, shape, sign, or is not finite."""


class RobotError(SynctrlError):
    """A robot description is missing, refused, or inconsistent."""


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
        super().__init__(
            f"robot '{robot}' has no frame '{frame}'{near(frame, self.available)}; "
            f"its frames are: {', '.join(self.available)}"
        )

    def __reduce__(self) -> tuple:
        """Other processes make it from its parts, not from its message."""
        return type(self), (self.robot, self.frame, self.available)


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
            "friction", "start", "singular", "orientation", "unstable"; None if it is of another kind.
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
    """A robot met a singular configuration in Cartesian control."""


class OrientationError(SimulationError):
    """An orientation error close to half a turn, where its direction is not defined."""


class StepWarning(UserWarning):
    """A run whose step was too long: its own estimate of the error is above what is trusted."""


class ResultError(SynctrlError):
    """A result file that is missing, damaged, or of another kind."""


class SweepError(SynctrlError):
    """A sweep that cannot go on; runs that were finished are kept."""


class CompilationError(SynctrlError):
    """Generated code that could not be compiled, kept, or trusted."""


class MissingDependencyError(SynctrlError, ImportError):
    """An optional package is needed for what was asked."""


def near(name: str, known: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"` when a known name resembles `name`, else an empty string."""
    matches = get_close_matches(name, list(known), n=3)
    return f" (did you mean {' or '.join(repr(m) for m in matches)}?)" if matches else ""
