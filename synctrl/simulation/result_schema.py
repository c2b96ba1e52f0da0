"""What a result consists of: its arrays, and what the package reads of its info."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain
from types import MappingProxyType
from typing import Any

import numpy as np

from ..errors import ResultError
from ..robots.units import TURNS, unit_for
from .schema import (
    above,
    boolean,
    each,
    entries,
    label,
    nothing,
    number,
    numbers,
    optional,
    rows,
    text,
    whole,
)

FORMAT = "synctrl result 2"
#: what is read; files of format 1 have no outputs
FORMATS = ("synctrl result 1", FORMAT)
#: largest time in a log, s, about 30,000 years: times beyond it are damage
LATEST = 1e12

#: array -> (dimensions, unit); "task" stands for the unit of the task, "weighted" for that of c e; what has
#: an axis "joint" has the unit that it has for a joint that turns
LAYOUT: Mapping[str, tuple[tuple[str, ...], str]] = MappingProxyType(
    {
        "t": (("time",), "s"),
        "x": (("time", "robot", "axis"), "task"),
        "x_desired": (("time", "robot", "axis"), "task"),
        "tracking_error": (("time", "robot", "axis"), "task"),
        "sync_error": (("time", "pair", "axis"), "weighted"),
        "sync_integral": (("time", "pair", "axis"), "weighted·s"),
        "coupled_error": (("time", "robot", "axis"), "weighted"),
        "q": (("time", "robot", "joint"), "rad"),
        "v": (("time", "robot", "joint"), "rad/s"),
        "v_error": (("time", "robot", "joint"), "rad/s"),
        "tau": (("time", "robot", "joint"), "N·m"),
        "disturbance": (("time", "robot", "joint"), "N·m"),
        "theta_hat": (("time", "robot", "parameter"), "SI"),
    }
)


def unit_of(array: str, task: str, weighted: str, joint: str = TURNS) -> str:
    """Unit of an array of `LAYOUT`, given those of the task and of c e, and of the position of the joint."""
    return unit_for(LAYOUT[array][1].replace("task", task).replace("weighted", weighted), joint)


# -- info -------------------------------------------------------------------------------------------------

SIZES = entries(
    {"robot": whole(1), "pair": whole(1), "axis": whole(1), "joint": whole(1), "parameter": whole(0)}
)

_ROBOT = entries(
    {
        "name": label,
        "joints": rows(label, least=1, distinct=True),
        "parameters": rows(label),
        "theta": rows(number),
    },
    {
        "model": label,
        "urdf": text,
        "tip": label,
        "file": label,
        "joint_units": rows(label),
        "torque_limits": rows(optional(above(0, or_equal=True))),
    },
)
_WINDOW = {"robot": whole(below="robot"), "start": number}
_DISTURBANCE = entries({**_WINDOW, "torque": numbers, "stop": number})
_PAYLOAD = entries({**_WINDOW, "stop": optional(number), "mass": number})
_LEFT_LIMIT = entries(
    {**_WINDOW, "stop": number, "joint": whole(below="joint"), "kind": label}, {"unit": label}
)
_CUT_OFF = entries(
    {
        "robot": whole(below="robot"),
        "joint": whole(below="joint"),
        **{name: above(0, or_equal=True) for name in ("limit", "share", "largest")},
        "theta_hat": rows(above(0, or_equal=True), least=2),
    },
    {"unit": label},
)
_STEP = {
    "estimate": above(0, or_equal=True),
    "robot": whole(below="robot"),
    "joint": whole(below="joint"),
    "time": number,
}
_LIMIT = {"limit": above(0)}
#: a step that was looked at, and what is said where none was
_WORST = entries({**_STEP, **_LIMIT, "advised_step": optional(above(0))})
_NO_STEP = entries({**dict.fromkeys((*_STEP, "advised_step"), nothing), **_LIMIT})
_PART = entries({"name": label})


def _step_error(where: str, value: Any, sizes: Mapping[str, int]) -> None:
    """What `step_report` gives: all of the worst step, or nothing but the limit."""
    unseen = isinstance(value, dict) and value.get("estimate", 0) is None
    (_NO_STEP if unseen else _WORST)(where, value, sizes)


_HELD = entries({"joints": rows(label), "largest": rows(number), "final": rows(number)})

INFO = entries(
    {
        "status": text,
        "title": text,
        "task_unit": label,
        "weighted_unit": label,
        "robots": rows(_ROBOT, "robot"),
        "axes": rows(label, "axis", distinct=True),
        "pairs": rows(rows(whole(below="robot"), least=2, distinct=True), "pair"),
        "gains": entries({"Lambda": numbers, "beta": numbers}),
        "versions": each(label),
    },
    {
        "units": each(label),
        "axis_units": rows(label, "axis"),
        "weighted_units": rows(label, "axis"),
        "coupling": label,
        "signs": rows(rows(number), "pair"),
        "outputs": each(entries({"unit": label, "axes": rows(label, least=1)})),
        "integrator": label,
        "engine": label,
        "plant": label,
        "dt": above(0),
        "log_dt": above(0),
        "duration": above(0),
        "control_period": optional(above(0)),
        "saturate": boolean,
        "decimated": whole(1),
        "disturbances": rows(_DISTURBANCE),
        "payloads": rows(_PAYLOAD),
        "events": rows(entries({"t": number, "part": label})),
        "damping": rows(entries({**_WINDOW, "stop": number})),
        "limits": rows(_LEFT_LIMIT),
        "saturation": rows(_CUT_OFF),
        "step_error": optional(_step_error),
        "adaptation": _PART,
        "law": _PART,
        "network": _PART,
        "held_joints": rows(_HELD, "robot"),
    },
)


def check_info(info: Any) -> None:
    """Refuse an info that somebody who reads it later would stumble over.

    Raises:
        ResultError: the entry, what is expected there, and what is found.
    """
    form = info.get("format") if isinstance(info, dict) else type(info).__name__
    if form not in FORMATS:
        raise ResultError(f"expected the format '{FORMAT}', found {form!a:.80}")
    entries({"sizes": SIZES})("info", info, {})
    INFO("info", info, info["sizes"])
    _check_robots(info["robots"], info["sizes"])
    for name, about in info.get("outputs", {}).items():
        if not name.isidentifier() or about["axes"][0] != "time":
            raise ResultError(
                f"expected an identifier with 'time' as its first axis, found {about['axes']!a:.80}",
                subject=f"info, outputs, {name}",
            )


def _check_robots(robots: list[dict[str, Any]], sizes: Mapping[str, int]) -> None:
    """What a robot says of itself has to fit together, and into the arrays."""
    if len({robot["name"] for robot in robots}) < len(robots):
        raise ResultError("expected another name for each robot, found one twice", subject="info, robots")
    for k, robot in enumerate(robots):
        found = {name: len(robot[name]) for name in ("joints", "parameters", "theta")}
        found |= {name: len(robot[name]) for name in ("torque_limits", "joint_units") if name in robot}
        fits = found["joints"] <= sizes["joint"] and found["parameters"] <= sizes["parameter"]
        per_joint = {found.get(name, found["joints"]) for name in ("torque_limits", "joint_units")}
        if not fits or found["theta"] != found["parameters"] or per_joint != {found["joints"]}:
            raise ResultError(
                "expected as many theta as parameters, and torque_limits and joint_units as joints, up to "
                f"{sizes['parameter']} and {sizes['joint']}, found {found}",
                subject=f"info, robots[{k}]",
            )


# -- arrays -----------------------------------------------------------------------------------------------


def shapes(info: Mapping[str, Any], instants: int) -> dict[str, tuple[int | None, ...]]:
    """Shape of every array, and of every output after "outputs/"; None is a length that info does not say."""
    lengths = {**info["sizes"], "time": instants}
    dimensions = chain(
        ((name, axes) for name, (axes, _) in LAYOUT.items()),
        ((f"outputs/{name}", about["axes"]) for name, about in info.get("outputs", {}).items()),
    )
    return {name: tuple(lengths.get(axis) for axis in axes) for name, axes in dimensions}


def check_arrays(info: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays that are not those that info speaks of, or numbers that no run has.

    Every number is finite, as a run stops before anything else is logged; outputs may say by NaN that there
    is no value. Times grow.

    Raises:
        ResultError: the array, what is expected and what is found.
    """
    expected = shapes(info, arrays["t"].size)
    check_array_names(arrays, expected)
    for name, array in arrays.items():
        check_shape(name, array.dtype, array.shape, expected[name])
        if name in LAYOUT and not np.isfinite(array).all():
            where = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
            raise ResultError(
                f"expected finite numbers, found {array[where]} at {where}", subject=f"array '{name}'"
            )
    _check_times(arrays["t"])


