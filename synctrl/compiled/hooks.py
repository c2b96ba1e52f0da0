"""Sensors and actuators of a compiled run: the library calls Python back in the middle of its steps.

They are the objects that the reference engine uses, with their state, so what they draw, count and remember
is the same. What goes on between samples, lag and ripple, is computed in C.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from ..simulation.closed_loop import State
from ..simulation.engines import Run
from .address import Callback
from .agenda import Agenda
from .structs import Quantities, Steps


class Hooks:
    """What the library calls, and the arrays through which it is told.

    Args:
        run: the run, whose devices these are.
        quantities: of the program, which get arrays that live as long as this object.
        steps: which get what is to be called.
        state: of the loop, which the library carries on.
        agenda: of the run, whose messages say what sensors measure, if there are any.
    """

    def __init__(self, run: Run, quantities: Quantities, steps: Steps, state: State, agenda: Agenda):
        self._agenda = agenda
        self._devices, self._plant, self._state = run.devices, run.loop.plant, state
        self._failure: BaseException | None = None
        self._kept: list[object] = []
        self._quantities = quantities
        if self._devices.senses:
            for name in ("measured_q", "measured_v"):
                self._share(name, self._devices.readings[name])
            steps.sense = self._called(self._sense)
        if self._devices.drive is not None:
            self._drive = self._devices.drive
            self._acting, self._goal, self._owed = np.zeros((3, *state.q.shape))
            self._switched, (share, *wave) = np.zeros(1), self._drive.ripple
            shared = {"acting": self._acting, "goal": self._goal, "owed": self._owed, "ripple": share}
            shared |= {"switched": self._switched, "lag": self._drive.rate, "ripple_wave": np.array(wave)}
            for name, array in shared.items():
                self._share(name, array)
            steps.act = self._called(self._act)

    def fail(self) -> None:
        """Raise what went wrong in Python while the library called it, if anything did."""
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    # -- internals ----------------------------------------------------------------------------------------

    def _sense(self, t: float, middle: float, sampled: int) -> None:
        """Let sensors measure, and messages tell of it; what is read are arrays that the library knows."""
        self._agenda.hear(t, t, self._devices.measure(self._state.motion), self._state.memory)

    def _act(self, t: float, middle: float, sampled: int) -> None:
        """Let actuators act on what is asked for, and take the goals that are due in a step."""
        drive = self._drive
        if sampled:
            drive.command(t, np.array(self._plant.applied(self._acting)))
        drive.reach(middle)
        self._goal[...], self._owed[...], self._switched[...] = drive.goal, drive.owed, drive.since

    def _share(self, name: str, array: np.ndarray) -> None:
        """Let an array be that of a quantity."""
        self._kept.append(array)
        setattr(self._quantities, name, array.ctypes.data)

    def _called(self, function: Callable[[float, float, int], None]) -> int | None:
        """The address of a function for the library, whose errors are kept: they cannot go through C."""

        def guarded(t: float, middle: float, sampled: int) -> int:
            try:
                function(t, middle, sampled)
            except BaseException as failure:  # an interrupt too
                self._failure = failure
            return int(self._failure is not None)

        callback = Callback(guarded)
        self._kept.append(callback)
        return ctypes.cast(callback, ctypes.c_void_p).value
