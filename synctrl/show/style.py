"""Colours as users write them and as robots have them, and units for people, in figures and scenes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..checks import finite_array
from ..errors import InputError
from .shapes import Color

LineStyle: TypeAlias = str | tuple[int, tuple[float, ...]]
#: distinguishable with every kind of colour blindness, and dark enough on white
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#3d3d8f", "#6b4423", "#4d4d4d")
DESIRED = "#444444"
ACCENT = "#b3001b"
#: first axis solid, second dash-dot as in the paper, third dotted
LINE_STYLES: tuple[LineStyle, ...] = (
    *("-", "-.", ":", "--"),
    *((0, (8, 2)), (0, (6, 2, 1, 2, 1, 2)), (0, (1, 4)), (0, (3, 4))),
)


class Display(NamedTuple):
    """A unit that is read easily: displayed value = factor times the value in SI units."""

    unit: str
    factor: float


_DEGREES = 57.29577951308232
_DISPLAY = {
    "rad": Display("deg", _DEGREES),
    "rad²·s": Display("deg²·s", _DEGREES**2),
    "m": Display("mm", 1e3),
    "m²·s": Display("mm²·s", 1e6),
    "m²": Display("10⁻³ m²", 1e3),
    "m⁴·s": Display("10⁻⁶ m⁴·s", 1e6),
}


def robot_color(index: int) -> str:
    """Colour of a robot, counted from 0; colours repeat after eight."""
    return PALETTE[index % len(PALETTE)]


def line_style(axis: int) -> LineStyle:
    """Line style of an axis, counted from 0."""
    return LINE_STYLES[axis % len(LINE_STYLES)]


def display(unit: str) -> Display:
    """The unit in which values of a unit are shown: degrees for rad, millimetres for m."""
    return _DISPLAY.get(unit, Display(unit, 1.0))


ColorLike = str | Sequence[float] | np.ndarray


def read_color(name: str, color: ColorLike) -> Color:
    """A colour that matplotlib knows: "#rrggbb", a name, or three or four numbers in [0, 1].

    Returns:
        Red, green, blue and opacity in [0, 1].

    Raises:
        InputError: anything else; the message begins with `name`.
    """
    from matplotlib.colors import to_rgba

    given: Any = color
    if not isinstance(color, str):
        given = within_unit(name, finite_array(f"{name}: color", color)).tolist()
    try:
        return to_rgba(given)
    except ValueError:
        raise InputError.expected(
            "#rrggbb, a name, or three or four numbers", given, f"{name}: color"
        ) from None


def within_unit(name: str, rgb: np.ndarray) -> np.ndarray:
    """`rgb` if all its numbers are in [0, 1].

    Raises:
        InputError: one is not.
    """
    if rgb.size and (rgb.min() < 0 or rgb.max() > 1):
        low, high = rgb.min(), rgb.max()
        words = f"expected numbers in [0, 1], found {low:g} to {high:g}"
        raise InputError(words, subject=f"{name}: color", found=(low, high))
    return rgb


def hex_color(color: Color) -> str:
    """The colour as "#rrggbb", its opacity left out."""
    from matplotlib.colors import to_hex

    return to_hex(color)
