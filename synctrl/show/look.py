"""How figures look, in which style and size, and how they are written to files.

Everything in a figure grows with its style: a figure is laid out in plain inches, of which the words that are
in it need always the same, and is then made smaller or larger as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from threading import RLock
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import choice, finite_number
from ..errors import InputError, ResultError
from ..files import whole_file
from . import legends
from .panels import DPI, WIDTH
from .style import PALETTE

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

#: of titles, of labels of axes and of all else, points
TITLE_SIZE, LABEL_SIZE, SIZE = 10, 9, 9
#: the narrowest figure in which all words have their place, in plain inches
NARROWEST = 3.0
#: the marks of the colours of `PALETTE`, how large they are and how wide their lines may be, points, and how
#: far apart they are on a line, as a share of the diagonal of its panel
MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")
MARK_SIZE, MARKED_LINE, MARK_EVERY = 3.9, 1.2, 0.17
#: what of a figure has a size in points, beside its words and lines
_TICK = {"major.size": 3.5, "major.width": 0.8, "major.pad": 3.5}
_TICK |= {"minor.size": 2.0, "minor.width": 0.6, "minor.pad": 3.4}
_SIZED = {
    "axes.linewidth": 0.8,
    "grid.linewidth": 0.7,
    "axes.titlepad": 6.0,
    **{f"{axis}tick.{part}": size for axis in "xy" for part, size in _TICK.items()},
}


@dataclass(frozen=True)
class Look:
    """How a figure looks.

    Attributes:
        width: of the figure, inches.
        scale: how large words, lines and margins are, beside those of a plain figure.
        marked: whether lines of different colours have different marks, to be told apart in grey.
        family: of the words, and those of what it does not have.
        dpi: of pictures in pixels.
        formats: in which a gallery is written.
    """

    width: float = WIDTH
    scale: float = 1.0
    marked: bool = False
    family: tuple[str, ...] = ("DejaVu Sans",)
    dpi: int = DPI
    formats: tuple[str, ...] = ("png", "svg")

    @property
    def room(self) -> float:
        """The width in plain inches: what is laid out in it is `scale` times as large in the figure."""
        return self.width / self.scale


#: the look of a figure that has no style
PLAIN = Look()
#: looks by name: a column of a journal, in Times and 8 points; and slides, to be read from the last row
STYLES: Mapping[str, Look] = MappingProxyType(
    {
        "ieee": Look(3.5, 8 / 9, True, ("STIXGeneral", "DejaVu Sans"), 300, ("pdf", "png")),
        "slides": Look(10.0, 10.0 / WIDTH),
    }
)


def look_of(style: str | None, width: float | None) -> Look:
    """The look of a style, in a width, inches; by default its own.

    Raises:
        InputError: an unknown style, or a width in which words have no place.
    """
    look = PLAIN if style is None else STYLES[choice("style", style, tuple(STYLES))]
    if width is None:
        return look
    least = NARROWEST * look.scale
    if not finite_number("width", width) >= least:
        raise InputError.expected(f"at least {least:.3g} inches", width, "width")
    return replace(look, width=float(width))


def in_look(style: str | None, width: float | None, draw: Callable[[float], Figure]) -> Figure:
    """A figure in a style.

    Args:
        style, width: see `look_of`.
        draw: makes the figure, as wide as it is told, in plain inches.
    """
    look = look_of(style, width)
    with drawing(look):
        return finished(draw(look.room), look)


# -- settings of matplotlib -------------------------------------------------------------------------------

#: held while a thread draws
_drawing = RLock()


@contextmanager
def drawing(look: Look) -> Iterator[None]:
    """A look for the figures made inside; what was set before comes back after.

    Threads draw one after another, for what matplotlib looks up holds for the whole process.
    """
    from matplotlib import rc_context

    with _drawing, rc_context({**_look(), **_sizes(look)}):
        yield


def style() -> AbstractContextManager[None]:
    """This package's look for the figures made inside, see `drawing`."""
    return drawing(PLAIN)


@cache
def _look() -> Any:
    """The package's own settings, and matplotlib's own for all else."""
    from matplotlib import rc_params_from_file, rcParamsDefault

    ours = rc_params_from_file(Path(__file__).with_name("figures.mplstyle"), use_default_template=False)
    return {**{k: v for k, v in rcParamsDefault.items() if k != "backend"}, **ours}


def _sizes(look: Look) -> Any:
    """What a look sets beside the style sheet: sizes, letters, and the colours of whatever has none."""
    from matplotlib.rcsetup import cycler

    words = {
        "font.size": SIZE,
        "axes.titlesize": TITLE_SIZE,
        "axes.labelsize": LABEL_SIZE,
        "legend.fontsize": legends.SIZE,
    }
    sizes = {name: look.scale * size for name, size in {**words, **_SIZED}.items()}
    return {**sizes, "font.family": [*look.family], "axes.prop_cycle": cycler(color=PALETTE)}


