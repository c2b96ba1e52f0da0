"""The compiled engine as one among others."""

from __future__ import annotations

from ctypes import CDLL

from ..errors import InputError
from ..simulation.engines import Run, before_the_start, finish
from ..simulation.guard import Progress
from ..simulation.recorder import Recorder
from ..simulation.result import Result
from .engine import Tables, advance
from .known import check_known
from .program import Program


class Compiled:
    """The closed loop as generated C.

    Args:
        libraries: what earlier runs have loaded, by what it was made for.
        tables: what was desired in earlier runs.
    """

    def __init__(self, libraries: dict[str, CDLL] | None = None, tables: Tables | None = None):
        self._libraries, self._tables = libraries, tables

    def refuses(self, run: Run) -> str | None:
        """Why the closed loop cannot be generated, or None if it can."""
        try:
            check_known(run.loop)
        except InputError as error:
            return str(error)
        return None

    def load(self, run: Run) -> Program:
        """The program of a run, found or built.

        Raises:
            see `Program`
        """
        return Program(run.loop, self._libraries)

    def run(self, run: Run, progress: Progress | None = None) -> Result:
        """Make a run; see `Engine`."""
        run.info["engine"] = "compiled"
        recorder = Recorder(run.loop, run.clock)
        with before_the_start(run):
            program = self.load(run)

        def log() -> None:
            plan = program, run.clock, run.schedule, recorder
            advance(*plan, run.step_error, run.every, progress, self._tables)

        return finish(run, recorder, log)
