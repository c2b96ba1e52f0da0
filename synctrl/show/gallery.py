"""All figures of a run by name, which a notebook shows one below the other."""

from __future__ import annotations

import base64
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..checks import finite_number
from ..errors import InputError, SynctrlError
from ..simulation.result import Result
from ..simulation.views import FIGURES, find_figure
from .panels import WIDTH
from .plots import save, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: the narrowest figure in which all words have their place, inches
NARROWEST = 3.0


class Gallery(dict[str, "Figure"]):
    """Figures by name.

    Attributes:
        missing: what is not shown, by name, and why.
    """

    def __init__(self, title: str) -> None:
        super().__init__()
        self.title = title
        self.missing: dict[str, str] = {}

    def save(self, folder: str | Path) -> list[Path]:
        """Write every figure as `<name>.png` and `<name>.svg` into a folder, which is made.

        Raises:
            ResultError: a file cannot be written.
        """
        return [file for name, figure in self.items() for file in save(figure, Path(folder) / name)]

    def _repr_html_(self) -> str:
        """All figures for a notebook, and what is missing."""
        pictures = "".join(
            f'<img alt="{escape(name)}" style="max-width: 100%" src="data:image/png;base64,{_png(figure)}">'
            for name, figure in self.items()
        )
        words = "".join(f"<p>{escape(line)}</p>" for line in self._missing_lines())
        return f"<div>{pictures}{words}</div>"

    def _missing_lines(self) -> list[str]:
        return [f"Not shown: {name}: {reason}" for name, reason in self.missing.items()]

    def __repr__(self) -> str:
        return "\n".join([f"Figures of '{self.title}': {', '.join(self)}", *self._missing_lines()])


def gallery(result: Result, *names: str, width: float = WIDTH) -> Gallery:
    """The figures of a run.

    Args:
        result: the run.
        names: which ones, see `FIGURES`; by default all. What a run does not have is then left out and named
            in `missing`.
        width: of all figures, inches.

    Raises:
        InputError: an unknown name, a figure that was asked for by name and cannot be drawn, none that can,
            or a width below `NARROWEST`.
    """
    if not finite_number("width", width) >= NARROWEST:
        raise InputError(f"expected at least {NARROWEST:g} inches, found {width:g}", subject="width")
    found = Gallery(str(result.info["title"]))
    for name in names or FIGURES:
        try:
            found[name] = find_figure(name)(result, width=width)
        except SynctrlError as error:
            if names or (len(found.missing) + 1 == len(FIGURES)):
                raise
            found.missing[name] = str(error)
    if "torque" in found:
        found.missing.update(_missing_limits(result))
    return found


def _missing_limits(result: Result) -> dict[str, str]:
    unknown = [robot["name"] for robot in result.info["robots"] if "torque_limits" not in robot]
    return {"torque limits": f"the result does not say those of {', '.join(unknown)}"} if unknown else {}


def _png(figure: Figure) -> str:
    pixels = BytesIO()
    with style():
        figure.savefig(pixels, format="png")
    return base64.b64encode(pixels.getvalue()).decode()
