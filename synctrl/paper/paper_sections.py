"""The sections of the page on the paper: introduction, the A460 pair, the four planar arms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..analysis.metrics import Metrics, metrics, row_names, settling_bands, squared
from ..show.layout import cell_layout
from ..show.plots import common_limits, joint_trajectories, save, sync_errors, tracking_errors
from ..show.style import display
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .claims import Claim
from .claims import kind as kind_of
from .claims_a460 import a460_claims
from .claims_planar import own_findings, planar_four_claims
from .report import Formulas, Links, Picture, Row, Section, Table, Text, Verdicts, number

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


def introduction(claims: Sequence[Claim]) -> Section:
    """What this page is, the law, and how many of the claims hold."""
    failed = [claim.text for claim in claims if not claim.holds]
    held = f"{len(claims) - len(failed)} of {len(claims)} claims that are checked below hold."
    return Section(
        "What is shown here",
        (
            Text(
                (
                    "Sun and Mills, “Adaptive Synchronized Control for Coordination of Multirobot Assembly "
                    "Tasks” (2002), computed again. Every robot tracks its own path with an adaptive law and "
                    "couples its error with its neighbours’, so that tracking and synchronization errors "
                    "both go to zero. Independent control, the paper’s comparison, is the same controller "
                    "with β = K_ε = 0.",
                )
            ),
            Formulas(LAW),
            Text(
                (
                    "S says which robots are compared (a pair, or a ring of neighbours), c_i are their "
                    "weights, Y_i is the regressor of robot i and θ̂_i its estimate of the parameters.",
                    "Every number on this page was computed when the page was made. The metrics and claims "
                    "are in metrics.json as well, in SI units, and the runs themselves in the folder runs. A "
                    "claim of the paper that does not hold here says so.",
                    " ".join([held, *(f"Does not hold: “{text}”" for text in failed)]),
                )
            ),
        ),
    )


def trial_section(duration: float) -> Section:
    """A warning at the top of a page whose runs were cut off."""
    words = (
        f"This page is a trial: no run is longer than {duration:g} s, so nothing had the time to converge. "
        "Figures and verdicts are not those of the whole runs."
    )
    return Section("A trial", (Text((words,), "note"),))


def a460_section(runs: Mapping[str, Result], folder: Path, animations: Links) -> Section:
    """Section V-A with figures 2 to 7.

    Args:
        runs: `synchronized`, `independent` and `frictionless`.
        folder: where figures go.
        animations: links to those of this cell.
    """
    ours, theirs = runs["synchronized"], runs["independent"]
    limits = common_limits("sync_error", ours, theirs)
    figures = {
        2: joint_trajectories(ours, 0),
        3: joint_trajectories(ours, 1),
        4: sync_errors(ours, limits),
        5: joint_trajectories(theirs, 0),
        6: joint_trajectories(theirs, 1),
        7: sync_errors(theirs, limits),
    }
    pictures = {k: _picture(folder, k, figure, _A460_CAPTIONS[k]) for k, figure in figures.items()}
    return Section(
        "Two CRS A460 robots (section V-A)",
        (
            Text(
                (
                    "Two arms move a payload along a cubic path; ε = e_1 - e_2 compares their joint errors. "
                    "Joint angles and gains are the paper’s. The time of the motion, 2 s, the initial "
                    "estimate, 0.7 of the true parameters, and the place of the second base are our choices.",
                )
            ),
            Text(
                (
                    "Synthetic data: no published masses, inertias or friction of the A460 were found. Those "
                    "used here are invented to be plausible, so the size of the errors is not the paper’s; "
                    "only their comparison means something. Friction is in the plant and unknown to the "
                    "controller.",
                ),
                "note",
            ),
            animations,
            Row((pictures[2], pictures[5])),
            Row((pictures[3], pictures[6])),
            Row((pictures[4], pictures[7])),
            *metrics_tables(ours, theirs),
            Verdicts(tuple(a460_claims(runs))),
        ),
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
    pairs = [(runs["synchronized"], runs["independent"])]
    pairs.append((runs["synchronized_disturbed"], runs["independent_disturbed"]))
    pictures = {8: _picture(folder, 8, cell_layout(pairs[0][0], experiment), _PLANAR_CAPTIONS[8])}
    for first, (ours, theirs) in zip((9, 13), pairs, strict=True):
        e, epsilon = (common_limits(kind, ours, theirs) for kind in ("tracking_error", "sync_error"))
        figures = [tracking_errors(ours, e), sync_errors(ours, epsilon)]
        figures += [tracking_errors(theirs, e), sync_errors(theirs, epsilon)]
        for k, figure in enumerate(figures, start=first):
            pictures[k] = _picture(folder, k, figure, _PLANAR_CAPTIONS[k])
    return Section(
        "Four planar arms (section V-B)",
        (
            Text(
                (
                    "Four arms move along circles about the origin and keep their distances; a ring of four "
                    "pairs compares neighbours. Tables II and III and the gains are the paper’s. Table II "
                    "does not give φ; it is 0.1 rad here, which makes the cell nearly square. On which "
                    "robots move on the larger circle the text and Table II disagree; the text is followed. "
                    "The weights c are lengths, so ε is in m².",
                )
            ),
            animations,
            pictures[8],
            Row((pictures[9], pictures[11])),
            Row((pictures[10], pictures[12])),
            *metrics_tables(*pairs[0]),
            Text(
                (
                    "Disturbed: +1 N·m on both joints of robot 1 for 0.5 s ≤ t < 0.75 s. That it acts on "
                    "both joints is our choice.",
                )
            ),
            Row((pictures[13], pictures[15])),
            Row((pictures[14], pictures[16])),
            *metrics_tables(*pairs[1]),
            Verdicts(tuple(planar_four_claims(runs))),
        ),
    )


def honesty_section(runs: Mapping[str, Result]) -> Section:
    """What the paper's comparison leaves unsaid."""
    return Section(
        "Said honestly",
        (
            Text(
                (
                    "Without synchronization the paper sets β = K_ε = 0 and leaves all other gains as they "
                    "are. That takes gain away, so part of what synchronization seems to achieve is achieved "
                    "by more gain. Of the gains that synchronization adds, β does the work.",
                )
            ),
            Verdicts(tuple(own_findings(runs))),
        ),
    )


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


def _picture(folder: Path, k: int, figure: object, caption: str) -> Picture:
    _, svg = save(figure, folder / f"figure_{k:02d}")  # type: ignore[arg-type]
    return Picture(svg, f"Figure {k}. {caption}")


_A460_CAPTIONS = {
    2: "Joint angles of robot 1, synchronized.",
    3: "Joint angles of robot 2, synchronized.",
    4: "Synchronization errors of the joints, synchronized.",
    5: "Joint angles of robot 1, independent.",
    6: "Joint angles of robot 2, independent.",
    7: "Synchronization errors of the joints, independent.",
}
_PLANAR_CAPTIONS = {
    8: "The four arms from above, at the start (pale) and at the end.",
    9: "Position errors, synchronized.",
    10: "Synchronization errors, synchronized.",
    11: "Position errors, independent.",
    12: "Synchronization errors, independent.",
    13: "Position errors, synchronized, disturbed.",
    14: "Synchronization errors, synchronized, disturbed.",
    15: "Position errors, independent, disturbed.",
    16: "Synchronization errors, independent, disturbed.",
}
