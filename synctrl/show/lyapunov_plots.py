"""Figures of the proof: V and its terms, V' and its terms."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ..analysis.growth import Growth
from ..analysis.lyapunov import Lyapunov, lyapunov
from ..analysis.replay import replay
from ..renamed import names_elsewhere
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .legends import columns_that_fit, fitted
from .look import in_look
from .panels import GAP, LEFT, LEGEND, RIGHT, power_of_ten, stacked_panels
from .runs import check_run
from .style import ACCENT, DESIRED, PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: names of terms and their colours
Terms: TypeAlias = list[tuple[str, str]]
#: height of a panel, inches
PANEL = 2.0
#: terms that never exceed this share of the largest are left out
VISIBLE = 1e-9
#: powers below this share of the largest are drawn on a linear scale
LINEAR = 1e-4


def lyapunov_terms(
    result: Result,
    experiment: Experiment | None = None,
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """V and V' of a run with their terms, see `lyapunov_figure`; it goes through the run once more.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: no experiment, or another than the one that made the result.
    """
    check_run(result, "q", "v", "tau")
    return lyapunov_figure(lyapunov(replay(result, experiment)), width=width, style=style)


def lyapunov_figure(record: Lyapunov, *, width: float | None = None, style: str | None = None) -> Figure:
    """V with its terms above, on a logarithmic scale, and V' with its terms below, signs kept.

    Args:
        record: of `synctrl.analysis.lyapunov.lyapunov`.
        width, style: of the figure, see `look.look_of`.
    """
    return in_look(style, width, partial(_terms, record))


def _terms(record: Lyapunov, width: float) -> Figure:
    room = width - LEFT - RIGHT
    energies, powers = (_visible(terms) for terms in (record.energy, record.power))
    drawn = zip((energies, powers), ("V", "V'"), strict=True)
    columns = [columns_that_fit([*(name for name, _ in terms), total], room) for terms, total in drawn]
    rows = [-(-(len(terms) + 1) // c) for terms, c in zip((energies, powers), columns, strict=True)]
    figure, panels = stacked_panels([PANEL, PANEL], [GAP + LEGEND * count for count in rows], width)
    _energies(panels[0], record, energies)
    _powers(panels[1], record, powers)
    for panel in panels:
        panel.yaxis.set_major_formatter(power_of_ten)
        handles = panel.get_legend_handles_labels()[0]
        panel.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), **fitted(handles, room))
    return figure


def growth_mark(figure: Figure, growth: Growth) -> Figure:
    """Mark the first instant at which V grows in a figure of `lyapunov_figure`, and name the term."""
    for panel in figure.axes:
        panel.axvline(growth.time, color=ACCENT, linewidth=1.0, linestyle=":")
    figure.axes[0].annotate(
        f"V grows: {growth.term}",
        (growth.time, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(4, 0),
        textcoords="offset points",
        fontsize=8,
        color=ACCENT,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )
    return figure


def _energies(panel: Axes, record: Lyapunov, shown: Terms) -> None:
    panel.set_yscale("log")
    floor = VISIBLE * float(record.V.max())
    for name, color in shown:
        panel.plot(record.t, np.maximum(record.energy[name], floor), color=color, label=name)
    panel.plot(record.t, record.V, color=DESIRED, linewidth=2.0, label="V", zorder=1)
    panel.set_ylim(bottom=floor)
    panel.set_ylabel("V and its terms, N·m")


def _powers(panel: Axes, record: Lyapunov, shown: Terms) -> None:
    largest = float(np.abs(list(record.power.values())).max())
    linear = max(LINEAR * largest, float(record.rounding.max()), 1e-300)
    # a power of ten, so that zero is as far from the first tick as that is from the next
    panel.set_yscale("symlog", linthresh=10.0 ** np.ceil(np.log10(linear)))
    for name, color in shown:
        inside = "-" if name in record.inside else "--"
        panel.plot(record.t, record.power[name], inside, color=color, label=name)
    panel.plot(record.t, record.V_dot, color=DESIRED, linewidth=2.0, label="V'", zorder=1)
    panel.axhline(0.0, color="#8a929c", linewidth=0.8)
    panel.set_ylabel("V' and its terms, W")


def _visible(terms: Mapping[str, np.ndarray]) -> Terms:
    """Names of the terms that can be seen, each with the colour it has in all figures."""
    sizes = {name: float(np.abs(terms[name]).max()) for name in terms}
    floor = VISIBLE * max(sizes.values())
    return [(name, PALETTE[k % len(PALETTE)]) for k, name in enumerate(terms) if sizes[name] > floor]


__getattr__ = names_elsewhere(__name__, "..analysis.lyapunov", "ENERGIES", "POWERS", "THEOREM")
