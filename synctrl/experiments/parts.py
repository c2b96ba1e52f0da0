"""What all ready cells share: parts that take the place of the paper's, gains, and what they are called."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from ..checks import boolean, finite_array, instance
from ..control.adaptation import Adaptation
from ..control.admittance import Admittance
from ..control.gains import Gains
from ..control.laws import Law
from ..control.network import Communication
from ..coupling.cell import Cell
from ..simulation.devices import Actuator, Sensor
from ..simulation.schedules import Disturbance
from ..simulation.simulate import Experiment

#: what says yes or no where an option may also be a value of one's own
BOOLS = bool, np.bool_


class Parts(TypedDict, total=False):
    """Parts of the controller, and what stands between it and the robots, as `Experiment` takes them."""

    adaptation: Adaptation | None
    law: Law | None
    network: Communication | None
    sensors: Sequence[Sensor]
    actuators: Sequence[Actuator]


class ControllerParts(Parts, total=False):
    """Parts and options of the controller."""

    reference_acceleration: str | None
    k_r_space: str | None


def ready_experiment(
    cell: Cell,
    duration: float,
    default: Gains,
    gains: Gains | None,
    synchronized: bool,
    parts: ControllerParts,
    *remarks: str,
    disturbances: Sequence[Disturbance] = (),
) -> Experiment:
    """A ready cell with its controller.

    Args:
        cell: robots, task and coupling.
        duration: of the experiment, s.
        default: gains of the cell, of which `_own` leaves out what other parts have no place for.
        gains: what is used instead of them, or None.
        synchronized: False sets beta = K_eps = 0, independent adaptive control.
        parts: parts and options of the controller, see `ControllerParts`.
        remarks: what else is special about the experiment, for its title.
        disturbances: torques from outside.

    Raises:
        InputError: a value of the wrong type.
    """
    boolean("synchronized", synchronized)
    if gains is None:
        gains = _own(default, parts)
    instance("gains", gains, Gains, "Gains")
    kind = "synchronized" if synchronized else "independent"
    title = ", ".join([cell.name, kind, *remarks, *["disturbed"] * bool(disturbances)])
    gains = gains if synchronized else gains.independent()
    return Experiment(cell, gains, duration, disturbances, title=title, **parts)


def giving_way(admittance: bool | Admittance, default: Admittance) -> Admittance | None:
    """An admittance, the one of a cell for True, or none for False.

    Raises:
        InputError: neither a bool nor an admittance.
    """
    if isinstance(admittance, BOOLS):
        return default if admittance else None
    instance("admittance", admittance, Admittance, "a bool or an Admittance")
    return admittance


def error_of_geometry(given: bool | ArrayLike, default: np.ndarray) -> np.ndarray:
    """An error of what arms believe of the geometry, the one of a cell for True, none for False; m and rad.

    Raises:
        InputError: neither a bool nor numbers of the shape of the default.
    """
    error = default * given if isinstance(given, BOOLS) else given
    return finite_array("geometric_error", error, default.shape)


def leaking(gains: Gains, leak: Any) -> Gains:
    """Gains with a leak of the integrals, 1/s; True stands for Lambda, False and 0 change nothing.

    Raises:
        InputError: no numbers, or a leak that `Gains` does not take.
    """
    rates = gains.Lambda * leak if isinstance(leak, BOOLS) else finite_array("leak", leak)
    return gains.replace(leak=rates) if np.any(rates) else gains


def _own(gains: Gains, parts: ControllerParts) -> Gains:
    """Gains of a cell without Gamma, beta and K_eps where another adaptation or law has no place for them."""
    law = parts.get("law")
    if parts.get("adaptation") is not None:
        gains = gains.replace(Gamma=None)
    elif not getattr(law, "adaptive", True):
        gains = gains.replace(Gamma=0.0)
    return gains.independent() if getattr(law, "independent", False) else gains
