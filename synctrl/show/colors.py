"""Colours as users write them, read by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks import finite_array
from ..errors import InputError
from .shapes import Color

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
        raise InputError(
            f"color: expected #rrggbb, a name, or three or four numbers, found {given!r}", subject=name
        ) from None


def within_unit(name: str, rgb: np.ndarray) -> np.ndarray:
    """`rgb` if all its numbers are in [0, 1]."""
    if rgb.size and (rgb.min() < 0 or rgb.max() > 1):
        raise InputError(
            f"color: expected numbers in [0, 1], found {rgb.min():g} to {rgb.max():g}", subject=name
        )
    return rgb


def hex_color(color: Color) -> str:
    """The colour as "#rrggbb", its opacity left out."""
    from matplotlib.colors import to_hex

    return to_hex(color)
