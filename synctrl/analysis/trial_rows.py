"""Rows of a comparison of laws: a law with one choice of its gain, and what its runs measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: the rule of a row that makes nothing equal
AS_GIVEN = "as given"


@dataclass(frozen=True)
class Sizes:
    """A run in five numbers over all robots, pairs, axes and joints.

    Attributes:
        tracking_peak, tracking_rms: of e, in its unit.
        sync_peak, sync_rms: of epsilon, in its unit.
        peak_torque: N·m, or N of joints that slide.
    """

    tracking_peak: float
    tracking_rms: float
    sync_peak: float
    sync_rms: float
    peak_torque: float


@dataclass(frozen=True)
class Row:
    """A law with one choice of its free gain.

    Attributes:
        law: its name.
        rule: "as given", "equal pole", "equal peak torque" or "equal tracking".
        gain: name of the free gain.
        value: of it, plain; None if none was found.
        quiet: sizes of the run without disturbances; None if it could not be made to its end.
        disturbed: of the run with them; None too if there are none.
        remark: why something is missing.
    """

    law: str
    rule: str
    gain: str
    value: Any
    quiet: Sizes | None
    disturbed: Sizes | None
    remark: str = ""
