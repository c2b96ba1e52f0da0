"""Colours as users write them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..checks import finite_array
from ..errors import InputError
from .shapes import Color

ColorLike = str | Sequence[float] | np.ndarray


def read_color(name: str, color: ColorLike) -> Color:
    """A colour: "#rrggbb", "#rrggbbaa", or three or four numbers in [0, 1].

    Returns:
        Red, green, blue and opacity in [0, 1].

    Raises:
        InputError: anything else; the message begins with `name`.
    """
    if isinstance(color, str):
        return _hex_color(name, color)
    rgb = within_unit(name, finite_array(f"{name}: color", color))
    if rgb.shape not in ((3,), (4,)):
        raise InputError(f"{name}: color: expected three or four numbers, found shape {rgb.shape}")
    r, g, b, a = (*map(float, rgb), 1.0)[:4]
    return r, g, b, a


def within_unit(name: str, rgb: np.ndarray) -> np.ndarray:
    """`rgb` if all its numbers are in [0, 1]."""
    if rgb.size and (rgb.min() < 0 or rgb.max() > 1):
        raise InputError(f"{name}: color: expected numbers in [0, 1], found {rgb.min():g} to {rgb.max():g}")
    return rgb


def hex_color(color: Color) -> str:
    """The colour as "#rrggbb", its opacity left out."""
    return "#" + "".join(f"{round(255 * c):02x}" for c in color[:3])


def _hex_color(name: str, color: str) -> Color:
    try:
        if not color.startswith("#") or len(color) not in (7, 9):
            raise ValueError
        r, g, b, *rest = (byte / 255 for byte in bytes.fromhex(color[1:]))
    except ValueError:
        raise InputError(f"{name}: color: expected #rrggbb or #rrggbbaa, found {color!r}") from None
    return r, g, b, rest[0] if rest else 1.0
