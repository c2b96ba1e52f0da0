"""What a sweep keeps of a run: a few numbers over all robots, pairs and axes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..analysis.metrics import (
    DEFINITIONS,
    ERRORS,
    SETTLING_FRACTION,
    Band,
    ErrorMetrics,
    Metrics,
    finite_or_none,
    metrics,
)
from ..analysis.metrics import squared as squared_unit
from ..coupling.cell import Cell
from ..robots.units import joined, unit_for
from ..simulation.result import Result
from ..simulation.step_error import LIMIT


class Measure(NamedTuple):
    """A column of the table: its definition and its unit."""

    definition: str
    unit: str


#: how the values of all robots (or pairs) and axes become one
_OVER_ALL: Mapping[str, str] = MappingProxyType(
    {
        "peak": "the largest over all {rows} and axes",
        "rms": "the root of the mean of the squares over all {rows} and axes",
        "ise": "the sum over all {rows} and axes",
        "final": "the largest over all {rows} and axes, without its sign",
        "settling_time": "the latest over all {rows} and axes; empty if one has not settled; the band is "
        f"{SETTLING_FRACTION:.0%} of the largest error of the run of the base experiment",
    }
)
_SHORT = {"tracking_error": "tracking", "sync_error": "sync"}
_ROWS = {"tracking_error": "robots", "sync_error": "pairs"}

#: what a run says of itself: how far its other measures can be trusted
TRUST: Mapping[str, Measure] = MappingProxyType(
    {
        "saturation": Measure(
            "share of the logged instants at which torque was cut off, the largest over all joints", "1"
        ),
        "step_error": Measure(
            "error in velocity of the worst step, as a share of the largest velocity; above "
            f"{LIMIT:g} the step is too long; empty if no step could be looked at",
            "1",
        ),
    }
)
#: names of the measures, in the order of the table
MEASURES = (*(f"{_SHORT[kind]}_{name}" for kind in ERRORS for name in _OVER_ALL), "peak_torque", *TRUST)


def definitions(cell: Cell) -> dict[str, Measure]:
    """What each measure means, with the units of a cell."""
    units = {"tracking_error": cell.unit, "sync_error": cell.weighted_unit}
    found = {}
    for kind, unit in units.items():
        square = joined(f"{squared_unit(each)}·s" for each in unit.split(", "))
        special = {"ise": square, "settling_time": "s"}
        for name, how in _OVER_ALL.items():
            text = f"{DEFINITIONS[name].split(';')[0]}; {how.format(rows=_ROWS[kind])}"
            found[f"{_SHORT[kind]}_{name}"] = Measure(text, special.get(name, unit))
    text = f"{DEFINITIONS['peak_torque']}; the largest over all robots and joints"
    return {**found, "peak_torque": Measure(text, torque_unit(cell)), **TRUST}


def torque_unit(cell: Cell) -> str:
    """Unit of the torques of a cell; `N·m, N` where some joints turn and others slide."""
    return joined(unit_for("N·m", unit) for robot in cell.robots for unit in robot.joint_units)


def measures(result: Result, bands: Mapping[str, Band]) -> list[float | None]:
    """The measures of a run, in the order of `MEASURES`; None where there is no finite number.

    Args:
        result: the run.
        bands: settling bands by kind of error, see `analysis.metrics.settling_bands`.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        computed: Metrics = metrics(result, bands)
        values: list[Any] = [value for kind in ERRORS for value in _over_all(getattr(computed, kind))]
    values += [computed.peak_torque.max(), cut_off(result), (result.info["step_error"] or {}).get("estimate")]
    return [finite_or_none(value) for value in values]


def cut_off(result: Result) -> float:
    """Share of the logged instants at which torque was cut off, of the joint where that was most."""
    return max((entry["share"] for entry in result.info["saturation"]), default=0.0)


def _over_all(error: ErrorMetrics) -> list[float]:
    """In the order of `_OVER_ALL`."""
    return [
        error.peak.max(),
        np.sqrt(np.mean(error.rms**2)),
        error.ise.sum(),
        np.abs(error.final).max(),
        error.settling_time.max(),
    ]
