"""Where the values of a factor come from: distributions, and grids."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from reprlib import Repr
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from ..checks import finite_number, positive_number
from ..control.parts import settings_of
from ..errors import InputError
from ..renamed import names_elsewhere

Value = float | str
#: how many listed values are shown one by one, and of how many letters each
SHOWN, LETTERS = 8, 40
_SHORT = Repr()
_SHORT.maxstring = LETTERS


class Values(Protocol):
    """Values a factor can have; those of a distribution are drawn one by one, by `draw(rng)`."""

    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as plain data."""


@dataclass(frozen=True)
class _Interval:
    """From `low` to `high`, with a way to go through it."""

    low: float
    high: float

    def __post_init__(self) -> None:
        kind = type(self).__name__
        for name in ("low", "high"):
            object.__setattr__(self, name, finite_number(f"{kind}, {name}", getattr(self, name)))
        if not self.low < self.high:
            raise InputError.expected("low < high", (self.low, self.high), kind)

    def at(self, share: float) -> float:
        """The value below which a share of the distribution lies, 0 <= share <= 1."""
        raise NotImplementedError

    def draw(self, rng: np.random.Generator) -> float:
        return self.at(rng.random())

    def describe(self) -> dict[str, Any]:
        return {"kind": type(self).__name__, "low": self.low, "high": self.high}


class Uniform(_Interval):
    """Every number from low to high is as likely as every other.

    Raises:
        InputError: not finite, or not low < high.
    """

    def at(self, share: float) -> float:
        return min(self.low + share * (self.high - self.low), self.high)


class LogUniform(_Interval):
    """Every order of magnitude between low and high is as likely as every other.

    Raises:
        InputError: not above 0, or not low < high.
    """

    def __post_init__(self) -> None:
        positive_number("LogUniform, low", self.low)
        super().__post_init__()

    def at(self, share: float) -> float:
        return min(max(self.low * (self.high / self.low) ** share, self.low), self.high)


@dataclass(frozen=True)
class Normal:
    """The normal distribution.

    Raises:
        InputError: not finite, or a standard deviation that is not positive.
    """

    mean: float
    std: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", finite_number("Normal, mean", self.mean))
        object.__setattr__(self, "std", positive_number("Normal, std", self.std))

    def draw(self, rng: np.random.Generator) -> float:
        return float(rng.normal(self.mean, self.std))

    def describe(self) -> dict[str, Any]:
        return {"kind": "Normal", "mean": self.mean, "std": self.std}


class _Listed:
    """Values that were listed: numbers, words, or parts of a controller, known by their labels.

    Attributes:
        values: numbers and words, as tables have them.
        meant: what was listed, by its entry in `values`.
    """

    def __init__(self, values: Sequence[Any]):
        kind = type(self).__name__
        if isinstance(values, str) or not len(values):
            raise InputError.expected("a list of numbers, words or parts", values, kind)
        self.values = tuple(_plain(kind, part_label(value) if is_part(value) else value) for value in values)
        if len(set(self.values)) != len(self.values):
            raise InputError.expected("different values", list(self.values), kind)
        self.meant: Mapping[Value, Any] = dict(zip(self.values, values, strict=True))

    def describe(self) -> dict[str, Any]:
        return {"kind": type(self).__name__, "values": list(self.values)}

    def __repr__(self) -> str:
        kind, count = type(self).__name__, len(self.values)
        shown = [_SHORT.repr(value) for value in self.values[: SHOWN + 1]]
        if count <= SHOWN:
            return f"{kind}([{', '.join(shown)}])"
        return f"{kind}({count} values from {shown[0]} to {_SHORT.repr(self.values[-1])})"


class Choice(_Listed):
    """One of some values, each as likely as every other.

    Args:
        values: numbers or words, or parts for `adaptation`, `law` and `network`.

    Raises:
        InputError: none, two equal ones, or something else.
    """

    def draw(self, rng: np.random.Generator) -> Value:
        return self.values[int(rng.integers(len(self.values)))]


class Grid(_Listed):
    """Every one of some values, together with every combination of the other factors' grids.

    Args:
        values: numbers or words, or parts for `adaptation`, `law` and `network`.

    Raises:
        InputError: none, two equal ones, or something else.
    """


#: kinds of values by the name in their description
KINDS: Mapping[str, type] = MappingProxyType(
    {kind.__name__: kind for kind in (Uniform, LogUniform, Normal, Choice, Grid)}
)


def described(description: Mapping[str, Any]) -> Values | None:
    """The values that `describe` has described, or None if they are of a kind of the user's own.

    Raises:
        InputError: parameters that the kind does not have.
    """
    parameters = dict(description)
    name = parameters.pop("kind", None)
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        return None
    try:
        return kind(**parameters)
    except TypeError as error:
        raise InputError(str(error), subject=name) from error


def drawn(name: str, values: Any, rng: np.random.Generator) -> Value:
    """One value of a distribution, as a plain number or word.

    Raises:
        InputError: a distribution of the user's own draws something else.
    """
    value = values.draw(rng)
    plain = value.item() if isinstance(value, np.generic) else value
    if type(plain) is int:
        return plain
    return _plain(f"factor '{name}', a value that {type(values).__name__} has drawn", plain)


def is_part(value: object) -> bool:
    """Whether this is an adaptation, a law or a network, and not its type."""
    return hasattr(value, "as_dict") and hasattr(value, "bind") and not isinstance(value, type)


def part_label(part: Any) -> str:
    """Name and settings of a part in one line: `Natural(gamma=0.1, gamma_friction=0.0)`.

    Raises:
        InputError: its settings are no plain data.
    """
    settings = settings_of(part)
    try:
        text = {name: json.dumps(x, ensure_ascii=False, allow_nan=False) for name, x in settings.items()}
    except (TypeError, ValueError) as error:
        raise InputError.expected(
            "settings that are plain data from as_dict", settings, type(part).__name__
        ) from error
    return f"{settings['name']}({', '.join(f'{key}={text[key]}' for key in settings if key != 'name')})"


def is_text(value: object) -> bool:
    """Whether this is a text that can be written to a file: half of a surrogate pair cannot."""
    return isinstance(value, str) and not any("\ud800" <= letter <= "\udfff" for letter in value)


def _plain(name: str, value: Any) -> Value:
    """A value as a float, or as the word that it is."""
    if not isinstance(value, str):
        return finite_number(name, value)
    if not is_text(value):
        raise InputError.expected("a word that can be written to a file", value, name, shown=f"{value!a}")
    return str(value)


__getattr__ = names_elsewhere(__name__, ".distributions", Distribution="Values")
