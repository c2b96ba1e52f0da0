"""Runs laid on one another: every quantity of several runs in the same panels, a colour for each run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

from ..analysis.metrics import row_names
from ..checks import choice
from ..errors import InputError
from ..simulation.result import Result
from . import plots
from .assembly_figures import CURVES, has
from .curves import Curves, named, overlay
from .look import look_of
from .network_figures import traffic_curves
from .run_figures import Gallery, torque_curves
from .runs import check_run
from .style import display

#: so many curves of one run have line styles that can be told apart at a glance; of more each has a panel
MOST_STYLES = 4


def tracking_error_curves(result: Result) -> list[Curves]:
    """Tracking errors, a panel for each robot and unit."""
    return _by_row(result, "tracking_error", row_names(result, "tracking_error"), "e")


def sync_error_curves(result: Result) -> list[Curves]:
    """Synchronization errors, a panel for each pair and unit."""
    names = [f"pair {name}" for name in row_names(result, "sync_error")]
    return _by_row(result, "sync_error", names, "ε")


def path_curves(result: Result) -> list[Curves]:
    """Actual coordinates, a panel for each robot and unit."""
    return _by_row(result, "x", result.names, "actual")


#: what can be laid on one another, by the name of its figure
OVERLAYS: Mapping[str, Callable[[Result], Sequence[Curves]]] = MappingProxyType(
    {
        "tracking_error": tracking_error_curves,
        "sync_error": sync_error_curves,
        "torque": torque_curves,
        "path": path_curves,
        "traffic": traffic_curves,
        **{name: curves for name, (_, curves) in CURVES.items()},
    }
)
#: those of any run
ALWAYS = ("tracking_error", "sync_error", "torque", "path")


def overlays(
    runs: Mapping[str, Result], *names: str, width: float | None = None, style: str | None = None
) -> Gallery:
    """Figures of several runs on one another: colour is the run, line style the coordinate or joint.

    `overlays({"synchronized": together, "independent": alone}, "sync_error").save("figures")` writes one.

    Args:
        runs: by name, all of cells with the same robots, coordinates and pairs; each as far as it goes.
        names: which ones, see `OVERLAYS`; by default errors, torques and paths, and all else that every one
            of the runs has.
        width, style: of the figures, see `look.look_of`.

    Raises:
        InputError: no runs, an unknown name, or runs that have not the same curves.
    """
    every = [*named(runs).values()]
    found = Gallery(" and ".join(map(str, runs)), look_of(style, width).formats)
    for name in names or (*ALWAYS, *(each for each in OVERLAYS if all(_has(run, each) for run in every))):
        curves_of = OVERLAYS[choice("figure", name, tuple(OVERLAYS))]
        found[name] = overlay(partial(_apart, curves_of), runs, width=width, style=style)
    return found


def _has(result: Result, name: str) -> bool:
    """Whether a run has what one of `OVERLAYS` shows that not every run has."""
    return "message_age" in result.outputs if name == "traffic" else name in CURVES and has(result, name)


def _apart(curves_of: Callable[[Result], Sequence[Curves]], result: Result) -> list[Curves]:
    """The panels of a run, with one for each curve where they have more than line styles can tell apart."""
    found: list[Curves] = []
    for each in curves_of(result):
        if len(each.names) <= MOST_STYLES:
            found.append(each)
            continue
        for k, name in enumerate(each.names):
            levels = [each.levels[k]] if each.levels else []
            found.append(Curves(f"{each.title}: {name}", each.label, each.values[:, [k]], [name], levels))
    return found


def _by_row(result: Result, kind: str, names: Sequence[str], symbol: str) -> list[Curves]:
    check_run(result, kind)
    values, units = getattr(result, kind), result.units(kind)
    if not names:
        raise InputError(
            "expected robots that are compared, found none", subject=f"run '{result.info['title']}'"
        )
    found = []
    for row, name in enumerate(names):
        for unit, columns in plots.columns_by_unit(units[row]).items():
            shown, factor = display(unit)
            axes = [result.info["axes"][k] for k in columns]
            found.append(Curves(name, f"{symbol}, {shown}", factor * values[:, row, columns], axes))
    return found
