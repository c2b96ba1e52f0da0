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
