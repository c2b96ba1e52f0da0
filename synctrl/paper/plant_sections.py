"""Sections of the page: plants unlike the controller's model, what it learns of them, what the step costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.convergence import LATE, LEFT, Identification
from ..checks import instance
from ..show.plots import common_limits, joint_trajectories, sync_errors, tracking_errors
from ..show.style import display
from ..simulation.result import Result
from .report import Block, Picture, Section, SideBySide, Table, Text, as_picture, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: the run with six joints that belongs to one with three
FULL = {"synchronized": "full", "independent": "full_alone"}


def full_a460_section(runs: Mapping[str, Result], folder: Path) -> Section:
    """Figures 2 to 7 with three joints in the plant and with six, side by side.

    Args:
        runs: `synchronized` and `independent`, and with six joints `full` and `full_alone`.
        folder: where figures go, and where those of `a460_section` are.
    """
    limits = common_limits("sync_error", *(runs[name] for pair in FULL.items() for name in pair))
    blocks: list[Block] = [
        Text(
            "As in the paper's laboratory the plant has six joints here, of which PID controllers hold the "
            "last three, while the adaptive controller knows three joints and a lumped mass. On the left "
            "figures 2 to 7 for the plant that the controller knows; on the right with six joints."
        )
    ]
    for first, kind in zip((2, 5), FULL, strict=True):
        pair = (runs[kind], runs[FULL[kind]])
        for k, robot in enumerate(range(2), start=first):
            known = Picture(folder / f"figure_{k:02d}.svg", _caption(k, kind, "three"))  # drawn already
            blocks.append(
                SideBySide((known, _figure(folder, k, joint_trajectories(pair[1], robot), kind, "six")))
            )
        errors = zip(pair, ("three", "six"), strict=True)
        both = (_figure(folder, first + 2, sync_errors(run, limits), kind, joints) for run, joints in errors)
        blocks.append(SideBySide(tuple(both)))
    return Section("The A460 with six joints", (*blocks, _wrist_table(runs), _error_table(runs)))


def friction_section(runs: Mapping[str, Result], folder: Path) -> Section:
    """What is left of the errors when friction is among what is adapted.

    Args:
        runs: `friction_unknown` and `friction_adapted`.
        folder: where figures go.
    """
    pair = (runs["friction_unknown"], runs["friction_adapted"])
    limits = common_limits("tracking_error", *pair)
    pictures = tuple(
        as_picture(
            tracking_errors(run, limits), folder / f"friction_{name}", f"Tracking errors, friction {name}."
        )
        for run, name in zip(pair, ("unknown", "adapted"), strict=True)
    )
    unit, factor = display(pair[0].unit("tracking_error"))
    rows = []
    for run in pair:
        final = factor * np.abs(run.tracking_error[-1]).max(axis=0)
        rows.append((str(run.info["title"]), f"{run.t[-1]:g}", *map(number, final)))
    head = ("run", "length, s", *(f"|e| of {axis} at the end, {unit}" for axis in pair[0].info["axes"]))
    words = Text(
        "With viscous and Coulomb friction in Y, as columns v_ref and tanh(v / smoothing), the proof holds "
        "for the plant with friction, and the offset that friction leaves goes away. The coefficients start "
        "at 0.7 of the true ones, as the other parameters do."
    )
    return Section("Friction among what is adapted", (words, SideBySide(pictures), Table(head, tuple(rows))))


def identification_section(found: Mapping[str, Sequence[Identification]]) -> Section:
    """What runs could learn of their robots' parameters, and what they did learn, by title of the run."""
    sizes = ("adapted", "identifiable", "wrong", "learned")
    errors = ("torque_error_peak", "torque_error_end", "base_error_start", "base_error_end")
    data = [(f"{title}: {each.robot}", each.as_dict()) for title, robots in found.items() for each in robots]
    rows = [
        (
            name,
            *(str(row[size]) for size in sizes),
            number(row["condition"]),
            f"{row['excitation']:.1e}",
            *(number(row[error]) for error in errors),
        )
        for name, row in data
    ]
    head = (
        "run and robot", "adapted", "identifiable", "wrong at first", "learned", "condition", "excitation",
        "torque error, N·m, peak", "at the end", "base parameter error, start", "at the end",
    )  # fmt: skip
    words = Text(
        "That the tracking error vanishes says nothing about parameters. Identifiable: how many combinations "
        "of the adapted parameters torque depends on at all (base parameters), with the condition number of "
        "their columns. Excitation: smallest eigenvalue of the integral of YᵀY over the run, for base "
        "parameters in SI units. Learned: base parameters of whose error at the start no more than "
        f"{100 * LEFT:g} % is left in the last {100 * LATE:g} % of the run. That is measured, and says "
        "nothing of longer runs."
    )
    return Section("Errors converge, parameters need not", (words, Table(head, tuple(rows))))


