"""What a robot's file says, in tables and as plain data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from rich.text import Text

from ..robots.mechanism import joint_limits
from ..robots.model import SLIDES
from ..robots.robot import Robot
from ..robots.second_reading import Reading
from .console import BAD, DIM, GOOD, number, table

#: of a note of each kind in the report of a robot
STYLES = {"suspicious": "yellow", "assumed": "", "left out": DIM, "locked": DIM}


def joints(robot: Robot) -> list[dict[str, Any]]:
    """Every joint with its body: what it hangs from, its range, limits, mass and friction, in SI units."""
    limits, masses = joint_limits(robot), robot.inertial_parameters.reshape(-1, 10)[:, 0]
    friction = robot.urdf_friction
    names = ["base", *robot.joint_names]
    return [
        {
            "name": name,
            "after": names[robot.model.parents[k + 1]],
            "kind": "slides" if robot.joint_units[k] == SLIDES else "turns",
            "unit": robot.joint_units[k],
            "lower": limits.lower[k],
            "upper": limits.upper[k],
            "velocity": limits.velocity[k],
            "torque": limits.torque[k],
            "mass": masses[k],
            "viscous": np.broadcast_to(friction.viscous, robot.nv)[k],
            "coulomb": np.broadcast_to(friction.coulomb, robot.nv)[k],
            "rotor": robot.armature[k],
        }
        for k, name in enumerate(robot.joint_names)
    ]


def about(robot: Robot) -> dict[str, Any]:
    """A robot as plain data."""
    return {
        "name": robot.name,
        "file": None if robot.document is None else robot.document.file,
        "tip": robot.tip,
        "joints": joints(robot),
        "moving_mass": float(robot.inertial_parameters[::10].sum()),
        "links": [] if robot.document is None else [link.name for link in robot.document.links],
        "report": [
            {"kind": note.kind, "where": note.where, "text": note.text, "line": note.line}
            for note in robot.report
        ],
    }


def tree(robot: Robot) -> Any:
    """Links below one another, with the joints between them."""
    from rich.tree import Tree

    document = robot.document
    if document is None:
        return Text("No description: the robot was made of a model.")
    masses = {link.name: link.inertial.mass if link.inertial else 0.0 for link in document.links}
    made = Tree(_branch("", "", document.root, masses[document.root], robot.tip), guide_style=DIM)
    places = {document.root: made}
    left = [*document.joints]
    while ready := [joint for joint in left if joint.parent in places]:
        for joint in ready:
            words = _branch(joint.name, joint.type, joint.child, masses[joint.child], robot.tip)
            places[joint.child] = places[joint.parent].add(words)
        left = [joint for joint in left if joint.child not in places]
    return made


def _branch(joint: str, kind: str, link: str, mass: float, tip: str) -> Text:
    words = Text(f"{joint} " if joint else "")
    words.append(f"({kind}) " if kind else "", style=DIM)
    words.append(link, style="bold" if link == tip else "")
    words.append(f"  {mass:g} kg" if mass else "", style=DIM)
    return words.append("  tip", style=GOOD) if link == tip else words


def joint_table(robot: Robot) -> Any:
    """The joints in a table; ranges of what turns in degrees."""
    columns = ("joint", "after", "", "range", "speed", "torque", "mass", "viscous", "Coulomb", "rotor")
    whole = [columns, *(_row(each) for each in joints(robot))]
    filled = [k for k in range(len(columns)) if any(row[k] for row in whole[1:])]
    head, *rows = ([row[k] for k in filled] for row in whole)
    return table("Joints", head, rows, left=3)


def _row(joint: dict[str, Any]) -> tuple[str, ...]:
    slides = joint["unit"] == SLIDES
    factor, angle, force = (1e3, "mm", "N") if slides else (180 / np.pi, "deg", "N·m")
    ends = [number(factor * joint[end], 4) for end in ("lower", "upper")]
    free = not np.isfinite([joint["lower"], joint["upper"]]).any()
    rate = "m/s" if slides else "rad/s"
    return (
        joint["name"],
        joint["after"],
        joint["kind"],
        "no limit" if free else f"{ends[0]} to {ends[1]} {angle}",
        *(_limit(joint[name], unit) for name, unit in (("velocity", rate), ("torque", force))),
        f"{joint['mass']:.4g} kg",
        *(f"{joint[name]:.3g}" if joint[name] else "" for name in ("viscous", "coulomb", "rotor")),
    )


def _limit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}" if np.isfinite(value) else "no limit"


def remarks(robot: Robot) -> Text:
    """What was left out, assumed or held, and what is suspicious, the worst first."""
    made = Text("Remarks", style="bold")
    notes = [note for kind in STYLES for note in robot.report.of_kind(kind)]
    for note in notes:
        made.append(f"\n  {note.kind}: {note}", style=f"not bold {STYLES[note.kind]}")
    for note in robot.report.known:
        made.append(f"\n  {note}", style=f"not bold {DIM}")
    return made if notes or robot.report.known else made.append("\n  none", style="not bold")


def reading_table(readings: Iterable[Reading]) -> Any:
    """What other libraries read, beside what this package does."""
    rows = []
    for reading in readings:
        if reading.refusal:
            rows.append((reading.library, Text("does not say", style="yellow"), reading.refusal))
        same = [each.what for each in reading.differences if each.agrees]
        if same:
            rows.append((reading.library, Text("the same", style=GOOD), ", ".join(same)))
        for each in reading.differences:
            if not each.agrees:
                size = f"by {each.size:.3g} {each.unit}" if each.unit != "1" else f"by {each.size:.2%}"
                rows.append((reading.library, Text("differs", style=BAD), f"{each.what}, {size}"))
    return table("Read again by others", ("", "", ""), rows, left=3)
