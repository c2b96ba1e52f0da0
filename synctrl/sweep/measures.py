"""What a sweep keeps of a run: a few numbers over all robots, pairs and axes, and whether to trust them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from sys import float_info
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..analysis.metrics import DEFINITIONS, ERRORS, SETTLING_FRACTION, Band, Metrics, finite_or_none, metrics
from ..analysis.metrics import squared as squared_unit
from ..coupling.cell import Cell
from ..errors import SaturationWarning, StepWarning, warn
from ..robots.model import joined, unit_for
from ..simulation.result import Result
from ..simulation.step_error import LIMIT


class Measure(NamedTuple):
    """A column of the table: its definition and its unit."""

    definition: str
    unit: str


#: how the values of all robots (or pairs) and axes become one: in words, and of many runs, (runs, values)
_OVER_ALL: Mapping[str, tuple[str, Callable[[np.ndarray], Any]]] = MappingProxyType(
    {
        "peak": ("the largest over all {rows} and axes", partial(np.max, axis=1)),
        "rms": (
            "the root of the mean of the squares over all {rows} and axes",
            lambda x: np.sqrt(np.mean(x**2, axis=1)),
        ),
        "ise": ("the sum over all {rows} and axes", partial(np.sum, axis=1)),
        "final": (
            "the largest over all {rows} and axes, without its sign",
            lambda x: np.abs(x).max(axis=1),
        ),
        "settling_time": (
            "the latest over all {rows} and axes; empty if one has not settled; the band is "
            f"{SETTLING_FRACTION:.0%} of the largest error of the run of the base experiment",
            partial(np.max, axis=1),
        ),
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
        for name, (how, _) in _OVER_ALL.items():
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
        values: list[Any] = [
            over_all(getattr(getattr(computed, kind), name).reshape(1, -1))[0]
            for kind in ERRORS
            for name, (_, over_all) in _OVER_ALL.items()
        ]
    values += [computed.peak_torque.max(), cut_off(result), (result.info["step_error"] or {}).get("estimate")]
    return [finite_or_none(value) for value in values]


def measures_of_all(measured: Any, span: float) -> list[list[float | None]]:
    """The measures of runs that were taken while they went, a row for each, as `measures` has them.

    Args:
        measured: `Measured` of the compiled engine.
        span: how long the runs were, s.
    """
    found: list[np.ndarray] = []
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for kind in ERRORS:
            error = getattr(measured, kind)
            taken = {**error._asdict(), "rms": np.sqrt(error.ise / span)}
            for name, (_, over_all) in _OVER_ALL.items():
                found.append(over_all(taken[name].reshape(len(error.ise), -1)))
        torque, cut = (part.reshape(len(part), -1) for part in (measured.peak_torque, measured.cut))
        largest, speed = measured.step_error[:, :2].T
        estimate = np.minimum(largest / speed, float_info.max)
        estimate[~((largest > 0) & (speed > 0))] = np.nan
        table = np.stack([*found, torque.max(axis=1), cut.max(axis=1) / measured.instants, estimate], axis=1)
    gaps = ~np.isfinite(table)
    rows: list[list[float | None]] = table.tolist()
    for run, column in np.argwhere(gaps).tolist():
        rows[run][column] = None
    return rows


def cut_off(result: Result) -> float:
    """Share of the logged instants at which torque was cut off, of the joint where that was most."""
    return max((entry["share"] for entry in result.info["saturation"]), default=0.0)


class Doubt(NamedTuple):
    """Why the measures of one run are to be doubted.

    Attributes:
        estimate: error of its worst step, as a share of its largest velocity; None if its step will do.
        advised: a step that does, s; None if its step will do, or if nobody has looked for one.
        share: of the instants at which the torque of a joint was cut off, the largest; 0 if none was.
    """

    estimate: float | None
    advised: float | None
    share: float


def doubt_of(result: Result) -> Doubt:
    """What is to be doubted of a run, by its `info`."""
    step = result.info["step_error"] or {}
    advised = step.get("advised_step")
    return Doubt(None if advised is None else step["estimate"], advised, cut_off(result))


def doubt_of_row(row: Sequence[Any]) -> Doubt:
    """What is to be doubted of a run, by its measures alone: they do not say which step would do."""
    share, estimate = row[-2:]
    return Doubt(None if estimate is None or estimate <= LIMIT else estimate, None, share)


def worst_first(doubts: Mapping[int, Doubt]) -> list[int]:
    """Runs with too long a step in which nobody has looked for one that does, the worst first."""
    errors = {
        run: doubt.estimate
        for run, doubt in doubts.items()
        if doubt.estimate is not None and doubt.advised is None
    }
    return sorted(errors, key=lambda run: (-errors[run], run))


def warn_of(doubts: Mapping[int, Doubt], what: str, dt: float) -> None:
    """Warn whoever called the package, once of each kind, of what a single run would warn of.

    Args:
        doubts: of runs that went to their end, by number of the run.
        what: made the runs, for the message.
        dt: their step, s.
    """
    all_runs = f"of the {len(doubts)} runs that were made to their end"
    errors = {run: doubt.estimate for run, doubt in doubts.items() if doubt.estimate is not None}
    if errors:
        worst = _largest(errors)
        shortest = min(doubt.advised for doubt in doubts.values() if doubt.advised is not None)
        warn(
            f"{what}: dt = {dt:g} s is too long in {len(errors)} {all_runs}; in run {worst} a step errs by "
            f"{errors[worst]:.2g} of the largest velocity, expected at most {LIMIT:g}. Begin again with a "
            f"step of at most {shortest:g} s",
            StepWarning,
        )
    shares = {run: doubt.share for run, doubt in doubts.items() if doubt.share > 0}
    if shares:
        worst = _largest(shares)
        warn(
            f"{what}: torque was cut off in {len(shares)} {all_runs}, most in run {worst}, at one joint for "
            f"{shares[worst]:.0%} of the time. Estimates and integrals of the synchronization errors went on "
            "meanwhile as if the robots had got it; lower the gains or their ranges, or ask for a slower "
            "motion",
            SaturationWarning,
        )


def _largest(values: Mapping[int, float]) -> int:
    """The run with the largest value, the first one if there are more: whoever made it, and when."""
    return max(values, key=lambda run: (values[run], -run))
