"""Whether an experiment can be the one that made a result, as far as can be told without evaluating it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose
from typing import Any

import numpy as np

from ..errors import InputError
from ..simulation.closed_loop import ClosedLoop
from ..simulation.description import describe_run
from ..simulation.recorder import own_states
from ..simulation.result import LAYOUT, Result

#: parts that a result's info may describe
PARTS = ("adaptation", "law", "network")
#: and those that it has if there are any
OPTIONAL = ("admittance", "sensors", "actuators")
#: relative difference between two settings that may be rounding
ROUNDING = 1e-9
#: numbers beyond it are those of a run that went astray, and have no squares
LARGEST = 1e100
#: relative difference between logged and re-evaluated velocity errors that means "another experiment"
MISMATCH = 1e-6
#: what rounding may amount to beside it: a share of the largest velocity of the run, and rad/s
AGREEMENT, STILL = 1e-9, 1e-12


def check_sizes(result: Result, loop: ClosedLoop) -> None:
    """Compare shapes, also those of the states that adaptation, network and plant have for themselves.

    Raises:
        InputError: the experiment has other ones, or nothing was logged.
    """
    cell, own = loop.cell, own_states(loop)
    errors = {"theta_hat": cell.theta.shape, "sync_error": (cell.coupling.pairs, cell.m)}
    for name, shape in {"q": (cell.n, cell.nv), **errors, **own}.items():
        array = result.outputs.get(name) if name in own else getattr(result, name)
        found = None if array is None else array.shape[1:]
        if found != shape:
            raise another(f"its {name} has the shape {shape} at an instant, the result's {found}", name)
    if not len(result.t):
        raise InputError("expected at least one logged instant, found none", subject="result")


def check_settings(result: Result, loop: ClosedLoop) -> None:
    """Compare gains and parts by what they say of themselves.

    Raises:
        InputError: gains, parts, sensors or actuators are others.
    """
    ours, its = (_settings(info) for info in (describe_run(loop), result.info))
    for name in its:
        if not alike(ours[name], its[name]):
            raise another(f"it has {name}: {ours[name]!r:.200}, the result {its[name]!r:.200}", name)


def _settings(info: Mapping[str, Any]) -> dict[str, Any]:
    """Gains and parts; Gamma counts as the adaptation's, to which files of version 0.1 give no name."""
    gains = dict(info["gains"])
    learning = {"name": "Gradient", "Gamma": gains.pop("Gamma", None)}
    parts = {name: info[name] for name in PARTS if name in info}
    optional = {name: info.get(name) for name in OPTIONAL}
    return {"adaptation": learning, "gains": gains, **optional, **parts}


def alike(a: Any, b: Any) -> bool:
    """Whether settings are the same but for rounding; a file makes tuples lists."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return isclose(a, b, rel_tol=ROUNDING)
    return bool(np.array_equal(a, b))


def check_numbers(result: Result) -> None:
    """Refuse a run that went astray.

    Raises:
        InputError: it has numbers that have no squares.
    """
    for name in LAYOUT:
        large = np.argwhere(~(np.abs(getattr(result, name)) <= LARGEST))
        if len(large):
            found = getattr(result, name)[tuple(large[0])]
            raise InputError(
                f"expected numbers up to {LARGEST:g}, found {found:g} at "
                f"t = {result.t[large[0][0]]:g} s; the run went astray, and nothing can be said of it",
                subject=f"result, {name}",
                found=found,
            )


def check_same(result: Result, s_q: np.ndarray, speed: np.ndarray) -> None:
    """Compare velocity errors; where robots are at rest and on their path, these are nothing but rounding.

    Args:
        result: the run.
        s_q, speed: what an experiment gives for it, velocity errors and size of velocities, (T, n, nv).

    Raises:
        InputError: it is another experiment, or numbers with too few digits to tell.
    """
    if result.v_error.dtype != np.float64:
        found = str(result.v_error.dtype)
        raise InputError.expected("a log in float64, from which a run can be computed anew", found, "result")
    difference, speed = (part.max(axis=(1, 2)) for part in (np.abs(s_q - result.v_error), speed))
    rounding = max(STILL, AGREEMENT * speed.max())
    wrong = ~(difference <= MISMATCH * speed + rounding)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise another(
            f"at t = {result.t[k]:g} s it gives a velocity error of {s_q[k].tolist()}, but the result "
            f"has {result.v_error[k].tolist()}",
            "v_error",
        )


def another(reason: str, part: str) -> InputError:
    """The error about an experiment that is another one than that of the result, with what differs."""
    return InputError(f"expected the one that made the result; {reason}", subject="experiment", found=part)
