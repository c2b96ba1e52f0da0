"""Formulas as pictures, by matplotlib's own reader of TeX: without LaTeX, the same in every browser."""

from __future__ import annotations

from io import BytesIO

from ..errors import InputError
from ..show.plots import style

SIZE = 14.0  # points


def formula_svg(tex: str) -> bytes:
    """A formula as an SVG picture; the same formula gives the same bytes.

    Args:
        tex: without dollar signs, in the part of TeX that matplotlib knows.

    Raises:
        InputError: matplotlib cannot read it.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import MathTextParser

    font = FontProperties(size=SIZE, math_fontfamily="stix")
    with style():
        try:
            width, height, depth, _, _ = MathTextParser("path").parse(f"${tex}$", dpi=72, prop=font)
        except ValueError as error:
            raise InputError(
                f"expected TeX that matplotlib can read; {error}", subject=f"formula '{tex}'"
            ) from error
        figure = Figure(figsize=(width / 72, height / 72), facecolor="none")
        FigureCanvasSVG(figure)
        figure.text(0, depth / height, f"${tex}$", fontproperties=font)
        file = BytesIO()
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()
