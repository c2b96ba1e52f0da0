"""Engines: what takes a planned run through time, by name in one table, or a user's own.

An engine of one's own is an object with `refuses` and `run`. If it makes steps of its own, a `Solver` is all
that it needs: `run.samples(solver)` carries it through time and events, and `collect` of run.py watches and
logs. Others find the closed loop in `run.loop`, instants in `run.clock` and pushes in `run.schedule`, and
give `collect` samples of their own making.
"""

from __future__ import annotations

from typing import Protocol

from ..checks import choice
from ..errors import InputError
from .handover import Progress
from .result import Result
from .run import Run, run_compiled, run_reference


class Engine(Protocol):
    """A way through time with fixed steps."""

    def refuses(self, run: Run) -> str | None:
        """Why this engine cannot make a run, or None if it can."""

    def run(self, run: Run, progress: Progress | None) -> Result:
        """Make it.

        Args:
            run: what is to be done, already checked.
            progress: called now and then with the time reached, s, or None.

        Raises:
            SimulationError: the run had to stop; it carries what was computed.
        """


class Reference:
    """The equations as they are written, on Pinocchio's algorithms."""

    def refuses(self, run: Run) -> str | None:
        return None

    def run(self, run: Run, progress: Progress | None) -> Result:
        return run_reference(run, progress)


class Compiled:
    """The same closed loop as generated C."""

    def refuses(self, run: Run) -> str | None:
        from .compiled.known import check_known

        try:
            check_known(run.loop)
        except InputError as error:
            return str(error)
        return None

    def run(self, run: Run, progress: Progress | None) -> Result:
        return run_compiled(run, progress)


#: the engines that have a name
ENGINES: dict[str, Engine] = {"pinocchio": Reference(), "compiled": Compiled()}


def find_engine(engine: str | Engine) -> Engine:
    """An engine by its name, or the one given.

    Raises:
        InputError: an unknown name, or something that is no engine.
    """
    if isinstance(engine, str):
        return ENGINES[choice("engine", engine, tuple(ENGINES))]
    if isinstance(engine, type) or not all(callable(getattr(engine, m, None)) for m in ("refuses", "run")):
        known = ", ".join(map(repr, ENGINES))
        raise InputError(f"engine: expected one of {known}, or an engine of your own, found {engine!r}")
    return engine
