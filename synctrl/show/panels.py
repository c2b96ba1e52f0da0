"""Panels one above the other, in margins known beforehand: nothing is measured to arrange them.

Figures that stand side by side have their axes in the same places.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 6.4  # inches
DPI = 150
#: margins around the panels, inches: room for a label and for ticks such as −181.975
LEFT, RIGHT, BOTTOM = 0.88, 0.22, 0.46
#: from the edges of a figure to the labels of its axes, and to the power of ten of all ticks, inches
LABEL, EDGE = 0.15, 0.04
#: room above a panel: for nothing, for a title, and for a line of a legend, inches
GAP, TITLE, LEGEND = 0.15, 0.31, 0.2

_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def stacked_panels(
    heights: Sequence[float], above: Sequence[float], width: float = WIDTH
) -> tuple[Figure, list[Axes]]:
    """Panels that share their time axis; to be called within `plots.style`.

    Args:
        heights: of the panels, from the top, inches.
        above: room left above each of them, inches.
        width: of the figure, inches.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height = sum(heights) + sum(above) + BOTTOM
    figure = Figure(figsize=(width, height), dpi=DPI)
    FigureCanvasAgg(figure)
    panels: list[Axes] = []
    top = height
    for own, room in zip(heights, above, strict=True):
        top -= room + own
        place = LEFT / width, top / height, 1 - (LEFT + RIGHT) / width, own / height
        panels.append(figure.add_axes(place, sharex=panels[0] if panels else None))
        _place_labels(panels[-1], width - LEFT - RIGHT, own)
        panels[-1].margins(x=0)
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    panels[-1].set_xlabel("time, s")
    return figure, panels


#: margins of a panel of a grid: left of it for ticks and a label, right, and below, inches
GRID_LEFT, GRID_RIGHT, GRID_BELOW = 0.74, 0.22, 0.5
#: the widest panel of a grid, inches
WIDEST = 3.4


def panel_grid(
    count: int, least: float, height: float | None, above: float, width: float, together: int = 1
) -> tuple[Figure, list[Axes]]:
    """Panels in rows, each with a title and axes of its own; to be called within `look.drawing`.

    Args:
        count: how many.
        least: width of a panel with its margins: there are as many in a row as fit, inches.
        height: of a panel, inches; None for as much as its width.
        above: room above all of them, inches.
        width: of the figure, inches.
        together: so many stay in one row, one after another, where there is room.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(max(int(width / least), 1), count)
    columns -= columns % together if columns > together else 0
    own = min(width / columns - GRID_LEFT - GRID_RIGHT, WIDEST)
    tall = own if height is None else height
    cell, rows = TITLE + tall + GRID_BELOW, -(-count // columns)
    figure = Figure(figsize=(width, above + rows * cell), dpi=DPI)
    FigureCanvasAgg(figure)
    panels = []
    for k in range(count):
        left = (k % columns) * (own + GRID_LEFT + GRID_RIGHT) + GRID_LEFT
        bottom = (rows - 1 - k // columns) * cell + GRID_BELOW
        total = above + rows * cell
        place = left / width, bottom / total, own / width, tall / total
        panels.append(figure.add_axes(place))
        _set_ticks(panels[-1], own, tall)
    return figure, panels


def _set_ticks(panel: Axes, width: float, height: float) -> None:
    """As many ticks as have room, and labels at fixed places."""
    from matplotlib.ticker import MaxNLocator

    panel.xaxis.set_major_locator(MaxNLocator(max(int(width / 0.6), 1)))
    panel.yaxis.set_major_locator(MaxNLocator(max(int(height / 0.4), 2)))
    panel.yaxis.set_label_coords((LABEL - GRID_LEFT) / width, 0.5)
    panel.xaxis.set_label_coords(0.5, (LABEL - GRID_BELOW) / height)
    panel.yaxis.get_offset_text().set_x((EDGE - GRID_LEFT) / width)


def power_of_ten(value: float, _: object = None) -> str:
    """A tick of a logarithmic axis as plain text, 10⁻³, which is drawn much faster than a formula."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{abs(value):.6e}".split("e")
    if float(mantissa) != 1:
        return f"{value:g}"
    return f"{'−' if value < 0 else ''}{ten_to(int(exponent))}"


def ten_to(exponent: int) -> str:
    """A power of ten in plain text: 10⁻³."""
    return f"10{str(exponent).translate(_SUPERSCRIPT)}"


def _place_labels(panel: Axes, width: float, height: float) -> None:
    """Labels of the axes at fixed places, and the power of ten of all ticks where no title is."""
    panel.yaxis.set_label_coords((LABEL - LEFT) / width, 0.5)
    panel.xaxis.set_label_coords(0.5, (LABEL - BOTTOM) / height)
    panel.yaxis.get_offset_text().set_x((EDGE - LEFT) / width)
