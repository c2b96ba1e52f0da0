"""What is left of the A460's errors after the motion, and of what: friction, gravity, both, neither."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..show.panels import power_of_ten
from ..show.plots import new_figure, style
from ..show.style import display, robot_color
from ..simulation.result import Result
from .claims import MUCH, Claim, Finding, need
from .report import Picture, as_picture, number
from .trend import trend

#: of the windows in which errors are compared, s
WINDOW = 0.5
#: smaller errors are not drawn: there is nothing to see below rounding; rad
FLOOR = 1e-7
#: what acts in each run, in words
CAUSES: Mapping[str, str] = {
    "left_both": "friction and gravity",
    "left_friction": "friction alone",
    "left_gravity": "gravity alone",
    "left_neither": "neither",
}


def offsets_are_due_to_friction_and_gravity(runs: Mapping[str, Result]) -> Claim:
    """In every half second after the motion, each cause alone and both leave much more than neither."""
    found = dict(zip(CAUSES, need(runs, *CAUSES), strict=True))
    sizes = {name: after_the_motion(run)[1] for name, run in found.items()}
    *causes, neither = sizes
    factors = {name: float((sizes[name] / sizes[neither]).min()) for name in causes}
    figures = [Finding(f"{CAUSES[name]} / neither, smallest factor", factors[name]) for name in causes]
    figures += [Finding(f"rate of the error, {CAUSES[name]}", _rate(found[name]), "1/s") for name in causes]
    slowest = min(causes, key=lambda name: _rate(found[name]))
    return Claim(
        "“Due to the effects caused by friction and gravity, there exist residual offsets in the robot "
        "positions.”",
        "section V-A",
        bool(min(factors.values()) >= MUCH),
        tuple(figures),
        f"Asked: in every half second from the end of the motion on, the largest tracking error with either "
        f"cause alone, and with both, is at least {MUCH:g} times that with neither. Friction is not in the "
        "regressor Y; gravity is, and the adaptation takes it up. Rates are those of the later half of "
        f"{found[neither].t[-1]:g} s: slowest with {CAUSES[slowest]}.",
    )


def after_the_motion(run: Result) -> tuple[np.ndarray, np.ndarray]:
    """Ends, s, of windows of half a second after the motion, and the largest |e| in each; at least one."""
    t, e = run.t, np.abs(run.tracking_error).max(axis=(1, 2))
    start = t[np.isclose(run.x_desired, run.x_desired[-1], rtol=0, atol=1e-9).all(axis=(1, 2))][0]
    ends = np.arange(start + WINDOW, t[-1] + 1e-9, WINDOW)
    if not len(ends):
        return t[-1:], e[-1:]
    return ends, np.array([e[(t > end - WINDOW) & (t <= end)].max() for end in ends])


def offsets_picture(runs: Mapping[str, Result], stem: Path) -> Picture:
    """What is left over time, for each cause; written to `<stem>.svg`."""
    unit, factor = display(runs["left_both"].unit("tracking_error"))
    with style():
        figure, ((panel,),) = new_figure(3.2, width=8.4)
        for k, (name, words) in enumerate(CAUSES.items()):
            t, sizes = after_the_motion(runs[name])
            panel.semilogy(t, factor * np.maximum(sizes, FLOOR), color=robot_color(k), label=words)
        panel.set(xlabel="time, s", ylabel=f"largest |e|, {unit}")
        panel.yaxis.set_major_formatter(power_of_ten)
        panel.margins(x=0)
        figure.legend(handles=panel.get_lines(), loc="outside lower center", ncols=4)
    return as_picture(figure, stem, caption(runs))


def caption(runs: Mapping[str, Result]) -> str:
    """What the figure shows, in words made from the runs."""
    unit, factor = display(runs["left_both"].unit("tracking_error"))
    ends = {name: factor * after_the_motion(runs[name])[1][-1] for name in CAUSES}
    told = [
        f"{words}: {number(ends[name])} {unit} at the end{_falling(runs[name], ends[name])}"
        for name, words in CAUSES.items()
    ]
    return f"Largest tracking error after the motion, in windows of {WINDOW:g} s. {'; '.join(told)}."


def _falling(run: Result, end: float) -> str:
    """The rate in words; nothing where only rounding is left."""
    factor = display(run.unit("tracking_error")).factor
    return f", falling at {number(_rate(run), 2)} 1/s" if end > factor * FLOOR else ""


def _rate(run: Result) -> float:
    return trend(run.t, run.tracking_error).rate
