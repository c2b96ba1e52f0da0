"""What all sensors and actuators share: methods, settings that say what they are, and numbers per joint."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_array
from ...control.gains import spread
from ...coupling.cell import Cell
from ...errors import InputError

#: the function of samples by which a device acts in one run
Bound = TypeVar("Bound", covariant=True)


class Device(Protocol[Bound]):
    """A sensor or an actuator; it is the same after runs as before them."""

    def bind(self, cell: Cell, period: float) -> Bound:
        """How it acts in one run, from its start.

        Args:
            cell: the robots.
            period: time between two samples, s.

        Raises:
            InputError: what does not fit, named.
        """

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""


class Settings:
    """A device whose fields are its settings."""

    def as_dict(self) -> dict[str, Any]:
        """Name and settings as plain data."""
        names: list[str] = [field.name for field in fields(self)] if is_dataclass(self) else []
        return {"name": type(self).__name__, **{name: _plain(getattr(self, name)) for name in names}}

    def _set(self, name: str, value: Any) -> None:
        """Keep a setting that was checked, in a device that is frozen afterwards."""
        object.__setattr__(self, name, value)


def numbers_of(name: str, value: ArrayLike, least: float = -np.inf) -> float | np.ndarray:
    """A number, or a read-only array of such.

    Raises:
        InputError: no numbers, not finite, or below the least.
    """
    array = finite_array(name, value)
    if (found := float(array.min(initial=np.inf))) < least:
        raise InputError.expected(f"numbers of at least {least:g}", found, name)
    return float(array) if array.ndim == 0 else array


def at_joints(name: str, value: ArrayLike, cell: Cell) -> np.ndarray:
    """A number for every joint of a cell, (n, nv); 0 where a robot has no joint.

    Raises:
        InputError: another shape.
    """
    joints = np.arange(cell.nv) < np.array([[robot.nv] for robot in cell.robots])
    return np.where(joints, spread(name, np.asarray(value), (cell.n, cell.nv)), 0.0)


def in_steps(values: np.ndarray, step: np.ndarray) -> np.ndarray:
    """The nearest multiples step round(values / step), (n, nv); values as they are where the step is 0."""
    found, steps = values.copy(), step > 0
    found[steps] = step[steps] * np.rint(values[steps] / step[steps])
    return found


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
