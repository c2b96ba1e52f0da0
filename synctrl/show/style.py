"""Colours of robots and units for people: one choice for figures, tables and animations."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

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