def check_array_names(found: Iterable[str], expected: Iterable[str]) -> None:
    """Refuse arrays that are too many or too few.

    Raises:
        ResultError: with the names that are not in both.
    """
    different = ", ".join(sorted({*found} ^ {*expected}))
    if different:
        raise ResultError(
            f"expected those that info speaks of and no others, these differ: {different}",
            subject="arrays",
            found=different,
        )


def check_shape(name: str, dtype: np.dtype, found: tuple[int, ...], expected: tuple[int | None, ...]) -> None:
    """Refuse an array of another kind or shape.

    Raises:
        ResultError: see above.
    """
    fits = len(found) == len(expected) and all(
        e is None or e == f for e, f in zip(expected, found, strict=True)
    )
    if not fits or dtype != np.float64:
        raise ResultError(
            f"expected float64 of shape {expected}, found {dtype} of shape {found}", subject=f"array '{name}'"
        )


def _check_times(t: np.ndarray) -> None:
    wrong = np.flatnonzero(~(np.abs(t) <= LATEST) | (np.diff(t, prepend=-np.inf) <= 0))
    if wrong.size:
        raise ResultError(
            f"expected times that grow, at most {LATEST:g} s, found {t[wrong[0]]} at {wrong[0]}",
            subject="array 't'",
        )