def new_figure(
    height: float, rows: int = 1, columns: int = 1, *, width: float = WIDTH, **options: Any
) -> tuple[Figure, np.ndarray]:
    """A figure, its size in inches, and its axes, (rows, columns); to be called within `style`.

    It arranges itself around its labels, for which it measures all of them: `stacked_panels` need not.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


# -- a figure that was laid out in plain inches -----------------------------------------------------------


def finished(figure: Figure, look: Look) -> Figure:
    """The figure in the size of its look, its lines with it, and with marks; it is saved in this look."""
    width, height = figure.get_size_inches()
    figure.set_size_inches(look.scale * width, look.scale * height)
    figure.set_dpi(look.dpi)
    curves = [line for panel in figure.axes for line in panel.get_lines()]
    legends_of = [*figure.legends, *filter(None, (panel.get_legend() for panel in figure.axes))]
    entries = [line for legend in legends_of for line in legend.get_lines()]
    for line in (*curves, *entries):
        line.set_linewidth(look.scale * line.get_linewidth())
        line.set_markersize(look.scale * line.get_markersize())
    if look.marked:
        _mark(curves, entries, look.scale)
    figure.savefig = partial(_saved, figure, look)  # type: ignore[method-assign]
    return figure


def _mark(curves: Iterable[Line2D], entries: Iterable[Line2D], scale: float) -> None:
    """Give lines the marks of their colours, at equal distances, and those of legends too.

    Levels, which have two points, and what has marks already stay as they are.
    """
    for line in curves:
        if np.size(line.get_xdata()) > 2 and (k := _number(line)) is not None:
            line.set_markevery((MARK_EVERY * k / len(PALETTE), MARK_EVERY))
            _set_mark(line, k, scale)
    for line in entries:
        if (k := _number(line)) is not None:
            _set_mark(line, k, scale)


def _set_mark(line: Line2D, k: int, scale: float) -> None:
    line.set(marker=MARKS[k], markersize=scale * MARK_SIZE, markeredgewidth=0.0)
    line.set_linewidth(min(line.get_linewidth(), scale * MARKED_LINE))


def _number(line: Line2D) -> int | None:
    """Which colour of `PALETTE` an unmarked line has; None for others."""
    from matplotlib.colors import to_hex

    color = to_hex(line.get_color())
    bare = line.get_marker() in ("", "None", None) and line.get_linestyle() != "None"
    return PALETTE.index(color) if bare and color in PALETTE else None


# -- files ------------------------------------------------------------------------------------------------

#: the next levels take twice the time and more for files that are a few kB smaller
_PNG = {"compress_level": 2}
#: what is given to matplotlib for each format, so that the same figure gives the same bytes
FORMATS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "png": {"metadata": {"Software": None}, "pil_kwargs": _PNG},
        "svg": {"metadata": {"Date": None, "Creator": None}},
        "pdf": {"metadata": {"CreationDate": None, "Creator": None, "Producer": None}},
    }
)


def save(figure: Figure, stem: str | Path, formats: Sequence[str] = ("png", "svg")) -> tuple[Path, ...]:
    """Write a figure as `<stem>.png` and `<stem>.svg`, or in other formats: the same bytes every time.

    Args:
        figure: the figure.
        stem: path of the files without what their names end with; the folder is made.
        formats: "png", "svg", "pdf". In PDF fonts are embedded as TrueType, as journals ask.

    Raises:
        InputError: an unknown format.
        ResultError: a file cannot be written.
    """
    chosen = [choice("format", each, tuple(FORMATS)) for each in formats]
    paths = {each: Path(f"{stem}.{each}") for each in chosen}
    with _arranged(figure, stem), ExitStack() as files:
        opened = {each: files.enter_context(whole_file(path)) for each, path in paths.items()}
        for each, file in opened.items():
            figure.savefig(file, format=each, **FORMATS[each])
    return tuple(paths.values())


def save_svg(figure: Figure, stem: str | Path) -> Path:
    """Write a figure as `<stem>.svg` alone, for a page; otherwise as `save`."""
    return save(figure, stem, ("svg",))[0]


def _saved(figure: Figure, look: Look, file: Any, **options: Any) -> None:
    """`savefig` of a figure, in its own look, whatever is set where it is called."""
    with drawing(look):
        type(figure).savefig(figure, file, **options)


@contextmanager
def _arranged(figure: Figure, stem: str | Path) -> Iterator[None]:
    """Arrange a figure once for all of its files, and name them if they cannot be written."""
    try:
        with style():
            if engine := figure.get_layout_engine():
                engine.execute(figure)
                figure.set_layout_engine("none")
            yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise ResultError(f"cannot write the figure '{stem}': {reason}", file=stem, found=reason) from error
