"""What a sweep is, as plain data: told of an experiment, read from its `sweep.json`, checked and compared."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..analysis.metrics import ERRORS, Band, checked_band
from ..checks import choice, count, instance, positive_number
from ..errors import InputError, ResultError
from ..files import read_regular
from ..simulation.description import describe_run
from ..simulation.schedules import DisturbanceSchedule
from .distributions import Values, described
from .factors import Setup
from .further import FURTHER
from .measures import MEASURES, TRUST
from .rows import Draws, Format, Generations, columns

#: what is written
FORMAT = "synctrl sweep 2"
#: what is read: the measures of each format
FORMATS: Mapping[str, Sequence[str]] = MappingProxyType(
    {"synctrl sweep 1": [name for name in MEASURES if name not in TRUST], FORMAT: MEASURES}
)
ABOUT = "sweep.json"
#: where it has measures that a user has defined
OWN = "own_measures"
#: instants at which desired motion and closed loop are looked at
INSTANTS = 40
#: digits that count: fewer than those in which machines may differ
DIGITS = 9


def describe_base(setup: Setup) -> dict[str, Any]:
    """Names, gains and options of an experiment, and digests of what cannot be told in words."""
    experiment = setup.experiment
    loop, cell = experiment.closed_loop(), experiment.cell
    schedule = DisturbanceSchedule(cell, experiment.disturbances)
    times = np.linspace(0, setup.duration, INSTANTS)
    described = {key: value for key, value in describe_run(loop).items() if key != "versions"}
    table = cell.reference_table(times)
    return {
        **described,
        "digest": {
            "initial state": digest([loop.initial_state()]),
            "desired motion": digest([*np.moveaxis(table.desired, 1, 0)]),
            "weights": digest([table.c, table.c_dot, table.c_ddot]),
            "disturbances": digest([np.array(schedule.edges), schedule.torques]),
            "dynamics": digest(_flow(setup, times)),
        },
    }


def digest(arrays: Any) -> str:
    """A short digest of arrays, to the digits that count; -0 counts as 0."""
    rows = (" ".join(f"{value + 0.0:.{DIGITS - 1}e}" for value in array.ravel()) for array in arrays)
    text = "\n".join(rows)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_about(folder: str | Path) -> dict[str, Any]:
    """What the sweep in a folder is.

    Raises:
        ResultError: there is none, or its description cannot be read or contradicts itself.
    """
    path = Path(folder) / ABOUT
    try:
        about = json.loads(read_regular(path).decode("utf-8"))
    except FileNotFoundError:
        raise ResultError(f"no sweep in '{folder}': it has no {ABOUT}", file=folder) from None
    except (OSError, ValueError, RecursionError) as error:
        raise ResultError(f"'{path}' cannot be read: {error}", file=path) from error
    if not isinstance(about, dict) or about.get("format") not in list(FORMATS):
        found = about.get("format") if isinstance(about, dict) else type(about).__name__
        expected = f"'{path}': expected the format '{FORMAT}'"
        raise ResultError(f"{expected}, found {found!r}", file=path, found=found)
    try:
        row_format(about)
        checked_bands(about.get("settling_bands"))
    except InputError as error:
        raise ResultError(f"'{path}': {error}", file=path) from error
    return about


def row_format(about: Mapping[str, Any]) -> Format:
    """What rows have to be, by the description of their sweep or search.

    Raises:
        InputError: a part that is missing or wrong, or parts that contradict each other.
    """
    factors = _described_factors(about.get("factors"))
    measures = measures_of(about)
    expected = columns(factors, measures)
    if about.get("columns") != expected:
        raise InputError.expected(str(expected), about.get("columns"), "columns")
    duration = positive_number("duration", about.get("duration"))
    if "search" in about:
        population = count("population", about["search"].get("population"))
        return Format(expected, Generations(factors, population), duration, measures, own_of(about))
    draws = Draws(factors, count("samples", about.get("samples")), count("seed", about.get("seed"), least=0))
    if about.get("runs") != draws.count:
        raise InputError.expected(f"{draws.count}, as the factors say", about.get("runs"), "runs")
    return Format(expected, draws, duration, measures, own_of(about))


def measures_of(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the measures in the rows of a sweep or a search, by its description.

    Raises:
        InputError: further measures that are none, or see `own_of`.
    """
    search = about.get("search", {})
    instance("search", search, Mapping, "a description of the search")
    further = search.get("further", [])
    instance("further", further, list, "a list of further measures")
    named = (choice("further", name, tuple(FURTHER)) for name in further)
    return (*FORMATS[about["format"]], *named, *own_of(about))


