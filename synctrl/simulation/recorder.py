"""Collects the instants of a run into the arrays of a Result, with what the plant says of its own state.

A plant of a user's own may carry a state through a run that nobody else understands, see `Plant`. At the end
of the run its methods `report` and `outputs` say what became of it. Both are code of the user's, so what they
give is checked here before it gets into a `Result`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..checks import printable
from ..errors import InputError
from ..renamed import names_elsewhere
from .advance import Sample
from .clock import Clock
from .closed_loop import ClosedLoop, State
from .description import describe_run, sizes
from .devices.fitted import DRIVEN, MEASURED, ROLES, LiveDevices
from .limits import APPLIED, DampingLog, applied_output, limit_report, saturation_report
from .memory import check_fits
from .plant import Output
from .result import LAYOUT, Result


class Account(NamedTuple):
    """What a plant adds to a result: entries of `info`, and outputs by name."""

    report: Mapping[str, Any]
    outputs: Mapping[str, Output]


#: of a plant that has nothing to say
NOTHING = Account({}, {})


class Recorder:
    """Arrays for all logged instants of a run; the system gives memory to those that are filled.

    Args:
        loop: the closed loop.
        clock: its instants.
        devices: sensors and actuators, which tell what they read.

    Attributes:
        count: how many instants are logged.
        reached: the last instant at which all was well, s.
        state: flat state that the run has come to.

    Raises:
        InputError: the log does not fit into memory.
    """

    def __init__(self, loop: ClosedLoop, clock: Clock, devices: LiveDevices):
        self._loop, self._devices, instants = loop, devices, clock.rows
        lengths = {"time": instants, **sizes(loop)}
        shapes = {name: [lengths[d] for d in dimensions] for name, (dimensions, _) in LAYOUT.items()}
        shapes |= {name: [instants, *shape] for name, shape in own_states(loop).items()}
        shapes |= {name: [instants, *reading.shape] for name, reading in devices.readings.items()}
        numbers = sum(int(np.prod(shape[1:])) for shape in shapes.values())
        check_fits(clock, 8 * numbers)
        self._arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
        self._damping = DampingLog(instants, loop.cell.n)
        self.count, self.reached, self.state = 0, 0.0, loop.initial_state()

    def add(self, sample: Sample) -> None:
        """Log one instant."""
        state = self._loop.state(sample.y)
        integral = self._loop.controller.network.integral(state.memory)
        readings = self._devices.readings
        for name, array in self._arrays.items():
            read = readings[name] if name in readings else ROW[name](sample, state, integral)
            array[self.count] = read
        self._damping.add(self.count, sample.signals)
        self.count += 1

    def address_ahead(self, name: str) -> int | None:
        """Where the part of an array begins that is not logged yet; None if there is no such array."""
        array = self._damping.arrays.get(name, self._arrays.get(name))
        return None if array is None else array[self.count :].ctypes.data

    def advance(self, times: np.ndarray) -> None:
        """Count rows that were filled from outside."""
        self._arrays["t"][self.count : self.count + len(times)] = times
        self.count += len(times)

    def last(self, name: str) -> np.ndarray:
        """An array at the last instant that was logged; zeros if there is none."""
        array = self._arrays[name]
        return array[self.count - 1] if self.count else np.zeros(array.shape[1:])

    def logged(self) -> dict[str, np.ndarray]:
        """What was logged until now, by name."""
        return {name: array[: self.count] for name, array in self._arrays.items()}

    def account(self, info: Mapping[str, Any]) -> Account:
        """What plant and network say of their states until now, under names that nobody else has.

        Raises:
            InputError: something else than entries by name, a name that is taken, or an output that is no
                array with a unit and one axis per dimension, time first.
            Exception: what the plant raises.
        """
        loop, logged = self._loop, self.logged()
        lengths = {"time": self.count, **sizes(loop)}
        taken = {*info, *self._described, *LAYOUT, *_STATE_AXES, *OF_EVERY_RUN}
        told = {name: array for name, (array, _, _) in self._learned(logged).items()}
        network, plant = loop.controller.network, loop.plant
        heard = network.account(logged) if hasattr(network, "account") else {}
        _check_outputs(f"network {type(network).__qualname__}, outputs", heard, taken, lengths)
        found = Account(*plant.account({PLANT_STATE: np.zeros((self.count, 0)), **logged, **told}))
        where, taken = f"plant {type(plant).__qualname__}", {*taken, *heard}
        _check_names(f"{where}, report", found.report, taken)
        _check_outputs(f"{where}, outputs", found.outputs, taken, lengths)
        return Account(found.report, {**heard, **found.outputs})

    def result(
        self, status: str, info: Mapping[str, Any], experiment: Any, account: Account = NOTHING
    ) -> Result:
        """What was logged until now, with what the plant says of it."""
        arrays = {name: _taken(array, self.count) for name, array in self._arrays.items()}
        states = {name: arrays.pop(name) for name in own_states(self._loop)}
        read = {name: arrays.pop(name) for name in self._devices.readings}
        described = {"status": printable(status), **self._described, **info}
        described["damping"] = self._damping.report(arrays["t"])
        seen = (arrays[name] for name in ("t", "q", "v", "tau"))
        described["limits"] = limit_report(self._loop.cell, *seen)
        plant = self._loop.plant
        described.update(account.report)
        described["saturation"] = saturation_report(plant, arrays)
        found = {name: (array, "SI", _STATE_AXES[name]) for name, array in states.items()}
        found |= {**self._learned(states), **self._devices.outputs(self._loop.cell, read)}
        found |= {**applied_output(plant, arrays["tau"]), **account.outputs}
        outputs = {name: array for name, (array, _, _) in found.items()}
        described["outputs"] = {n: {"unit": unit, "axes": list(axes)} for n, (_, unit, axes) in found.items()}
        return Result(**arrays, info=described, outputs=outputs, experiment=experiment)

    @cached_property
    def _described(self) -> dict[str, Any]:
        return describe_run(self._loop)

    def _learned(self, logged: Mapping[str, np.ndarray]) -> dict[str, Output]:
        """What the adaptation says of its states in a log."""
        adaptation = self._loop.controller.adaptation
        return adaptation.outputs(logged[ADAPTATION_STATE]) if hasattr(adaptation, "outputs") else {}


#: outputs that have what an adaptation, a network and a plant have of their own in the state of the loop
ADAPTATION_STATE, NETWORK_STATE, PLANT_STATE = "adaptation_state", "network_state", "plant_state"
#: further names of entries and outputs that a result gets from elsewhere
OF_EVERY_RUN = (
    *("status", "outputs", "damping", "limits", "saturation", "step_error", "run", "format"),
    *(APPLIED, "hedge", "admittance", "phase", "feed", *ROLES, *MEASURED, *DRIVEN),
)
#: how every array is read from a sample and the parts of its state; the last one from int epsilon
ROW: dict[str, Callable[[Sample, State, np.ndarray], Any]] = {
    "t": lambda at, y, _: at.t,
    "x": lambda at, y, _: at.signals.task.motion[0],
    "x_desired": lambda at, y, _: at.signals.reference.desired[0],
    "tracking_error": lambda at, y, _: at.signals.e,
    "sync_error": lambda at, y, _: at.signals.epsilon,
    "sync_integral": lambda at, y, integral: integral,
    "coupled_error": lambda at, y, _: at.signals.e_star,
    "q": lambda at, y, _: y.q,
    "v": lambda at, y, _: y.v,
    "v_error": lambda at, y, _: at.signals.s_q,
    "tau": lambda at, y, _: at.signals.tau,
    "disturbance": lambda at, y, _: at.disturbance,
    "theta_hat": lambda at, y, _: at.signals.theta_hat,
    ADAPTATION_STATE: lambda at, y, _: y.z,
    NETWORK_STATE: lambda at, y, _: y.memory.ravel(),
    PLANT_STATE: lambda at, y, _: y.hidden,
}
_STATE_AXES = {
    ADAPTATION_STATE: ("time", "robot", "state"),
    NETWORK_STATE: ("time", "network state"),
    PLANT_STATE: ("time", "plant state"),
}


def own_states(loop: ClosedLoop) -> dict[str, tuple[int, ...]]:
    """Shapes of the parts of the state that are in no array of `LAYOUT`, under the names of outputs.

    The state of an adaptation that is theta_hat itself is logged as that, and so is the memory of a network
    that is the integrals of epsilon.
    """
    z, adaptation = loop.controller.adaptation.start(), loop.controller.adaptation
    memory, network = loop.controller.network.start(), loop.controller.network
    found = {} if adaptation.estimate(z) is z else {ADAPTATION_STATE: z.shape}
    found |= {} if network.integral(memory) is memory else {NETWORK_STATE: (np.size(memory),)}
    return found | ({PLANT_STATE: loop.plant.hidden0.shape} if loop.plant.hidden0.size else {})


def _taken(array: np.ndarray, count: int) -> np.ndarray:
    """The rows that were logged; a copy only where the array is not all of that."""
    return np.ascontiguousarray(array) if count == len(array) else array[:count].copy()


def _check_names(where: str, entries: Any, taken: Collection[str]) -> None:
    if not isinstance(entries, Mapping):
        raise InputError.expected("entries by name", entries, where, shown=f"{entries!r:.80}")
    for name in entries:
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            text = f"expected names that are not taken, found {name!r:.80}"
            raise InputError(text, subject=where, found=name)


def _check_outputs(where: str, outputs: Any, taken: Collection[str], lengths: Mapping[str, int]) -> None:
    """Outputs by name, of a plant or of a network."""
    _check_names(where, outputs, taken)
    for name, output in outputs.items():
        _check_output(f"{where}, {name}", output, lengths)


def _check_output(where: str, output: Any, lengths: Mapping[str, int]) -> None:
    try:
        array, unit, axes = output
        named = isinstance(unit, str) and axes[0] == "time" and all(isinstance(axis, str) for axis in axes)
        fits = all(lengths.get(axis, k) == k for axis, k in zip(axes, array.shape, strict=True))
        sound = named and fits and array.dtype == np.float64
    except (TypeError, ValueError, AttributeError, IndexError):
        sound = False
    if not sound:
        raise InputError(
            f"expected an array of floats over {lengths['time']} instants, its unit, and the names of its "
            f"axes, of which the first is 'time', found {output!r:.80}",
            subject=where,
        )


__getattr__ = names_elsewhere(__name__, ".recorder", describe="describe_run")
