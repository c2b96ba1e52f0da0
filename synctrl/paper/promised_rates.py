"""Blocks of the page on Theorem C: at what rate small errors fall once the motion is over, and fell."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..analysis.exponential_rate import ExponentialRate, RatesOverGamma, exponential_rate, rates_over_gamma
from ..experiments.a460_pair import MOTION_TIME, a460_pair
from ..experiments.planar_four import planar_four
from ..show.rate_figures import rates_figure
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .report import Block, Text, as_picture, number
from .trend import trend

#: a motion that rests has any period, s
PERIOD = 0.05
#: of Gamma, in the figure
FACTORS = np.geomspace(0.1, 100.0, 13)


def promised_rates(a460: Mapping[str, Result], planar: Mapping[str, Result], stem: Path) -> list[Block]:
    """What Theorem C says of both cells; the figure is written to `<stem>.svg`.

    Args:
        a460: runs `left_gravity`, without friction, and `left_both`, with it.
        planar: run `synchronized`.
        stem: of the figure.
    """
    resting = a460_pair(friction=False)
    rate = exponential_rate(resting, PERIOD, MOTION_TIME)
    rates = rates_over_gamma(resting, PERIOD, FACTORS, MOTION_TIME)
    figure = rates_figure({"A460 pair at rest, without friction": rates})
    return [
        Text(_THEOREM_C),
        Text(about_a460(rate, a460)),
        as_picture(figure, stem, rates_caption(rates)),
        Text(about_planar(planar["synchronized"], planar_four())),
    ]


def about_a460(rate: ExponentialRate, runs: Mapping[str, Result]) -> str:
    """The rate at rest beside those of the runs, in words."""
    seen = {name: late_rate(runs[name]) for name in ("left_gravity", "left_both")}
    length = runs["left_gravity"].t[-1]
    return (
        f"The A460 pair is at rest from {MOTION_TIME:g} s on. Without friction small errors then fall at "
        f"{number(rate.excited_rate)} 1/s; slowest: {rate.slowest}. {len(rate.unexcited)} combinations of "
        "base parameters are not excited at rest, and not learned there. In the runs the tracking error "
        f"falls, over the later half of {length:g} s, at {number(seen['left_gravity'])} 1/s without friction "
        f"and at {number(seen['left_both'])} 1/s with it."
    )


def rates_caption(rates: RatesOverGamma) -> str:
    """What the figure shows, and what the paper's Gamma is beside the best, in words."""
    own = float(np.interp(1.0, rates.factors, rates.rates))
    return (
        "Rate of small errors over Γ, of all that the motion excites. The paper's Γ gives "
        f"{number(own)} 1/s, the best of these, {number(rates.best)} times as much, "
        f"{number(rates.rates.max())} 1/s."
    )


def about_planar(run: Result, experiment: Experiment) -> str:
    """What sets the late rate of the planar arms, beside what it was."""
    motion = experiment.cell.members[0].trajectory.rate  # type: ignore[attr-defined]
    return (
        "The desired motion of the four planar arms neither repeats nor comes to rest: it ends "
        f"exponentially and keeps making errors until then. Over the later half of {run.t[-1]:g} s the "
        f"tracking error falls at {number(late_rate(run))} 1/s; the motion ends at {motion:g} 1/s, and Λ is "
        f"{np.min(experiment.gains.Lambda):g} 1/s. At rest nothing is learned, for without gravity the "
        "regressor of arms that do not move is zero."
    )


def late_rate(run: Result) -> float:
    """Rate of the tracking error over the later half of a run, 1/s."""
    return trend(run.t, run.tracking_error).rate


_THEOREM_C = (
    "Theorem C: along a desired motion that repeats or rests, small errors of motion and of parameters obey "
    "linear equations, whose slowest multiplier is the rate at which they fall in the end."
)
