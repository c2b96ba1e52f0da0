"""Laws by the names that they have on the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ..control.gains import Gains
from ..control.laws import (
    ChungSlotine,
    ComputedTorque,
    Law,
    MasterSlave,
    PDGravity,
    SlotineLi,
    SunMills,
)
from ..errors import InputError, near

#: the share of the damping that `ChungSlotine` couples with, before its gain is solved for
COUPLED = 0.3


def _stiffness(gains: Gains) -> float:
    return float(np.max(gains.K_r) * np.max(gains.Lambda))


#: as in cell files, each with its free gain in the size of the cell's own, for which comparisons then solve;
#: "independent" is another name of the law without synchronization
LAWS: Mapping[str, Callable[[Gains], Law]] = MappingProxyType(
    {
        "sun-mills": lambda gains: SunMills(),
        "independent": lambda gains: SlotineLi(),
        "slotine-li": lambda gains: SlotineLi(),
        "chung-slotine": lambda gains: ChungSlotine(COUPLED * float(np.max(gains.K_r))),
        "master-slave": lambda gains: MasterSlave(),
        "computed-torque": lambda gains: ComputedTorque(),
        "pd-gravity": lambda gains: PDGravity(_stiffness(gains)),
    }
)


def named_laws(names: Sequence[str], gains: Gains) -> dict[str, Law]:
    """Laws by name.

    Args:
        names: of `LAWS`.
        gains: those of the cell, from which free gains begin.

    Raises:
        InputError: another name, with the near ones.
    """
    for name in names:
        if name not in LAWS:
            raise InputError(
                f"expected some of {', '.join(LAWS)}, found {name!r}{near(name, LAWS)}",
                subject="--laws",
                found=name,
            )
    return {name: LAWS[name](gains) for name in names}
