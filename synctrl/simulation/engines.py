"""Engines: what takes a planned run through time, by name in one table, or a user's own.

An engine of one's own is an object with `refuses` and `run`. If it makes steps of its own, a `Solver` is all
that it needs: `run.samples(solver)` carries it through time and events, and `collect` of run.py watches and
logs. Others find the closed loop in `run.loop`, instants in `run.clock` and pushes in `run.schedule`, and
give `collect` samples of their own making.
"""

from __future__ import annotations

from importlib import import_module
from typing import Protocol

from ..checks import choice
from ..errors import InputError
from .handover import Progress
from .result import Result
from .run import Run, run_reference


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


#: the engines that have a name: their module and class, which is imported when it is asked for
ENGINES = {
    "pinocchio": ("synctrl.simulation.engines", "Reference"),
    "compiled": ("synctrl.compiled.engine", "Compiled"),
}


def find_engine(engine: str | Engine) -> Engine:
    """An engine by its name, or the one given.

    Raises:
        InputError: an unknown name, or something that is no engine.
    """
    if isinstance(engine, str):
        module, kind = ENGINES[choice("engine", engine, tuple(ENGINES))]
        return getattr(import_module(module), kind)()
    if isinstance(engine, type) or not all(callable(getattr(engine, m, None)) for m in ("refuses", "run")):
        known = ", ".join(map(repr, ENGINES))
        raise InputError(
            f"expected one of {known}, or an engine of your own, found {engine!r}", subject="engine"
        )
    return engine