def own_of(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the measures that a user has defined, by the description of a sweep or a search.

    Raises:
        InputError: no descriptions of such measures.
    """
    found = about.get(OWN, [])
    instance(OWN, found, list, "a list of measures")
    for own in found:
        instance(OWN, own, Mapping, "descriptions of measures")
        instance(OWN, own.get("name"), str, "the name of a measure")
    return tuple(own["name"] for own in found)


def checked_bands(bands: Any) -> dict[str, Band]:
    """Settling bands by kind of error.

    Raises:
        InputError: other kinds, or values that are no band.
    """
    if not isinstance(bands, Mapping) or set(bands) != set(ERRORS):
        raise InputError.expected(f"numbers for {' and '.join(ERRORS)}", bands, "bands")
    return {kind: checked_band(f"bands, {kind}", bands[kind]) for kind in ERRORS}


def difference(there: Any, here: Any, where: str = "") -> str:
    """The first thing in which two descriptions differ, in words; empty if they do not."""
    if isinstance(there, dict) and isinstance(here, dict):
        keys = [*there, *(key for key in here if key not in there)]
        parts: Iterable[tuple[str, Any, Any]] = (
            (f"{where}.{key}" if where else key, there.get(key), here.get(key)) for key in keys
        )
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        parts = ((f"{where}[{k}]", *pair) for k, pair in enumerate(zip(there, here, strict=True)))
    else:
        return "" if there == here else f"{where} is {_short(there)} there and {_short(here)} here"
    return next((found for name, a, b in parts if (found := difference(a, b, name))), "")


# -- internals --------------------------------------------------------------------------------------------


def _described_factors(factors: Any) -> dict[str, Values | None]:
    """Values by the name of their factor; None for a kind that is not known here."""
    instance("factors", factors, list, "a list of factors")
    found: dict[str, Values | None] = {}
    for factor in factors:
        instance("factors", factor, Mapping, "descriptions of factors")
        name, values = factor.get("name"), factor.get("values")
        instance("factors", name, str, "the name of a factor")
        instance(f"factor '{name}'", values, Mapping, "a description of its values")
        if name in found:
            raise InputError(f"expected different names, found '{name}' again", subject="factors", found=name)
        found[name] = described(values)
    if not found:
        raise InputError("expected at least one, found none", subject="factors")
    return found


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 80 else text[:77] + "..."


def _flow(setup: Setup, times: np.ndarray) -> list[np.ndarray]:
    """y' of the closed loop at some instants, near its initial state: robots, friction, options and all.

    Events of the plant come after it, each with what it makes of such a state.
    """
    loop = setup.experiment.closed_loop()
    rng = np.random.default_rng(0)
    y, none = loop.initial_state(), np.zeros((loop.cell.n, loop.cell.nv))
    spread = 0.01 * _used(loop)
    flow = [
        loop.at(float(t)).evaluate(reference, y + spread * rng.standard_normal(y.size), none)[0]
        for t, reference in zip(times, loop.cell.references(times), strict=True)
    ]
    for t in loop.events.tolist():
        state = loop.state(y + spread * rng.standard_normal(y.size))
        loop.at(t).meet(t, state)
        flow += [np.array([t]), state.flat]
    return flow


def _used(loop: Any) -> np.ndarray:
    """1 for joints that a robot has, 0 for padding and everything that is no joint."""
    used = np.zeros(loop.size)
    for part in loop.split(used)[:2]:
        for i, robot in enumerate(loop.cell.robots):
            part[i, : robot.nv] = 1
    return used
