"""Section of the page: whether the estimates of a run are those of bodies that can exist."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from ..analysis.consistency import Consistency, physical_consistency
from ..errors import InputError
from ..show.consistency_plots import consistency_figure
from ..simulation.result import Result
from .claims import OURS_OF_THE_PAPER, Claim, Finding
from .report import Block, Section, Table, Text, as_picture, number
from .reproduction import PLANNED


def bodies_of(runs: Mapping[str, Result]) -> dict[str, Consistency]:
    """Of every planned run whose parameters are those of bodies, by its name."""
    found = {}
    for name, run in runs.items():
        with suppress(InputError):  # maps such as (50) have no bodies
            found[name] = physical_consistency(run, PLANNED[name].make())
    return found


def bodies_are_left(name: str, consistency: Consistency) -> Claim:
    """Our finding: the paper's adaptation leaves the parameters of bodies that can exist, in its own cell."""
    left = consistency.left
    figures = [
        Finding(f"{robot}, body {body + 1}: first instant outside", time, "s")
        for robot, (time, body, _) in left.items()
    ]
    figures += [
        Finding(f"smallest eigenvalue of {robot}", float(values.min()))
        for robot, values in zip(consistency.names, consistency.smallest, strict=True)
    ]
    return Claim(
        "The paper's own adaptation, (14), leaves the parameters of bodies that can exist in the paper's own "
        "cell.",
        OURS_OF_THE_PAPER,
        not consistency.holds,
        tuple(figures),
        f"Run {name.replace('_', ' ')}, {consistency.t[-1]:g} s. Asked: the pseudo-inertia of an estimated "
        "body has an eigenvalue that is not above zero. The theorem does not need such bodies and holds; "
        "whoever predicts torque or inverts a mass matrix with the estimates does.",
    )


def bodies_section(found: Mapping[str, Consistency], drawn: str, stem: Path) -> Section:
    """The smallest eigenvalue of every body along every run, and over time for one of them.

    Args:
        found: by name of the run.
        drawn: name of the run whose eigenvalues are drawn.
        stem: the figure is written to `<stem>.svg`.
    """
    bodies = max(values.shape[1] for each in found.values() for values in each.smallest)
    rows = [row for name, each in found.items() for row in _rows(name, each, bodies)]
    head = ("run and robot", *(f"body {k}" for k in range(1, bodies + 1)), "of bodies that can exist")
    figure = as_picture(
        consistency_figure(found[drawn]), stem, f"Smallest eigenvalues over time: {drawn.replace('_', ' ')}."
    )
    blocks: list[Block] = [Text(_WORDS), Table(head, tuple(rows), _CAPTION), figure]
    return Section("Are the estimates bodies?", tuple(blocks))


def _rows(name: str, consistency: Consistency, bodies: int) -> list[tuple[str, ...]]:
    rows = []
    for robot, values in zip(consistency.names, consistency.smallest, strict=True):
        smallest = [number(value, 2) for value in values.min(axis=0)]
        there = (*smallest, *[""] * (bodies - len(smallest)))
        rows.append((f"{name.replace('_', ' ')}, {robot}", *there, existence(consistency, robot)))
    return rows


def existence(consistency: Consistency, robot: str) -> str:
    """Whether the estimates of a robot are those of bodies: yes, or until when."""
    left = consistency.left.get(robot)
    return "yes" if left is None else f"until {number(left[0])} s"


_WORDS = (
    "Ten numbers are the inertial parameters of a body exactly if its pseudo-inertia is positive definite. "
    "The first estimates are those of bodies; the adaptation of the paper, (14), does not keep them so. The "
    "theorem does not mind, for it needs no such bodies. synctrl.control.adaptation has Natural, which keeps "
    "them by construction. The four planar arms adapt the parameters of (50), which are those of no body."
)
_CAPTION = "Smallest eigenvalue of each body's pseudo-inertia over the run, kg and kg·m² mixed."
