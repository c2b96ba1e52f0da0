"""What comes between two calls of the library: events of the plant, and messages of the network."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..simulation.advance import due
from ..simulation.closed_loop import State
from ..simulation.engines import Run
from .program import Program


class Agenda:
    """Instants of a run at which Python moves the state, in order; see `advance` of the simulation.

    Args:
        program: told what hands hold the object after an event.
        run: the run.
    """

    def __init__(self, program: Program, run: Run):
        self._program, self._loop, self._senses = program, run.loop, run.devices.senses
        self._events = deque(sorted(t for t in run.loop.events.tolist() if t >= 0))
        times, arrivals = _messages(run)
        self._times, self._arrivals = deque(times), deque(arrivals)

    @property
    def ahead(self) -> float:
        """The next of them, s; infinite if none is left."""
        return min(queue[0] if queue else np.inf for queue in (self._events, self._arrivals))

    def meet(self, t: float, middle: float, state: State) -> None:
        """Let everything move the state that is due in a step.

        Args:
            t, middle: when the step begins, and its middle, s.
            state: where the run has come.
        """
        for event in due(self._events, middle):
            self._loop.at(middle).meet(event, state)
            self._program.hold(state.hidden)
        self.tell(t, middle, state)

    def tell(self, t: float, middle: float, state: State) -> None:
        """Let messages arrive that tell of a state; what sensors measure is told where they do."""
        if not self._senses:
            self.hear(t, middle, state.motion, state.memory)

    def hear(self, t: float, middle: float, motion: np.ndarray, memory: np.ndarray) -> None:
        """Let messages that are due in a step tell of a motion, (2, n, nv), and change what is remembered."""
        messages = [self._times.popleft() for _ in due(self._arrivals, middle)]
        if messages:
            reference = self._loop.cell.references(np.array([t]))[0]
            memory[...] = self._loop.messages.received(messages, reference, motion, memory)


def _messages(run: Run) -> tuple[list[float], list[float]]:
    """When the messages of a run are due, and at which instants they arrive, s."""
    messages, clock, every = run.loop.messages, run.clock, run.every
    if every is None:
        times = messages.between(0.0, clock.end)
        return times, times
    ends = messages.end(np.arange(clock.count // every + 1), float(run.info["control_period"]))
    times = messages.between(0.0, float(ends[-1]))
    samples = np.searchsorted(ends, times, side="right")
    return times, clock.grid(every * samples).tolist()
