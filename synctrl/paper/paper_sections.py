"""The sections of the page on the paper: introduction, the A460 pair, the four planar arms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.metrics import Metrics, metrics, row_names, settling_bands, squared
from ..show.layout import cell_layout
from ..show.plots import common_limits, joint_trajectories, save, sync_errors, tracking_errors
from ..show.style import display
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .claims import Claim, tally
from .claims import kind as kind_of
from .claims_of_cells import a460_claims, planar_four_claims
from .offsets import offsets_picture
from .report import (
    Block,
    Formulas,
    Links,
    Picture,
    Section,
    SideBySide,
    Table,
    Text,
    Verdicts,
    number,
)
from .wrists import about_wrists

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LAW = (
    (r"e_i = x_i^d - x_i", "tracking error", "(1)"),
    (r"\epsilon_k = \sum_i S_{ki}\, c_i e_i", "synchronization error of pair k", "(7), (28)"),
    (r"e^*_i = c_i e_i + \beta \sum_k S_{ki} \int\epsilon_k\, dt", "coupled error", "(10), (29)"),
    (
        r"u_i = c_i \dot x_i^d + \dot c_i e_i + \beta \sum_k S_{ki}\, \epsilon_k + \Lambda e^*_i",
        "command",
        "(11), (30)",
    ),
    (
        r"r_i = u_i - c_i \dot x_i = \dot e^*_i + \Lambda e^*_i, \quad s_i = J_i^{-1} c_i^{-1} r_i",
        "coupled velocity error, and the same in joint space",
        "(12), (31)",
    ),
    (
        r"\tau_i = Y_i \hat\theta_i + K_r s_i + J_i^T c_i^T K_\epsilon \sum_k S_{ki}\, \epsilon_k",
        "torque",
        "(13), (32)",
    ),
    (r"\dot{\hat\theta}_i = \Gamma\, Y_i^T s_i", "adaptation", "(14)"),
)


def introduction(claims: Sequence[Claim], runs: Mapping[str, Result]) -> Section:
    """What this page is, the law, what made the runs, and how many of the claims hold."""
    failed = [claim.text for claim in claims if not claim.holds]
    verdict = " ".join([tally(claims), *(f"Does not hold: “{text}”" for text in failed)])
    words = (_ABOUT, Formulas(LAW), _SYMBOLS, _COMPUTED, Text(made_by(runs)), Text(verdict))
    return Section("What is shown here", words)


def made_by(runs: Mapping[str, Result]) -> str:
    """Which engine made which runs, in words."""
    reference = [name.replace("_", " ") for name, run in runs.items() if run.info["engine"] == "pinocchio"]
    if len(reference) == len(runs):
        return f"All runs are made by the reference engine. {_GONE_THROUGH}"
    those = f"all but {', '.join(reference)}, which the reference engine made" if reference else "all"
    return f"{_COMPILED} {those}. {_GONE_THROUGH}"


_ABOUT = Text(
    "Sun and Mills, “Adaptive Synchronized Control for Coordination of Multirobot Assembly Tasks” (2002), "
    "computed again. Every robot tracks its own path with an adaptive law and couples its error with its "
    "neighbours’, so that tracking and synchronization errors both go to zero. Independent control, the "
    "paper’s comparison, is the same controller with β = K_ε = 0."
)
_SYMBOLS = Text(
    "S says which robots are compared (a pair, or a ring of neighbours), c_i are their weights, Y_i is the "
    "regressor of robot i and θ̂_i its estimate of the parameters."
)
_COMPUTED = Text(
    "Every number on this page was computed when the page was made. The metrics and claims are in "
    "metrics.json as well, in SI units, and the runs themselves in the folder runs. A claim of the paper "
    "that does not hold here says so."
)

_COMPILED = (
    "Runs are made by the compiled engine, which is the closed loop of the reference engine as generated C:"
)
_GONE_THROUGH = (
    "Certificates do not use it: they go through every run again by Pinocchio, which so judges the C as well."
)


def trial_section(duration: float) -> Section:
    """A warning at the top of a page whose runs were cut off."""
    words = (
        f"This page is a trial: no run is longer than {duration:g} s, so nothing had the time to converge. "
        "Figures and verdicts are not those of the whole runs."
    )
    return Section("A trial", (Text(words, "note"),))


def a460_section(
    runs: Mapping[str, Result], experiment: Experiment, folder: Path, animations: Links
) -> Section:
    """Section V-A with figures 2 to 7.

    Args:
        runs: `synchronized`, `independent`, `frictionless`, and those of `offsets_picture`.
        experiment: the synchronized cell, for its wrists.
        folder: where figures go.
        animations: links to those of this cell.
    """
    pair = {kind: runs[kind] for kind in KINDS}
    limits = common_limits("sync_error", *pair.values())
    drawings: Drawings = {
        "Joint angles of robot 1": lambda run: joint_trajectories(run, 0),
        "Joint angles of robot 2": lambda run: joint_trajectories(run, 1),
        "Synchronization errors of the joints": lambda run: sync_errors(run, limits),
    }
    blocks: list[Block] = [_A460, _SYNTHETIC, Text(about_wrists(pair, experiment.cell)), animations]
    blocks += [*_compared(folder, 2, pair, drawings), *metrics_tables(*pair.values())]
    blocks += [Verdicts(tuple(a460_claims(runs))), offsets_picture(runs, folder / "offsets")]
    return Section("Two CRS A460 robots (section V-A)", tuple(blocks))


_A460 = Text(
    "Two arms move a payload along a cubic path; ε = e_1 - e_2 compares their joint errors. Joint angles and "
    "gains are the paper’s. The time of the motion, 2 s, the initial estimate, 0.7 of the true parameters, "
    "and the place of the second base are our choices."
)
_SYNTHETIC = Text(
    "Synthetic data: no published masses, inertias or friction of the A460 were found. Those used here are "
    "invented to be plausible, so the size of the errors is not the paper’s; only their comparison means "
    "something. Friction is in the plant and unknown to the controller.",
    "note",
)


def planar_section(
    runs: Mapping[str, Result], experiment: Experiment, folder: Path, animations: Links
) -> Section:
    """Section V-B with figures 8 to 16.

    Args:
        runs: `synchronized`, `independent`, the two `..._disturbed`, and those of `own_findings`.
        experiment: the synchronized cell, for its layout.
        folder: where figures go.
        animations: links to those of this cell.
    """
    above = "The four arms from above, at the start (pale) and at the end."
    layout = _numbered(folder, 8, cell_layout(runs["synchronized"], experiment), above)
    undisturbed = {kind: runs[kind] for kind in KINDS}
    disturbed = {f"{kind}, disturbed": runs[f"{kind}_disturbed"] for kind in KINDS}
    blocks: list[Block] = [_PLANAR, animations, layout, *_planar_pair(folder, 9, undisturbed)]
    blocks += [_DISTURBANCE, *_planar_pair(folder, 13, disturbed)]
    blocks.append(Verdicts(tuple(planar_four_claims(runs))))
    return Section("Four planar arms (section V-B)", tuple(blocks))


def _planar_pair(folder: Path, first: int, pair: Mapping[str, Result]) -> list[Block]:
    """Figures and metrics of two runs of the four arms that are compared."""
    e, epsilon = (common_limits(kind, *pair.values()) for kind in ("tracking_error", "sync_error"))
    drawings: Drawings = {
        "Position errors": lambda run: tracking_errors(run, e),
        "Synchronization errors": lambda run: sync_errors(run, epsilon),
    }
    return [*_compared(folder, first, pair, drawings), *metrics_tables(*pair.values())]


_PLANAR = Text(
    "Four arms move along circles about the origin and keep their distances; a ring of four pairs compares "
    "neighbours. Tables II and III and the gains are the paper’s. Table II does not give φ; it is 0.1 rad "
    "here, which makes the cell nearly square. On which robots move on the larger circle the text and Table "
    "II disagree; the text is followed. The weights c are lengths, so ε is in m²."
)
_DISTURBANCE = Text(
    "Disturbed: +1 N·m on both joints of robot 1 for 0.5 s ≤ t < 0.75 s. That it acts on both joints is our "
    "choice."
)


def honesty_section(findings: Sequence[Claim], parts: str) -> Section:
    """What the paper leaves unsaid.

    Args:
        findings: ours, with their verdicts.
        parts: what each part of the law does, in words made from the numbers.
    """
    return Section("Said honestly", (_UNSAID, Text(parts), Verdicts(tuple(findings))))


_UNSAID = Text(
    "Without synchronization the paper sets β = K_ε = 0 and leaves all other gains as they are, which takes "
    "gain away. So it is asked what each part does, and what as much gain does without synchronization. "
    "Checked as well: whether estimates stay those of bodies, and whether a law of others does better under "
    "the push."
)


# -- figures ----------------------------------------------------------------------------------------------

KINDS = ("synchronized", "independent")
#: figures that are drawn of each run, by what they show
Drawings = Mapping[str, Callable[[Result], "Figure"]]


def _compared(folder: Path, first: int, runs: Mapping[str, Result], drawings: Drawings) -> list[Block]:
    """A column of figures per run, a row per drawing; as in the paper, they are numbered down the columns."""
    numbers = count(first)
    columns = [
        [_numbered(folder, next(numbers), draw(run), f"{what}, {kind}.") for what, draw in drawings.items()]
        for kind, run in runs.items()
    ]
    return [SideBySide(row) for row in zip(*columns, strict=True)]


def _numbered(folder: Path, k: int, figure: Figure, caption: str) -> Picture:
    _, svg = save(figure, folder / f"figure_{k:02d}")
    return Picture(svg, f"Figure {k}. {caption}")


# -- tables -----------------------------------------------------------------------------------------------


def metrics_tables(ours: Result, theirs: Result) -> list[Table]:
    """Metrics of every robot, pair and axis, synchronized against independent, and peak torques."""
    bands = settling_bands(ours, theirs)
    computed = metrics(ours, bands), metrics(theirs, bands)
    titles = {"tracking_error": "Tracking error e", "sync_error": "Synchronization error ε"}
    tables = [_error_table(kind, title, (ours, theirs), computed) for kind, title in titles.items()]
    return [*tables, _torque_table(ours, computed)]


def _error_table(
    kind: str, title: str, runs: tuple[Result, Result], computed: tuple[Metrics, Metrics]
) -> Table:
    ours, theirs = (getattr(m, kind) for m in computed)
    unit, factor = display(runs[0].unit(kind))
    square = display(f"{squared(runs[0].unit(kind))}·s")
    rows = []
    for k, name in enumerate(row_names(runs[0], kind)):
        for axis, label in enumerate(runs[0].info["axes"]):
            at = (k, axis)
            cells = [
                *_both(factor * ours.peak[at], factor * theirs.peak[at], ratio=True),
                *_both(factor * ours.rms[at], factor * theirs.rms[at], ratio=True),
                *_both(square.factor * ours.ise[at], square.factor * theirs.ise[at]),
                *_both(ours.settling_time[at], theirs.settling_time[at]),
                *_both(factor * ours.final[at], factor * theirs.final[at]),
            ]
            rows.append((f"{name}, {label}" if kind == "tracking_error" else f"ε_{name}, {label}", *cells))
    groups = ((f"peak, {unit}", 3), (f"RMS, {unit}", 3), (f"ISE, {square.unit}", 2), ("settling, s", 2))
    caption = (
        f"{title}: {runs[0].info['title']} (sync.), against {kind_of(runs[1])} (indep.). Ratio: independent "
        f"/ synchronized. Settled: from when the error stays within {number(factor * ours.band)} {unit}, 5 % "
        f"of the largest error of both runs; – if it does not within {runs[0].t[-1]:g} s."
    )
    two = ("sync.", "indep.")
    head = ("", *(*two, "ratio") * 2, *two * 3)
    return Table(head, tuple(rows), caption, (*groups, (f"final, {unit}", 2)))


def _torque_table(ours: Result, computed: tuple[Metrics, Metrics]) -> Table:
    """Peak torque of every joint, a row per robot."""
    joints = max((robot["joints"] for robot in ours.info["robots"]), key=len)
    a, b = (m.peak_torque for m in computed)
    rows = []
    for i, robot in enumerate(ours.info["robots"]):
        cells: list[str] = []
        for j in range(len(joints)):
            there = j < len(robot["joints"])
            cells += _both(a[i, j], b[i, j], ratio=True) if there else ("", "", "")
        rows.append((robot["name"], *cells))
    head = ("", *("sync.", "indep.", "ratio") * len(joints))
    groups = tuple((f"joint {k}", 3) for k in range(1, len(joints) + 1))
    return Table(head, tuple(rows), "Peak torque of the controller, N·m.", groups)


def _both(ours: float, theirs: float, ratio: bool = False) -> tuple[str, ...]:
    shown = tuple(number(value) if np.isfinite(value) else "–" for value in (ours, theirs))
    return (*shown, number(theirs / ours) if ours else "–") if ratio else shown
