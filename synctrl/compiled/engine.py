"""The compiled engine: blocks of steps through the library, and the same Result as the reference."""

from __future__ import annotations

import ctypes
from time import perf_counter

import numpy as np

from ..control.measured import check_network
from ..renamed import names_elsewhere
from ..simulation.engines import Run, before_the_start, finish
from ..simulation.guard import Alarm, Progress, report_time, stopped
from ..simulation.recorder import Recorder
from ..simulation.result import Result
from . import structs
from .agenda import Agenda
from .hooks import Hooks
from .known import check_known
from .lanes import aligned
from .program import Program
from .quantities import LOGS
from .report import Ending, Worst
from .stepper import Pace, Stepper, found_check
from .structs import Mark
from .tables import DesiredStretch, Tables, blocks


class Compiled:
    """The closed loop as generated C, as one engine among others.

    Args:
        libraries: what earlier runs have loaded, by what it was made for.
        tables: what was desired in earlier runs.
        widest: most lanes in which robots stand; by default what the machine has.
    """

    def __init__(
        self,
        libraries: dict[str, ctypes.CDLL] | None = None,
        tables: Tables | None = None,
        widest: int | None = None,
    ):
        self._libraries, self._blocks = libraries, blocks if tables is None else tables.blocks
        self._widest = widest

    def refuses(self, run: Run) -> None:
        """See `Engine`.

        Raises:
            InputError: the closed loop cannot be generated; it has what and why. Or sampled control with a
                network in continuous time.
        """
        check_known(run.loop)
        if run.every is not None:
            check_network(run.loop.controller.network, run.loop.messages, run.info["control_period"])

    def load(self, run: Run) -> Program:
        """The program of a run, found or built.

        Raises:
            see `Program`
        """
        return Program(run.loop, self._libraries, self._widest)

    def run(self, run: Run, progress: Progress | None = None) -> Result:
        """Make a run; see `Engine`."""
        run.info["engine"] = "compiled"
        recorder = run.recorder()
        with before_the_start(run):
            program = self.load(run)

        def log() -> None:
            steps, pace = _Steps(program, run, recorder), Pace()
            try:
                for block in self._blocks(program, run.clock):
                    for first, last in pace.parts(len(block.steps.starts)):
                        start = perf_counter()
                        steps.advance(block, first, last)
                        pace.learn(last - first, perf_counter() - start)
                        recorder.reached = float(block.steps.times[last])
                        report_time(progress, recorder.reached)
                steps.finish()
            finally:
                steps.hand_over()

        return finish(run, recorder, log)


class _Steps(Stepper):
    """Steps of one run, with what its recorder keeps and what its agenda and its devices do.

    Where robots stand in lanes the state stays there from one call of the library to the next; the recorder's
    follows when it is asked for.
    """

    def __init__(self, program: Program, run: Run, recorder: Recorder):
        super().__init__(program, run)
        self._recorder, self._worst = recorder, Worst(program, run.loop.cell.v0)
        recorder.state = aligned(recorder.state)
        self._state, self._agenda = run.loop.state(recorder.state), Agenda(program, run)
        self._report = Ending(1)
        self._hooks = Hooks(run, program.quantities, self.steps, self._state, self._agenda)
        self._logs = [name for name in LOGS if recorder.address_ahead(name) is not None]
        self._apart = program.lanes.width > 1
        self._y = self._taken_up()

    def advance(self, block: DesiredStretch, first: int, last: int) -> None:
        """Make some steps of a block; what is on the agenda comes between two calls of the library."""
        starts, middles = block.steps.starts, block.steps.middles
        while first < last:
            self._meet(float(starts[first]), float(middles[first]))
            end = first + max(1, int(np.searchsorted(middles[first:last], self._agenda.ahead)))
            self.look_at(block)
            self.call(first, end)
            first = end

    def finish(self) -> None:
        """Log the end of the run."""
        end = self.run.clock.end
        if self.run.every is None or self.run.clock.sampled_at_end(self.run.every):
            self.hand_over()
            self._agenda.tell(end, end, self._state)
            self._y = self._taken_up()
        self.look_at_end()
        self.call(0, 1)

    def hand_over(self) -> None:
        """Let the recorder have the state, and the run know of its worst step."""
        if self._apart:
            self.program.unpacked_state(self._y, self._recorder.state)
        self.run.step_error.note(*self._worst.of_all())

    # -- internals ----------------------------------------------------------------------------------------

    def _taken_up(self) -> np.ndarray:
        """The recorder's state, in lanes."""
        state = self._recorder.state
        return self.program.packed_state(state) if self._apart else state

    def _meet(self, start: float, middle: float) -> None:
        """Let what is on the agenda of a step move the state."""
        if self._agenda.ahead == np.inf:
            return
        self.hand_over()
        self._agenda.meet(start, middle, self._state)
        self._y = self._taken_up()

    def _made(self, times: np.ndarray, marks: np.ndarray) -> None:
        """Call the library; keep what it has logged, and see how it ended."""
        program, recorder, report = self.program, self._recorder, self._report.fresh()
        log = structs.Log(**{name: recorder.address_ahead(name) for name in self._logs})
        try:
            program.call("advance", self.steps, self._y, log, report)
        finally:  # an interrupt that came meanwhile is raised before the call has returned
            recorder.advance(times[:-1][marks & Mark.LOGGED > 0][: report.rows])
        self._hooks.fail()
        status, step, robot, value = (part[0] for part in self._report.found)
        if status:
            self.hand_over()
            alarm = Alarm(found_check(program.loop, int(status)), int(robot), float(value))
            raise stopped(program.loop, float(times[step]), recorder.state, recorder.last("v"), alarm)


__getattr__ = names_elsewhere(__name__, ".engine", Block="DesiredStretch")
