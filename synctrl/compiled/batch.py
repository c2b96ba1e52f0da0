"""Runs of one experiment side by side: a run per lane, with measures taken on the way instead of a log.

All runs share robots, coupling, desired motion, instants and what happens at them; what differs is numbers:
gains, parameters, the start. Such numbers are given as columns, an array per quantity with a row per run. A
run that ends before its time leaves the others alone. What is measured of a run does not depend on who is
beside it, nor on how many lanes there are.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from time import perf_counter

import numpy as np

from ..errors import InputError
from ..simulation.engines import Run
from . import processor, structs
from .arrays import CompiledLoop
from .kind import classify
from .known import check_known
from .lanes import room, state_parts
from .measured import Measured as Measured
from .measured import Seen, joined
from .own import Value, own_library
from .program import library_for
from .quantities import QUANTITIES, shape
from .report import Ending, Worst
from .stepper import Pace, Stepper, Told
from .structs import Mark
from .tables import DesiredStretch, Tables


class Batch:
    """Makes runs that differ from a planned one in numbers alone.

    Args:
        run: the planned one.
        bands: settling bands by kind of error, one for all coordinates or (m,).
        libraries: libraries that are loaded already, by what they were made for.
        width: number of lanes; by default as many as the machine has.
        own: further measures: functions of an `Instant` that give one number, and can be traced.

    Raises:
        InputError: a measure that cannot be traced; the closed loop cannot be generated, or Python has to be
            asked in the middle of a run: of messages, sensors, actuators or events.
        MissingDependencyError, CompilationError: see `Program`.
    """

    def __init__(
        self,
        run: Run,
        bands: Mapping[str, float | np.ndarray],
        libraries: dict[str, ctypes.CDLL] | None = None,
        width: int | None = None,
        own: Sequence[Value] = (),
    ):
        check_known(run.loop)
        _check_alone(run)
        classified, known = classify(run.loop), {} if libraries is None else libraries
        lanes = processor.widest() if width is None else width
        library = library_for(run.loop, classified, known, lanes)
        self._run, self._program = run, CompiledLoop(run.loop, classified, library)
        self._side = _Side(self._program, run, bands, len(own))
        if own:
            self._own = own_library(own, classified.kinds, self._program.sizes, lanes)
            self._side.count_up(self._own)

    def measure(self, columns: Mapping[str, np.ndarray], count: int) -> Measured:
        """Make some runs.

        Args:
            columns: what differs from the planned run, by names of quantities: constants of the cell, "q",
                "v", "z" and "memory" at the start, (count, rows, columns); "disturbance", (count, windows,
                rows, columns); and "pi", true inertial parameters, (count, windows, n, 10 bodies).
            count: number of runs.

        Raises:
            InputError: something that no run has a column for, or an array of another shape.
        """
        arrays = {name: self._checked(name, array, count) for name, array in columns.items()}
        width, parts = self._program.lanes.width, list[Seen]()
        for first in range(0, count, width):
            chosen = np.minimum(np.arange(first, first + width), count - 1)
            self._side.begin()
            for name, array in arrays.items():
                self._side.put(name, np.moveaxis(array[chosen], 0, -1))
            parts.append(self._side.made())
        return joined(parts, count)

    # -- internals ----------------------------------------------------------------------------------------

    def _checked(self, name: str, array: np.ndarray, count: int) -> np.ndarray:
        """A column of the right shape."""
        if name not in QUANTITIES or QUANTITIES[name].owner not in ("cell", "state", "load", "disturbance"):
            raise InputError.expected("a quantity that runs have from their start", name, "columns")
        expected: tuple[int, ...] = shape(name, self._program.sizes)
        if name == "pi":
            expected = self._program.parameters.shape
        elif name == "disturbance":
            expected = (len(self._run.schedule.torques), *expected)
        found = np.asarray(array, dtype=float)
        if found.shape != (count, *expected):
            raise InputError.expected(f"shape {(count, *expected)}", found.shape, f"columns, {name}")
        return self._program.lumped(found) if name == "pi" else found


class _Side(Stepper):
    """Runs in the lanes of the library, from their start to their end; then others, with the same memory."""

    def __init__(self, program: CompiledLoop, run: Run, bands: Mapping, own: int):
        super().__init__(program, run)
        self._tables, self._pace = Tables(), Pace()
        self._y, self._ending = program.packed_state(run.loop.initial_state()), Ending(program.lanes.width)
        self._worst, self._logged = Worst(program, run.loop.cell.v0), list[np.ndarray]()
        self._stop = np.zeros(program.lanes.width)
        self._tally, self._kept = _tally(program, bands, own)
        self.steps.tally = ctypes.addressof(self._tally)
        self._known: dict[int, Told] = {}
        self._start = self._y.copy(), {name: array.copy() for name, array in self._kept.items()}

    def count_up(self, library: ctypes.CDLL) -> None:
        """Have the measures of a library counted up too."""
        self._tally.own = ctypes.cast(library.own, ctypes.c_void_p).value

    def begin(self) -> None:
        """Go back to the start, with the numbers of the planned run."""
        self.program.reset()
        self.say_what_acts()
        self._y[...], kept = self._start
        for name, array in kept.items():
            self._kept[name][...] = array
        self._ending.begin()
        self._worst.begin()
        self._stop[:], self._tally.rows, self._logged = 0, 0, []

    def put(self, name: str, array: np.ndarray) -> None:
        """Let runs have their own values of a quantity, (..., rows, columns, lanes)."""
        owner = QUANTITIES[name].owner
        if owner == "cell":
            self.program.put(name, array)
        elif owner == "state":
            self._place(name)[...] = array.reshape(-1, array.shape[-1])
            if name == "v":
                self._worst.speed[:] = np.abs(array).max(axis=(0, 1), initial=0.0)
        else:
            self.program.tell_apart(self.steps, name, array)

    def made(self) -> Seen:
        """Make the runs."""
        for block in self._tables.blocks(self.program, self.run.clock):
            self.look_at(block)
            for first, last in self._pace.parts(len(block.steps.starts)):
                start = perf_counter()
                self.call(first, last)
                self._pace.learn(last - first, perf_counter() - start)
            if self._ending.all:
                return self._seen()
        self.look_at_end()
        self.call(0, 1)
        return self._seen()

    # -- internals ----------------------------------------------------------------------------------------

    def _read(self, block: DesiredStretch) -> Told:
        """See `Stepper`; of a block that is kept for all runs once."""
        if not self._tables.keeps(self.program, self.run.clock):
            return super()._read(block)
        first = block.steps.first  # a block that was made anew, after runs that ended early, is the same one
        if first not in self._known:
            self._known[first] = super()._read(block)
        return self._known[first]

    def _made(self, times: np.ndarray, marks: np.ndarray) -> None:
        if self._ending.all:
            return
        before = self._ending.found[0] != 0
        self.program.call("advance", self.steps, self._y, structs.Log(), self._ending.fresh())
        status, at, *_ = self._ending.found
        new = (status != 0) & ~before
        self._stop[new] = times[at[new]]
        self._logged.append(times[:-1][marks & Mark.LOGGED > 0])

    def _place(self, name: str) -> np.ndarray:
        """The part of the state that is a quantity, (numbers, lanes)."""
        begin, y = 0, self._y.reshape(-1, self.program.lanes.width)
        for part, rows, length in state_parts(self.program.sizes, len(y)):
            if part == name:
                return y[begin : begin + rows * length]
            begin += rows * length
        raise InputError.expected("a part of the state", name, "columns")

    def _seen(self) -> Seen:
        status, _, robot, value = self._ending.found
        worst, lanes = self._worst, np.arange(len(status))
        return Seen(
            times=np.concatenate(self._logged),
            instants=self._tally.rows,
            ended=np.stack((status, robot, self._stop, value)),
            worst=np.stack((worst.largest, worst.speed, worst.time, worst.joint(lanes))),
            tally={name: array.copy() for name, array in self._kept.items()},
        )


def _check_alone(run: Run) -> None:
    """Refuse a run in which Python is asked between two steps."""
    loop = run.loop
    asked = {
        "messages between robots": len(loop.messages.between(0.0, run.clock.end)) > 0,
        "sensors or actuators": bool(loop.devices.settings),
        "a plant with events": len(loop.events) > 0,
    }
    for what in (what for what, found in asked.items() if found):
        raise InputError(
            f"runs side by side do not have {what}; make them one by one", subject="batch", found=what
        )


def _tally(program: CompiledLoop, bands: Mapping, own: int) -> tuple[structs.Tally, dict[str, np.ndarray]]:
    """What the library counts up, and the arrays by name."""
    sizes, width = program.sizes, program.lanes.width
    rows = {"tracking": ("n", "m"), "sync": ("p", "m"), "torque": ("n", "nv")}
    kept = {
        f"{kind} {name}": room(sizes[count], sizes[length], width)
        for kind, (count, length) in rows.items()
        for name in (("torque", "cut") if kind == "torque" else ("peak", "ise", "final", "outside", "square"))
    }
    for kind in ("tracking", "sync"):
        band = room(sizes["m"], width)
        band[...] = np.broadcast_to(np.asarray(bands[f"{kind}_error"], dtype=float), (sizes["m"],))[:, None]
        kept[f"{kind} band"] = band
        kept[f"{kind} outside"][...] = -1
    errors = [
        structs.Errors(**{name: kept[f"{kind} {name}"].ctypes.data for name, *_ in structs.Errors._fields_})
        for kind in ("tracking", "sync")
    ]
    torque = {name: kept[f"torque {name}"].ctypes.data for name in ("torque", "cut")}
    names = "now", "before", "largest", "integral"
    kept |= {f"own {name}": room(own, width) for name in names}
    kept["own largest"][...] = -np.inf
    numbers = {name: kept[f"own {name}"].ctypes.data for name in names}
    return structs.Tally(*errors, **torque, **numbers, count=own), kept
