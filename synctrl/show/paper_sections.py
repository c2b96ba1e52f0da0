"""The sections of the page on the paper: introduction, the A460 pair, the four planar arms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..analysis.claims_a460 import a460_claims
from ..analysis.claims_planar import own_findings, planar_four_claims
from ..analysis.metrics import metrics, row_names, settling_bands
from ..simulation.result import Result
from ..simulation.simulate import Experiment
from .layout import cell_layout
from .plots import common_limits, joint_trajectories, save, sync_errors, tracking_errors
from .report import Links, Picture, Row, Section, Table, Text, Verdicts, number
from .style import display

LAW = """\
e_i   = xd_i - x_i                                              position error            (1)
ε_k   = Σ_i S_ki c_i e_i                                        synchronization error     (7), (28)
e*_i  = c_i e_i + β Σ_k S_ki ∫ε_k                               coupled error             (10), (29)
u_i   = c_i xd_i' + c_i' e_i + β Σ_k S_ki ε_k + Λ e*_i          command                   (11), (30)
r_i   = u_i - c_i x_i'                                                                    (12), (31)
τ_i   = Y_i θ̂_i + K_r s_i + Jᵀ c_iᵀ K_ε Σ_k S_ki ε_k            torque, s_i = J⁻¹ c_i⁻¹ r_i  (13), (32)
θ̂_i'  = Γ Y_iᵀ s_i                                              adaptation                (14)"""


def introduction() -> Section:
    """What this page is, and the law."""
    return Section(
        "What is shown here",
        (
            Text(
                (
                    "Sun and Mills, “Adaptive Synchronized Control for Coordination of Multirobot Assembly "
                    "Tasks” (2002), computed again: every robot tracks its own path with an adaptive law and "
                    "couples its error with its neighbours', so that tracking and synchronization errors "
                    "both go to zero. Independent control, the paper's comparison, is the same controller "
                    "with β = K_ε = 0.",
                )
            ),
            Text((LAW,), "formula"),
            Text(
                (
                    "Every number on this page was computed when the page was made. A claim of the paper "
                    "that does not hold here says so.",
                )
            ),
        ),
    )


def a460_section(runs: Mapping[str, Result], folder: Path) -> Section:
    """Section V-A with figures 2 to 7, from runs `synchronized`, `independent` and `frictionless`."""
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
                    "Joint angles and gains are the paper's; ε = e_1 - e_2. The time of the motion, 2 s, and "
                    "the initial estimate, 0.7 of the true parameters, are our choices.",
                )
            ),
            Text(
                (
                    "Synthetic data: masses, inertias and friction of the A460 were never published. Those "
                    "used here are invented to be plausible, so the size of the errors is not the paper's.",
                ),
                "note",
            ),
            Row((pictures[2], pictures[5])),
            Row((pictures[3], pictures[6])),
            Row((pictures[4], pictures[7])),
            metrics_table(ours, theirs),
            torque_table(ours, theirs),
            Verdicts(tuple(a460_claims(runs))),
        ),
    )


def planar_section(runs: Mapping[str, Result], experiment: Experiment, folder: Path) -> Section:
    """Section V-B with figures 8 to 16.

    Args:
        runs: `synchronized`, `independent`, the two `..._disturbed`, and those of `own_findings`.
        experiment: the synchronized cell, for its layout.
        folder: where figures go.
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
                    "Tables II and III and the gains are the paper's. Table II does not give φ; it is "
                    "0.1 rad here, which makes the cell nearly square. On which robots move on the larger "
                    "circle the text and Table II disagree; the text is followed.",
                )
            ),
            pictures[8],
            Row((pictures[9], pictures[11])),
            Row((pictures[10], pictures[12])),
            metrics_table(*pairs[0]),
            torque_table(*pairs[0]),
            Text(("Disturbed: +1 N·m on both joints of robot 1 for 0.5 s ≤ t < 0.75 s.",)),
            Row((pictures[13], pictures[15])),
            Row((pictures[14], pictures[16])),
            metrics_table(*pairs[1]),
            torque_table(*pairs[1]),
            Verdicts(tuple(planar_four_claims(runs))),
        ),
    )


def honesty_section(runs: Mapping[str, Result]) -> Section:
    """What the paper's comparison leaves unsaid."""
    return Section("Said honestly", (Verdicts(tuple(own_findings(runs))),))


def animation_section(files: Mapping[str, str]) -> Section:
    """Links to the animations, from file name to title."""
    words = "MeshCat scenes, one file each; they play without a network and without a server."
    return Section("Animations", (Text((words,)), Links(tuple(files.items()))))


def metrics_table(ours: Result, theirs: Result) -> Table:
    """Metrics of every robot, pair and axis, synchronized against independent."""
    bands = settling_bands(ours, theirs)
    computed = metrics(ours, bands), metrics(theirs, bands)
    rows: list[tuple[str, ...]] = []
    for kind, symbol in (("tracking_error", "e"), ("sync_error", "ε")):
        a, b = (getattr(m, kind) for m in computed)
        unit, factor = display(ours.unit(kind))
        for k, name in enumerate(row_names(ours, kind)):
            for axis, label in enumerate(ours.info["axes"]):
                at = (k, axis)
                rows.append(
                    (
                        f"{symbol} {name}, {label}, {unit}",
                        *_both(factor * a.peak[at], factor * b.peak[at]),
                        *_both(factor * a.rms[at], factor * b.rms[at]),
                        *_both(factor**2 * a.ise[at], factor**2 * b.ise[at], ratio=False),
                        *_both(a.settling_time[at], b.settling_time[at], ratio=False),
                        *_both(factor * a.final[at], factor * b.final[at], ratio=False),
                    )
                )
    compared = ("sync.", "indep.", "ratio")
    head = ("", *(f"{name} {part}" for name in ("peak", "RMS") for part in compared))
    head = (*head, *(f"{name} {part}" for name in ("ISE", "settling, s,", "final") for part in compared[:2]))
    caption = (
        f"{ours.info['title']} (sync.) against {theirs.info['title']} (indep.). ISE in the square of "
        "the row's unit times s. "
        f"Settling: from when the error stays within 5 % of the largest error of both runs; – if it does not "
        f"within {ours.t[-1]:g} s. Ratio: independent / synchronized."
    )
    return Table(head, tuple(rows), caption)


def torque_table(ours: Result, theirs: Result) -> Table:
    """Peak torque of every robot and joint."""
    a, b = np.abs(ours.tau).max(axis=0), np.abs(theirs.tau).max(axis=0)
    rows = [
        (f"{robot['name']}, {joint}", *_both(a[i, j], b[i, j]))
        for i, robot in enumerate(ours.info["robots"])
        for j, joint in enumerate(robot["joints"])
    ]
    return Table(("peak torque, N·m", "synchronized", "independent", "ratio"), tuple(rows))


def _both(a: float, b: float, ratio: bool = True) -> tuple[str, ...]:
    shown = tuple(number(value) if np.isfinite(value) else "–" for value in (a, b))
    return (*shown, number(b / a) if a else "–") if ratio else shown


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
