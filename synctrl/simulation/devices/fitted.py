"""The sensors and actuators of a cell, and what they are in the middle of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...checks import instance, offers, positive_number, shaped
from ...control.parts import settings_of
from ...coupling.cell import Cell
from ...errors import InputError
from ...robots.model import joined, unit_for
from ..plant import Output
from .actuators import GRID, Actuator, DeadTime, Drive, Lag, RateLimit, Ripple, TorqueQuantisation
from .sensors import Bias, DifferencedVelocity, Noise, Quantisation, Sensor

#: outputs of a run with sensors, and of one with actuators, with their units where joints turn
MEASURED = {"measured_q": "rad", "measured_v": "rad/s"}
DRIVEN = {"actuator_torque": "N·m"}
ROLES = "sensors", "actuators"
#: parts that are of the other role than this one, and have the same methods
OTHERS = {
    "sensors": (DeadTime, Lag, RateLimit, Ripple, TorqueQuantisation),
    "actuators": (Bias, DifferencedVelocity, Noise, Quantisation),
}


class LiveDevices:
    """Sensors and actuators in the middle of a run.

    Args:
        cell: the robots.
        sensors, actuators: those that there are, none at all for ideal ones.
        period: time between two samples, s.

    Attributes:
        drive: torque of the motors, or None where what is asked for is what acts.
        readings: what was measured last, and what the motors give, by the name of their output, (n, nv) each.
    """

    def __init__(self, cell: Cell, sensors: Sequence[Sensor], actuators: Sequence[Actuator], period: float):
        self._measures = [(type(part).__qualname__, part.bind(cell, period)) for part in sensors]
        self.drive = Drive(actuators, cell, period) if actuators else None
        self._sample, names = 0, (*(MEASURED if sensors else ()), *(DRIVEN if actuators else ()))
        self.readings = {name: np.zeros((cell.n, cell.nv)) for name in names}

    @property
    def senses(self) -> bool:
        """Whether there are sensors."""
        return bool(self._measures)

    def measure(self, motion: np.ndarray) -> np.ndarray:
        """What is measured at the next sample of positions and velocities, (2, n, nv) each.

        Raises:
            InputError: a sensor gives something of another shape.
        """
        found = motion
        for name, measure in self._measures:
            found = measure(self._sample, found)
            shaped(f"sensor {name}", found, motion.shape)
        self._sample += 1
        for name, reading in zip(MEASURED if self.senses else (), found, strict=False):
            self.readings[name][...] = reading
        return found

    def command(self, t: float, tau: np.ndarray) -> None:
        """Ask the motors for torque tau, (n, nv), N·m, at a sample at time t, s."""
        if self.drive is not None:
            self.drive.command(t, tau)

    def reach(self, t: float, until: float, q: np.ndarray) -> None:
        """Let the motors take the goals that are due until some time; what they give at t and q is read."""
        if self.drive is not None:
            self.drive.reach(until)
            self.readings["actuator_torque"][...] = self.drive.torque(t, q)

    def torque(self, t: float, q: np.ndarray, asked: np.ndarray) -> np.ndarray:
        """Torque of the motors, (n, nv), N·m, at time t, s, and positions q, where some is asked for."""
        return asked if self.drive is None else self.drive.torque(t, q)

    def outputs(self, cell: Cell, logged: dict[str, np.ndarray]) -> dict[str, Output]:
        """What was read at the logged instants, (T, n, nv) each by name, with units and axes."""
        units, axes = {**MEASURED, **DRIVEN}, ("time", "robot", "joint")
        joints = [unit for robot in cell.robots for unit in robot.joint_units]
        return {
            name: (array, joined(unit_for(units[name], joint) for joint in joints), axes)
            for name, array in logged.items()
        }


class Devices:
    """The sensors and actuators of a cell.

    Args:
        cell: the robots.
        sensors: in the order in which they measure; none for ideal ones.
        actuators: in the order in which they act; none for ideal ones.

    Attributes:
        settings: of the sensors and of the actuators, as plain data, where there are any.

    Raises:
        InputError: no sequence of such, numbers that do not fit the cell, or an order that means nothing.
    """

    def __init__(self, cell: Cell, sensors: Sequence[Sensor] = (), actuators: Sequence[Actuator] = ()):
        given = zip(ROLES, (sensors, actuators), strict=True)
        self._cell, self._parts = cell, {role: tuple(_checked(role, parts)) for role, parts in given}
        self.settings: dict[str, list[dict[str, Any]]] = {
            role: [settings_of(part) for part in parts] for role, parts in self._parts.items() if parts
        }
        drive = self.start(1.0).drive  # what does not fit is refused before any run
        self._delay = drive.delay if drive else 0.0

    def start(self, period: float | None) -> LiveDevices:
        """The devices at the beginning of a run.

        Args:
            period: time between two samples, s; None for continuous control, which has none.

        Raises:
            InputError: there are devices, but no samples.
        """
        if period is None and self.settings:
            role, first = next((role, parts[0]["name"]) for role, parts in self.settings.items())
            text = f"expected a control_period, for {role} act at samples; found none, and the part {first}"
            raise InputError(text, subject=role, found=first)
        return LiveDevices(self._cell, period=1.0 if period is None else period, **self._parts)

    def switches(self, period: float, end: float) -> list[float]:
        """Instants between samples at which motors get a new goal until the end of a run, s.

        Raises:
            InputError: a period or a duration that is not positive.
        """
        period, end = positive_number("control_period", period), positive_number("duration", end)
        late = self._delay / period - np.floor(self._delay / period + GRID)
        if abs(late) <= GRID:
            return []
        instants = self._delay + period * np.arange(max(0.0, np.ceil((end - self._delay) / period)))
        return instants[instants < end].tolist()


def _checked(role: str, parts: Any) -> Sequence[Any]:
    """Parts of one role, each of which can be bound, says what it is, and is none of the other role's."""
    instance(role, parts, Sequence, f"a sequence of {role}")
    for k, part in enumerate(parts):
        offers(f"{role}[{k}]", part, ("bind", "as_dict"), f"one of the {role}, with bind and as_dict")
        if isinstance(part, OTHERS[role]):
            raise InputError.expected(f"one of the {role}", type(part).__name__, f"{role}[{k}]")
    return parts
