"""Metrics: how large the errors of a run were, how long they lasted, and what torque it took.

All metrics are per robot (or pair of robots) and axis. Units are SI; radians, not degrees.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from ..checks import finite_array, instance, non_negative_number
from ..errors import InputError
from ..files import reported, write_whole
from ..robots.model import joined
from ..simulation.result import Result

FORMAT = "synctrl metrics 1"
ERRORS = ("tracking_error", "sync_error")
#: width of the settling band, as a share of the largest error it is made from
SETTLING_FRACTION = 0.05
#: one for all coordinates, or one for each
Band: TypeAlias = float | np.ndarray

DEFINITIONS: Mapping[str, str] = MappingProxyType(
    {
        "peak": "largest absolute value",
        "rms": "root of the time average of the square, trapezoidal rule",
        "ise": "integral of the square over the run, trapezoidal rule",
        "settling_time": "first logged instant from which the absolute value stays within the settling band "
        "until the end of the run; null if it is outside at the end",
        "settling_band": f"{SETTLING_FRACTION:.0%} of the largest absolute value over all robots (or pairs) "
        "and axes of one unit; runs that are compared share the band of the largest among them",
        "final": "value at the last instant, with its sign",
        "peak_torque": "largest absolute torque of the controller",
    }
)


@dataclass(frozen=True, eq=False)
class ErrorMetrics:
    """Metrics of one kind of error, each (rows, m): a row per robot or pair, a column per axis.

    Attributes:
        peak: largest |e|.
        rms: root of the time average of e^2.
        ise: integral of e^2.
        settling_time: s; infinite where the error is outside the band at the end.
        final: e at the end.
        band: settling band, in the unit of e; (m,) where coordinates have different units.
    """

    peak: np.ndarray
    rms: np.ndarray
    ise: np.ndarray
    settling_time: np.ndarray
    final: np.ndarray
    band: Band


@dataclass(frozen=True, eq=False)
class Metrics:
    """Metrics of one run; `peak_torque` is (n, nv), N·m, or N of joints that slide."""

    tracking_error: ErrorMetrics
    sync_error: ErrorMetrics
    peak_torque: np.ndarray


def metrics(result: Result, bands: Mapping[str, Band] | None = None) -> Metrics:
    """Metrics of a run.

    Args:
        result: the run, with at least one instant.
        bands: settling bands by kind of error, see `settling_bands`; by default the run's own.

    Raises:
        InputError: no instants, or a band that is negative or not finite.
    """
    own = settling_bands(result)
    bands = own if bands is None else bands
    tracking, sync = (error_metrics(result.t, getattr(result, kind), bands[kind]) for kind in ERRORS)
    return Metrics(tracking, sync, np.abs(result.tau).max(axis=0))


def error_metrics(t: np.ndarray, e: np.ndarray, band: Band) -> ErrorMetrics:
    """Metrics of an error e, (T, ...), at the instants t, (T,), s; the band is one or fits the last axis."""
    ise = integral_of_square(t, e)
    span = t[-1] - t[0]
    rms = np.sqrt(ise / span) if span > 0 else np.abs(e[-1])
    band = checked_band("settling band", band)
    return ErrorMetrics(np.abs(e).max(axis=0), rms, ise, settling_time(t, e, band), e[-1].copy(), band)


def integral_of_square(t: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Integral of e^2 over time by the trapezoidal rule, (...), for e of shape (T, ...).

    One step is added after another, as by code that measures a run while it goes: the bits are the same.
    """
    square, steps = np.square(e), np.diff(t).reshape(-1, *[1] * (e.ndim - 1))
    areas = np.zeros(e.shape)
    areas[1:] = steps * (square[1:] + square[:-1]) / 2.0
    return np.cumsum(areas, axis=0)[-1]


def settling_time(t: np.ndarray, e: np.ndarray, band: Band) -> np.ndarray:
    """First instant from which |e| <= band until the end, (...), s; infinite if the last value is outside."""
    outside = np.abs(e) > band
    settled_from = len(t) - np.argmax(outside[::-1], axis=0)  # one after the last instant outside
    times = np.append(t, np.inf)[settled_from]
    return np.where(outside.any(axis=0), times, t[0])


def settling_bands(*results: Result, fraction: float = SETTLING_FRACTION) -> dict[str, Band]:
    """Settling bands that runs to be compared share: a fraction of the largest error among them.

    A band of each run's own would call the run with the larger error the sooner settled. Where coordinates
    have different units, each has a band from those of its own unit.

    Raises:
        InputError: no run, or one without instants.
    """
    if not results:
        raise InputError("expected at least one run, found none", subject="settling bands")
    for result in results:
        instance("run", result, Result, "a Result")
        if not len(result.t):
            raise InputError(
                "expected at least one logged instant, found none", subject=f"run '{result.info['title']}'"
            )
    return {kind: fraction * _largest(kind, results) for kind in ERRORS}


