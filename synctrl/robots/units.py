"""Units per joint: what turns is in rad, rad/s and N·m, what slides in m, m/s and N."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
import pinocchio as pin

#: position of a joint that turns, and of one that slides
TURNS, SLIDES = "rad", "m"
#: unit of something of a joint that turns -> unit of the same of one that slides
_SLIDING: Mapping[str, str] = MappingProxyType(
    {
        TURNS: SLIDES,
        "rad/s": "m/s",
        "rad/s²": "m/s²",
        "N·m": "N",
        "N·m·s/rad": "N·s/m",
        "N·m/rad": "N/m",
    }
)


def joint_units(model: pin.Model) -> tuple[str, ...]:
    """Units of the positions of all joints, (nv,): "rad" of those that turn, "m" of those that slide."""
    return tuple(TURNS if np.any(subspace(model, j)[3:]) else SLIDES for j in range(1, model.njoints))


def subspace(model: pin.Model, joint: int) -> np.ndarray:
    """The motion that a joint allows in its own frame, (6,): linear, then angular."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, pin.neutral(model))
    return np.asarray(data.S).ravel()


def unit_for(unit: str, joint: str) -> str:
    """Unit of something of a joint whose position is in `joint`; `unit` is that of a joint that turns."""
    return _SLIDING.get(unit, unit) if joint == SLIDES else unit


def joined(units: Iterable[str]) -> str:
    """Units in one text, each once: `rad`, or `m, rad`."""
    return ", ".join(dict.fromkeys(units))
