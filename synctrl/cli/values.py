"""What `--vary` and `--search` say: `gains.beta=log(5,150)`, as a factor of a sweep.

A text is one of

    NAME=uniform(LOW,HIGH)   NAME=log(LOW,HIGH)   NAME=normal(MEAN,STD)
    NAME=choice(A,B,...)     NAME=grid(A,B,...)

NAME is `gains.beta`, `gains.beta.scale`, `law`, or a factor of `synctrl.sweep` such as `model_error`, with
dots for underscores if one likes (`network.delay`), and indices, counted from 0, in brackets:
`true_parameters[robot=0,body=1]`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from .. import sweep
from ..control.gains import Gains
from ..errors import InputError, near
from ..sweep import Choice, Factor, Grid, LogUniform, Normal, Uniform
from ..sweep.factors import GAINS
from .laws import named_laws

_SYNTAX = re.compile(r"\s*([\w.]+)\s*(?:\[([^\]]*)\])?\s*=\s*(\w+)\s*\(([^()]*)\)\s*")
EXAMPLE = "NAME=KIND(VALUES), such as gains.beta=log(5,150)"
#: kinds of values, and how many numbers each takes; 0 for a list
KINDS: Mapping[str, tuple[Callable[..., Any], int]] = MappingProxyType(
    {
        "uniform": (Uniform, 2),
        "log": (LogUniform, 2),
        "normal": (Normal, 2),
        "choice": (Choice, 0),
        "grid": (Grid, 0),
    }
)
#: names of the sweep's room that make no factor of numbers or words
_OTHERS = ("Factor", "OwnMeasure", "Sweep", "load", "trajectories", "adaptation", "network", "law")
_GAINS = ("gain", "gain_scale")
FACTORS = tuple(
    name
    for name in sweep.__all__
    if name not in (*_OTHERS, *_GAINS, "Choice", "Grid", "LogUniform", "Normal", "Uniform")
)


def read_factor(option: str, text: str, gains: Gains) -> Factor:
    """The factor that a text describes.

    Args:
        option: that has the text, for messages.
        text: see the head of this module.
        gains: of the cell, from which free gains of laws begin.

    Raises:
        InputError: a text of another form, a name or a kind that is not known, with the near ones, or values
            that a kind does not take.
    """
    found = _SYNTAX.fullmatch(text)
    if found is None:
        raise InputError.expected(EXAMPLE, text, option)
    name, indices, kind, values = found.groups()
    if kind not in KINDS:
        raise InputError(
            f"{text!r}: expected {', '.join(KINDS)}, found {kind!r}{near(kind, KINDS)}", subject=option
        )
    if name == "law":
        _check_listed(option, text, kind)
        return sweep.law(KINDS[kind][0]([*named_laws(_words(values), gains, option).values()]))
    try:
        return _factor(
            option, text, name, _values(option, text, kind, values), _indices(option, text, indices)
        )
    except TypeError as error:
        raise InputError(f"{text!r}: {name} takes no such index", subject=option) from error


def _factor(option: str, text: str, name: str, values: Any, indices: dict[str, int]) -> Factor:
    part, _, rest = name.partition(".")
    if part in ("gains", "gain"):
        gain, _, scale = rest.partition(".")
        if gain not in GAINS or scale not in ("", "scale"):
            raise InputError(
                f"{text!r}: expected one of {', '.join(GAINS)}, found {rest!r}{near(rest, GAINS)}",
                subject=option,
            )
        return sweep.gain_scale(gain, values) if scale else sweep.gain(gain, values)
    word = name.replace(".", "_")
    word = word.removeprefix("sensors_").removeprefix("actuators_")
    if word not in FACTORS:
        known = [f"gains.{gain}" for gain in GAINS] + [*FACTORS, "law"]
        raise InputError(
            f"{text!r}: nothing is called {name!r}{near(name, known)}; known are: {', '.join(known)}",
            subject=option,
            found=name,
        )
    return getattr(sweep, word)(values, **indices)


def _values(option: str, text: str, kind: str, values: str) -> Any:
    make, count = KINDS[kind]
    words = _words(values)
    if not count:
        return make([_plain(word) for word in words])
    numbers = [_plain(word) for word in words]
    if len(numbers) != count or any(isinstance(each, str) for each in numbers):
        raise InputError(
            f"{text!r}: expected {count} numbers in {kind}(...), found ({values})", subject=option
        )
    return make(*numbers)


def _check_listed(option: str, text: str, kind: str) -> None:
    if KINDS[kind][1]:
        raise InputError(f"{text!r}: expected choice(...) or grid(...) of laws, found {kind}", subject=option)


def _indices(option: str, text: str, words: str | None) -> dict[str, int]:
    pairs = [word.partition("=") for word in _words(words or "")]
    if any(not sign or not value.strip().isdecimal() for _, sign, value in pairs):
        raise InputError(
            f"{text!r}: expected [robot=0,joint=1], counted from 0, found [{words}]", subject=option
        )
    return {name.strip(): int(value) for name, _, value in pairs}


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _plain(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return word