def checked_band(name: str, band: Any) -> Band:
    """A settling band, or one for each coordinate.

    Raises:
        InputError: a band that is negative or not finite.
    """
    if np.ndim(band) == 0:
        return non_negative_number(name, band)
    return np.array([non_negative_number(name, value) for value in finite_array(name, band, (None,))])


def _largest(kind: str, results: Sequence[Result]) -> Band:
    """Largest errors: one for coordinates of one unit, else one per coordinate, (m,)."""
    units = results[0].units(kind)[0]
    if len({*units}) == 1:
        return max(float(np.abs(getattr(r, kind)).max()) for r in results)
    each = np.max([np.abs(getattr(r, kind)).max(axis=(0, 1)) for r in results], axis=0)
    return np.array([each[[other == unit for other in units]].max() for unit in units])


# -- metrics as plain data --------------------------------------------------------------------------------


def row_names(result: Result, kind: str) -> list[str]:
    """Names of the rows of `tracking_error` (robots) or `sync_error` (pairs of robots, or all of them)."""
    instance("result", result, Result, "a Result")
    if kind == "tracking_error":
        return result.names
    return [f"{k}: {_compared(result, row)}" for k, row in enumerate(result.info["pairs"], start=1)]


def _compared(result: Result, robots: Sequence[int]) -> str:
    return ", ".join(result.names[i] for i in robots) if len(robots) == 2 else f"all {len(robots)} robots"


def as_data(result: Result, computed: Metrics) -> dict[str, Any]:
    """Metrics of a run under names and with units, as dictionaries of finite numbers.

    `["sync_error"]["values"][row][axis]["rms"]` is one of them; a settling time that is not reached is None.
    """
    instance("result", result, Result, "a Result")
    info = result.info
    data: dict[str, Any] = {"title": info["title"], "status": result.status, "duration": float(result.t[-1])}
    data["duration_unit"] = "s"
    for kind in ERRORS:
        data[kind] = _error_data(result, kind, getattr(computed, kind))
    data["peak_torque"] = {
        "unit": result.unit("tau"),
        "units": _by_joint(result, result.units("tau")),
        "values": _by_joint(result, computed.peak_torque.tolist()),
    }
    data["gains"], data["versions"] = info["gains"], info["versions"]
    data["step_error"] = info.get("step_error")
    return data


def _error_data(result: Result, kind: str, computed: ErrorMetrics) -> dict[str, Any]:
    axes, names = result.info["axes"], ("peak", "rms", "ise", "settling_time", "final")
    values = {
        row: {
            axis: {name: finite_or_none(getattr(computed, name)[k, a]) for name in names}
            for a, axis in enumerate(axes)
        }
        for k, row in enumerate(row_names(result, kind))
    }
    return {
        "units": _units(result.unit(kind)),
        "units_by_axis": {a: _units(unit) for a, unit in zip(axes, result.units(kind)[0], strict=True)},
        "settling_band": np.asarray(computed.band).tolist(),
        "settling_band_unit": result.unit(kind),
        "values": values,
    }


def _units(unit: str) -> dict[str, str]:
    """Units of the metrics of an error in a unit, or in several: `rad, m`."""
    ise = joined(f"{squared(each)}·s" for each in unit.split(", "))
    return {"peak": unit, "rms": unit, "ise": ise, "settling_time": "s", "final": unit}


def _by_joint(result: Result, rows: Sequence[Sequence[Any]]) -> dict[str, dict[str, Any]]:
    return {
        robot["name"]: dict(zip(robot["joints"], row, strict=False))
        for robot, row in zip(result.info["robots"], rows, strict=True)
    }


def squared(unit: str) -> str:
    """The square of a unit: `rad²`, and `m⁴` of `m²`."""
    return {"m²": "m⁴"}.get(unit, f"{unit}²" if unit.isalpha() else f"({unit})²")


def write_metrics(path: str | Path, runs: Mapping[str, Mapping], claims: list[Mapping], **more: Any) -> Path:
    """Write metrics and claims to a JSON file of finite numbers.

    Args:
        path: the file.
        runs: `as_data` of each run, by name.
        claims: `Claim.as_data()` of each claim.
        more: further entries.

    Raises:
        InputError: a number that is not finite.
        ResultError: the file cannot be written.
    """
    content = {"format": FORMAT, "definitions": dict(DEFINITIONS), "runs": runs, "claims": claims, **more}
    try:
        text = json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False)
    except ValueError as error:
        raise InputError(f"expected finite numbers only ({error})", subject="metrics") from error
    with reported("write the metrics to", path):
        write_whole(path, text + "\n")
    return Path(path)


def finite_or_none(value: float | None) -> float | None:
    """A number as files can hold it: None in place of what is not finite."""
    return float(value) if value is not None and np.isfinite(value) else None
