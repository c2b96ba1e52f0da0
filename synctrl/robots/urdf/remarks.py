"""What is said about a robot description, and taken as it stands: what may be mistakes, names, friction."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from .branches import Branches
from .document import Document, Inertial, Joint
from .report import Note, Notes
from .xml import quoted

FARTHEST_COM = 3.0
LARGEST_GYRATION = 1.0
LONGEST_RANGE = 4.001 * math.pi
LIGHTEST = 0.01
DENSEST = 3e5
"""In kg/m^3: more than ten times osmium. A mass in g, or an inertia in other units, gives far more."""
_ROUNDING = 1e-9


def triangle_fault(inertial: Inertial) -> str | None:
    """Principal moments A + B < C, which no body has, as they are integrals of squares over it; or None."""
    low, middle, high = np.linalg.eigvalsh(inertial.matrix)
    if low + middle >= (1 - _ROUNDING) * high:
        return None
    return (
        f"expected an inertia in which no principal moment exceeds the sum of the others, found principal "
        f"moments {low:g}, {middle:g}, {high:g} kg·m^2"
    )


def suspect(document: Document, notes: Notes) -> None:
    """Remark what is suspicious about the moving bodies and joints of a checked document."""
    branches = Branches(document)
    moved = [
        (link, inertial)
        for link in document.links
        if (inertial := link.inertial) is not None and branches.chain(link.name)
    ]
    for link, inertial in moved:
        for text in _of_link(inertial):
            notes.add("suspicious", f"{link.title}, inertial", text, inertial.line)
    for joint in document.moving_joints:
        if text := _of_range(joint):
            notes.add("suspicious", f"{joint.title}, limit", text, joint.line)
    masses = [inertial.mass for _, inertial in moved if inertial.mass > 0]
    if len(masses) > 1 and max(masses) <= LIGHTEST:
        text = f"no link weighs more than {1e3 * max(masses):g} g: placeholders?"
        notes.add("suspicious", f"robot {quoted(document.name)}", text)


def _of_link(inertial: Inertial) -> Iterator[str]:
    mass, largest = inertial.mass, float(np.linalg.eigvalsh(inertial.matrix)[2])
    distance = math.hypot(*inertial.origin.xyz)
    if fault := triangle_fault(inertial):
        yield f"{fault}; no body has them, and physically consistent adaptation cannot use them"
    if (least := min(np.diag(inertial.matrix))) < 0:
        yield f"a moment of {least:g} kg·m^2 is taken for rounding"
    if mass <= 0:
        return
    if distance > FARTHEST_COM:
        yield f"the centre of mass is {distance:g} m away: a length in mm?"
    radius = math.sqrt(max(largest, 0.0) / mass)
    if radius > LARGEST_GYRATION:
        yield f"{mass:g} kg have a radius of gyration of {radius:g} m: a mass or inertia in other units?"
    if 0 < radius < _densest(mass):
        yield (
            f"{mass:g} kg have a radius of gyration of {1e3 * radius:.2g} mm, too dense for any material: "
            "a mass in g, or an inertia in other units?"
        )


def _densest(mass: float) -> float:
    """Radius of gyration, m, of the densest ball: any other body of its density has a larger one."""
    return math.sqrt(0.4) * math.cbrt(3 * mass / (4 * math.pi * DENSEST))


def _of_range(joint: Joint) -> str:
    limit = joint.limit
    if limit is None or limit.lower is None or limit.upper is None or joint.type == "prismatic":
        return ""
    length = limit.upper - limit.lower
    return f"a range of {length:g} rad: in degrees?" if length > LONGEST_RANGE else ""


# -- names -------------------------------------------------------------------------------------------------

_PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-]{0,127}", re.ASCII)


def is_plain(name: str) -> bool:
    """Whether every program takes this name."""
    return bool(_PLAIN.fullmatch(name))


def remark_names(document: Document, notes: Notes) -> None:
    """Remark names that other programs may not take, and joints that are named as a link or the world."""
    links, joints = ([item.name for item in items] for items in (document.links, document.moving_joints))
    where = f"robot {quoted(document.name)}"
    odd = [name for name in (document.name, *links, *joints) if not is_plain(name)]
    if odd:
        text = f"{len(odd)} with other characters than A-Z, a-z, 0-9, '_', '-', '.', such as {quoted(odd[0])}"
        notes.add("assumed", where, f"names are taken as they stand, {text}")
    for name in sorted({"universe", *links} & set(joints)):
        notes.add("assumed", where, f"joint {quoted(name)} is told from a link or the world of that name")


def stated_friction(document: Document) -> Iterator[Note]:
    """One remark, if a joint that moves has friction: no oddity, so it is no warning by itself."""
    rubbing = [joint for joint in document.moving_joints if joint.damping or joint.friction]
    if rubbing:
        damping = max(joint.damping for joint in rubbing)
        friction = max(joint.friction for joint in rubbing)
        many = f"{len(rubbing)} joint{'s' * (len(rubbing) > 1)}"
        text = (
            f"friction, viscous up to {damping:g} and Coulomb up to {friction:g} at {many}, "
            "acts only if it is asked for, as by Member(robot, ..., friction='urdf'); see Robot.urdf_friction"
        )
        yield Note("assumed", f"{rubbing[0].title}, dynamics", text, rubbing[0].line)
