"""How far estimates are from being those of no body, drawn over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..analysis.consistency import Consistency, physical_consistency
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .curves import Curves, curves_figure
from .plots import new_figure, style
from .runs import check_run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def consistency(
    result: Result,
    experiment: Experiment | None = None,
    *,
    width: float | None = None,
    style: str | None = None,
) -> Figure:
    """The smallest eigenvalue of every estimated body over time, a panel for each robot.

    Below the dashed line, which is zero, the estimates are those of no body that can exist.

    Args:
        result: the run.
        experiment: what made it; needed for a result loaded from a file.
        width, style: of the figure, see `look.look_of`.

    Raises:
        InputError: no experiment, or parameters that are not those of bodies.
    """
    check_run(result, "theta_hat")
    found = physical_consistency(result, experiment)
    label = "smallest eigenvalue"
    curves = [
        Curves(name, label, values, [f"body {k + 1}" for k in range(values.shape[1])], [(0.0,)])
        for name, values in zip(found.names, found.smallest, strict=True)
    ]
    return curves_figure(result, curves, width, style)


def consistency_figure(consistency: Consistency) -> Figure:
    """The smallest eigenvalue of every estimated body over time, a panel per robot."""
    with style():
        figure, axes = new_figure(2.9, 1, len(consistency.names), sharey=True)
        for panel, name, values in zip(axes[0], consistency.names, consistency.smallest, strict=True):
            for k, eigenvalue in enumerate(values.T, start=1):
                panel.plot(consistency.t, eigenvalue, label=f"body {k}")
            panel.axhline(0.0, color="#b3001b", lw=0.9, ls="--")
            panel.set(title=name, xlabel="t, s")
        axes[0, 0].set_ylabel("smallest eigenvalue")
        axes[0, 0].legend()
    return figure
