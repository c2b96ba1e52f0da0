"""What plain data from outside must look like, and what the package reads of a result's info.

The rules read like the data they describe. A rule is called with the place, the value there and the lengths
that names such as "robot" stand for; it raises a ResultError that says what is expected at that place and
what is found.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, NoReturn, TypeAlias

from ..checks import LONGEST_LABEL, printable, unprintable
from ..errors import ResultError

Sizes: TypeAlias = Mapping[str, int]
Rule: TypeAlias = Callable[[str, Any, Sizes], None]

#: how deep data may be nested, and the first whole number that is too large
DEEPEST, TOO_LARGE = 20, 2**63
#: characters
LONGEST_TEXT = 100_000


def read_json(text: str) -> Any:
    """Data in a JSON text, no key in it twice, not too deep, and its numbers not too large.

    Raises:
        ResultError: another text.
    """
    try:
        data = json.loads(text, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        raise ResultError.expected("JSON", error, "info", shown=f"{error}") from None
    anything("info", data, {})
    return data


def anything(where: str, value: Any, sizes: Sizes, depth: int = 0) -> None:
    """Any plain data."""
    if depth > DEEPEST:
        _refuse(where, f"at most {DEEPEST} levels", value)
    if isinstance(value, dict):
        for key, entry in value.items():
            anything(f"{where}, {ascii(key)[1:-1]:.40}" if depth < 3 else where, entry, sizes, depth + 1)
    elif isinstance(value, list):
        for entry in value:
            anything(where, entry, sizes, depth + 1)
    elif isinstance(value, int) and not -TOO_LARGE < value < TOO_LARGE:
        _refuse(where, "numbers below 2^63", hex(value))


def plain(expected: str, fits: Callable[[Any], bool]) -> Rule:
    """A value of which a test is true."""

    def rule(where: str, value: Any, sizes: Sizes) -> None:
        if not fits(value):
            _refuse(where, expected, value)

    return rule


def _shown(value: Any, longest: int) -> bool:
    return isinstance(value, str) and len(value) <= longest and printable(value) == value


def _finite(value: Any) -> bool:
    return type(value) in (int, float) and isfinite(value)


#: a text of one or more lines, for people; and one of one line, a name or a unit
text = plain(f"a text of up to {LONGEST_TEXT} characters", lambda value: _shown(value, LONGEST_TEXT))
label = plain(
    f"one line of up to {LONGEST_LABEL} characters",
    lambda value: _shown(value, LONGEST_LABEL) and not unprintable(value),
)
boolean = plain("true or false", lambda value: isinstance(value, bool))
nothing = plain("null", lambda value: value is None)
number = plain("a finite number", _finite)
positive = plain("a number above 0", lambda value: _finite(value) and value > 0)
not_negative = plain("a number of at least 0", lambda value: _finite(value) and value >= 0)


def numbers(where: str, value: Any, sizes: Sizes) -> None:
    """A finite number, or a list of such or of lists of such."""
    if isinstance(value, list):
        for k, entry in enumerate(value):
            numbers(f"{where}[{k}]", entry, sizes)
    else:
        number(where, value, sizes)


def whole(least: int = 0, below: str | None = None) -> Rule:
    """A whole number of at least `least`, and below the length that `below` names."""

    def rule(where: str, value: Any, sizes: Sizes) -> None:
        if type(value) is not int or value < least:
            _refuse(where, f"a whole number of at least {least}", value)
        if below is not None and value >= sizes[below]:
            _refuse(where, f"the number of a {below}, from 0 to {sizes[below] - 1}", value)

    return rule


def optional(rule: Rule) -> Rule:
    """What a rule asks for, or null."""
    return lambda where, value, sizes: None if value is None else rule(where, value, sizes)


def rows(rule: Rule, count: str | None = None, *, least: int = 0, distinct: bool = False) -> Rule:
    """A list, each entry after a rule; as long as the length that `count` names."""

    def check(where: str, value: Any, sizes: Sizes) -> None:
        if not isinstance(value, list) or len(value) < least:
            _refuse(where, f"a list of at least {least}", value)
        if count is not None and len(value) != sizes[count]:
            _refuse(where, f"{sizes[count]} entries, one per {count}", len(value))
        for k, entry in enumerate(value):
            rule(f"{where}[{k}]", entry, sizes)
        if distinct and len({*value}) < len(value):
            _refuse(where, "entries that differ", value)

    return check


def each(rule: Rule) -> Rule:
    """A dictionary with any keys, each entry after a rule."""

    def check(where: str, value: Any, sizes: Sizes) -> None:
        _is_dictionary(where, value)
        for key, entry in value.items():
            label(f"{where}, name of an entry", key, sizes)
            rule(f"{where}, {key}", entry, sizes)

    return check


def entries(needed: Mapping[str, Rule], known: Mapping[str, Rule] | None = None) -> Rule:
    """A dictionary with entries that are needed and others that follow a rule if they are there.

    What is not known is let through: whoever reads it has to know what it means.
    """

    def check(where: str, value: Any, sizes: Sizes) -> None:
        _is_dictionary(where, value)
        for key, rule in {**needed, **(known or {})}.items():
            if key in value:
                rule(f"{where}, {key}", value[key], sizes)
            elif key in needed:
                _refuse(f"{where}, {key}", "an entry of this name", [*value])

    return check


def _is_dictionary(where: str, value: Any) -> None:
    if not isinstance(value, dict):
        _refuse(where, "entries by name", value)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name that is there twice")
    return found


def _refuse(where: str, expected: str, found: Any) -> NoReturn:
    raise ResultError.expected(expected, found, where, shown=f"{found!a:.80}")


# -- info of a result --------------------------------------------------------------------------------------

FORMAT = "synctrl result 2"
#: what is read; files of format 1 have no outputs
FORMATS = ("synctrl result 1", FORMAT)
SIZES = entries({**dict.fromkeys(("robot", "pair", "axis", "joint"), whole(1)), "parameter": whole(0)})

_ROBOT = entries(
    {
        "name": label,
        "joints": rows(label, least=1, distinct=True),
        "parameters": rows(label),
        "theta": rows(number),
    },
    {
        **dict.fromkeys(("model", "tip", "file"), label),
        "urdf": text,
        "joint_units": rows(label),
        "torque_limits": rows(optional(not_negative)),
    },
)
_JOINT = {"robot": whole(below="robot"), "joint": whole(below="joint")}
_WINDOW = {"robot": whole(below="robot"), "start": number}
_DISTURBANCE = entries({**_WINDOW, "torque": numbers, "stop": number})
_PAYLOAD = entries({**_WINDOW, "stop": optional(number), "mass": number})
_LEFT_LIMIT = entries({**_WINDOW, **_JOINT, "stop": number, "kind": label}, {"unit": label})
_CUT_OFF = entries(
    {
        **_JOINT,
        **dict.fromkeys(("limit", "share", "largest"), not_negative),
        "theta_hat": rows(not_negative, least=2),
    },
    {"unit": label},
)
_STEP = {"estimate": not_negative, **_JOINT, "time": number, "advised_step": optional(positive)}
#: a step that was looked at, and what is said where none was
_WORST = entries({**_STEP, "limit": positive})
_NO_STEP = entries({**dict.fromkeys(_STEP, nothing), "limit": positive})
_PART = entries({"name": label})
_HELD = entries({"joints": rows(label), "largest": rows(number), "final": rows(number)})


def _step_error(where: str, value: Any, sizes: Mapping[str, int]) -> None:
    """What `step_report` gives: all of the worst step, or nothing but the limit."""
    unseen = isinstance(value, dict) and value.get("estimate", 0) is None
    (_NO_STEP if unseen else _WORST)(where, value, sizes)


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
        **dict.fromkeys(("axis_units", "weighted_units"), rows(label, "axis")),
        "coupling": label,
        "signs": rows(rows(number), "pair"),
        "outputs": each(entries({"unit": label, "axes": rows(label, least=1)})),
        **dict.fromkeys(("integrator", "engine", "plant"), label),
        **dict.fromkeys(("dt", "log_dt", "duration"), positive),
        "log_dtype": plain("'float64' or 'float32'", lambda value: value in ("float64", "float32")),
        "control_period": optional(positive),
        "saturate": boolean,
        "decimated": whole(1),
        "disturbances": rows(_DISTURBANCE),
        "payloads": rows(_PAYLOAD),
        "events": rows(entries({"t": number, "part": label})),
        "damping": rows(entries({**_WINDOW, "stop": number})),
        "limits": rows(_LEFT_LIMIT),
        "saturation": rows(_CUT_OFF),
        "step_error": optional(_step_error),
        **dict.fromkeys(("adaptation", "law", "network"), _PART),
        **dict.fromkeys(("sensors", "actuators"), rows(_PART)),
        "admittance": entries(dict.fromkeys(("mass", "damping"), rows(number))),
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
        raise ResultError.expected(f"the format '{FORMAT}'", form, shown=f"{form!a:.80}")
    entries({"sizes": SIZES})("info", info, {})
    INFO("info", info, info["sizes"])
    _check_robots(info["robots"], info["sizes"])
    for name, about in info.get("outputs", {}).items():
        if not name.isidentifier() or about["axes"][0] != "time":
            raise ResultError.expected(
                "an identifier with 'time' as its first axis",
                about["axes"],
                f"info, outputs, {name}",
                shown=f"{about['axes']!a:.80}",
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
            raise ResultError.expected(
                "as many theta as parameters, and torque_limits and joint_units as joints, up to "
                f"{sizes['parameter']} and {sizes['joint']}",
                found,
                f"info, robots[{k}]",
            )