def _figure(folder: Path, k: int, figure: Figure, kind: str, joints: str) -> Picture:
    """One figure of the paper for the plant with three joints, or with six."""
    return as_picture(figure, folder / f"figure_{k:02d}_{joints}_joints", _caption(k, kind, joints))


def _caption(k: int, kind: str, joints: str) -> str:
    return f"Figure {k}, {kind}, {joints} joints in the plant."


def _wrist_table(runs: Mapping[str, Result]) -> Table:
    rows = [
        (f"{kind}, {name}", *map(number, np.rad2deg(held["largest"])))
        for kind, full in FULL.items()
        for name, held in zip(runs[full].names, runs[full].info["held_joints"], strict=True)
    ]
    joints = runs["full"].info["held_joints"][0]["joints"]
    return Table(("largest deflection, deg", *joints), tuple(rows))


def _error_table(runs: Mapping[str, Result]) -> Table:
    """Peaks of all errors, of both plants."""
    rows = []
    for kind, full in FULL.items():
        for symbol, array in (("e", "tracking_error"), ("ε", "sync_error")):
            unit, factor = display(runs[kind].unit(array))
            pair = (runs[kind], runs[full])
            peaks = [factor * np.abs(getattr(run, array)).max(axis=(0, 1)) for run in pair]
            cells = (number(value) for values in zip(*peaks, strict=True) for value in values)
            rows.append((f"peak {symbol}, {kind}, {unit}", *cells))
    axes = runs["synchronized"].info["axes"]
    head = ("", *(f"{axis}, {joints}" for axis in axes for joints in ("three joints", "six joints")))
    return Table(head, tuple(rows))


def step_section(runs: Mapping[str, Result]) -> Section:
    """The estimated error of the worst step of every run, with those above the limit in a table.

    Args:
        runs: by name; those of methods that choose their steps, or from before estimates, are left out.

    Raises:
        InputError: something that is no result.
    """
    for name, run in runs.items():
        instance(f"runs, {name}", run, Result, "a Result")
    known = {name: run for name, run in runs.items() if (run.info.get("step_error") or {}).get("estimate")}
    over = {n: run for n, run in known.items() if run.info["step_error"]["advised_step"] is not None}
    estimated = Text(
        "Every run estimates what its worst step errs in velocity, as a share of the largest velocity of the "
        "run, from derivatives that it computes anyway. The error itself is about a third of that."
    )
    advice = ", and would do with the step in the last column." if over else "."
    verdict = Text(f"{len(over)} of {len(known)} runs are above the limit{advice}")
    return Section("What the step costs", (estimated, verdict, *([_step_table(over)] if over else [])))


def _step_table(runs: Mapping[str, Result]) -> Table:
    titles = [str(run.info["title"]) for run in runs.values()]
    names = [
        name.replace("_", " ") if titles.count(t) > 1 else t for name, t in zip(runs, titles, strict=True)
    ]
    head = ("run", "step, ms", "estimate, %", "limit, %", "at", "t, s", "advised step, ms")
    rows = []
    for name, run in zip(names, runs.values(), strict=True):
        found, step = run.info["step_error"], f"{1e3 * run.info['dt']:g}" if "dt" in run.info else ""
        shares = [f"{100 * found[share]:.2g}" for share in ("estimate", "limit")]
        where = f"{run.names[found['robot']]}, joint {found['joint'] + 1}"
        rows.append((name, step, *shares, where, f"{found['time']:g}", f"{1e3 * found['advised_step']:.2g}"))
    return Table(head, tuple(rows))
