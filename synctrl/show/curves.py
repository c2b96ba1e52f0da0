"""Panels of curves over time: of one run, or of several on top of one another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..checks import instance
from ..errors import InputError
from ..simulation.result import Result
from . import plots
from .legends import columns_that_fit, fitted, legend, legend_rows, plain
from .look import in_look
from .panels import GAP, LEFT, LEGEND, RIGHT, TITLE, stacked_panels
from .style import DESIRED, PALETTE, line_style, robot_color

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: height of a panel, inches
PANEL = 1.5
#: so many names may a line style of an overlay have
MOST_NAMES = 2


class Curves(NamedTuple):
    """What one panel shows over time.

    Attributes:
        title: above it.
        label: of the vertical axis.
        values: (T, k).
        names: what the legend calls the k curves.
        levels: values that are drawn as a dashed line in the colour of each curve, if any.
    """

    title: str
    label: str
    values: np.ndarray
    names: list[str]
    levels: Sequence[tuple[float, ...]] = ()


def curves_figure(
    result: Result, curves: Sequence[Curves], width: float | None = None, style: str | None = None
) -> Figure:
    """A panel for each group of curves, with a title and a legend of its own; see `look_of`."""
    return in_look(style, width, partial(_panels, result, curves))


def _panels(result: Result, curves: Sequence[Curves], width: float) -> Figure:
    room = width - LEFT - RIGHT
    rows = [-(-len(c.names) // columns_that_fit([plain(n) for n in c.names], room)) for c in curves]
    above = [GAP + TITLE + LEGEND * count for count in rows]
    figure, panels = stacked_panels([PANEL] * len(curves), above, width)
    for panel, shown in zip(panels, curves, strict=True):
        handles = _draw(panel, result, shown)
        plots.shade_disturbances(panel, result)
        panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), **fitted(handles, room))
        y = 1 + LEGEND * legend_rows(handles, room) / PANEL  # above the legend
        panel.set_title(plots.titled(shown.title, width), loc="left", y=y)
        panel.set_ylabel(shown.label)
    return figure


def _draw(panel: Axes, result: Result, shown: Curves) -> list[Any]:
    lines = []
    for k, name in enumerate(shown.names):
        color, look = robot_color(k), line_style(k // len(PALETTE))  # another line where colours repeat
        lines += panel.plot(result.t, shown.values[:, k], ls=look, color=color, label=plain(name))
    _draw_levels(panel, shown, PALETTE)
    return lines


def _draw_levels(panel: Axes, shown: Curves, colors: Sequence[str] = (DESIRED,)) -> None:
    """Levels as dashed lines, in the colours of their curves if these have some."""
    for k, levels in enumerate(shown.levels):
        for level in levels:
            panel.axhline(level, ls=(0, (5, 3)), color=colors[k % len(colors)], linewidth=0.9)


def overlay(
    curves_of: Callable[[Result], Sequence[Curves]],
    runs: Mapping[str, Result],
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """The same curves of several runs in the same panels: colour is the run, line style the curve.

    Args:
        curves_of: what is drawn of a run, such as `assembly_figures.internal_force_curves`.
        runs: by name; each is drawn as far as it goes.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: no runs, or runs with other curves than the first.
    """
    drawn = {name: list(curves_of(run)) for name, run in named(runs).items()}
    first = next(iter(drawn.values()))
    layers = [(run, _alike(own, first)) for run, own in zip(runs.values(), drawn.values(), strict=True)]
    return in_look(style, width, partial(_layers, list(drawn), layers))


def _layers(names: Sequence[str], layers: Sequence[tuple[Result, Sequence[Curves]]], width: float) -> Figure:
    from matplotlib.lines import Line2D

    first = layers[0][1]
    count, styles = len(first), _style_names(first)
    handles = [Line2D([], [], color=robot_color(i), label=plain(name)) for i, name in enumerate(names)]
    for k, name in enumerate(styles or ()):
        handles.append(Line2D([], [], color="#555555", ls=line_style(k), label=plain(name)))
    above = [LEGEND * legend_rows(handles, width) + TITLE, *[TITLE] * (count - 1)]
    figure, panels = stacked_panels([PANEL] * count, above, width)
    for i, (run, own) in enumerate(layers):
        for panel, shown in zip(panels, own, strict=True):
            for k, values in enumerate(shown.values.T):
                panel.plot(run.t, values, ls=line_style(k), color=robot_color(i))
            _draw_levels(panel, shown)
            panel.set_ylabel(shown.label)
            title = _styled(shown) if styles is None else shown.title
            panel.set_title(plots.titled(title, width), loc="left")
    legend(figure, handles)
    return figure


def named(runs: Mapping[str, Result]) -> Mapping[str, Result]:
    """The runs, if they are some by name.

    Raises:
        InputError: they are not.
    """
    instance("runs", runs, Mapping, "runs by name")
    if not runs:
        raise InputError("expected at least one run, found none", subject="runs")
    for name, run in runs.items():
        instance(f"runs, {name!r}", run, Result, "a Result")
    return runs


def _alike(own: Sequence[Curves], first: Sequence[Curves]) -> Sequence[Curves]:
    """The curves of a run, if they are those of the first one."""
    shapes, expected = ([(c.title, c.label, c.names) for c in some] for some in (own, first))
    if shapes != expected:
        raise InputError("expected runs with the same curves", subject="runs", found=shapes)
    return own


def _style_names(panels: Sequence[Curves]) -> list[str] | None:
    """What every line style stands for, if that is much the same in all panels; else None.

    None at all where no panel has more than one curve.
    """
    most = max(len(each.names) for each in panels)
    if most == 1:
        return []
    columns = [[*dict.fromkeys(each.names[k] for each in panels if k < len(each.names))] for k in range(most)]
    return [" or ".join(names) for names in columns] if max(map(len, columns)) <= MOST_NAMES else None


def _styled(shown: Curves) -> str:
    """The title of a panel whose line styles are those of its curves."""
    if len(shown.names) < 2:
        return shown.title
    marks = ("solid", "dash-dot", "dotted", "dashed")
    return f"{shown.title}: " + ", ".join(f"{n} {m}" for n, m in zip(shown.names, marks, strict=False))
