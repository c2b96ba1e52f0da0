"""What is possible in a robot description, and yet most often a mistake: said, and taken as it stands."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from .branches import Branches
from .document import Document, Inertial, Joint
from .report import Notes
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
    mass, moments = inertial.mass, np.linalg.eigvalsh(inertial.matrix)
    distance = math.hypot(*inertial.origin.xyz)
    if fault := triangle_fault(inertial):
        yield f"{fault}; no body has them, and physically consistent adaptation cannot use them"
    if mass > 0 and distance > FARTHEST_COM:
        yield f"the centre of mass is {distance:g} m away: a length in mm?"
    if mass > 0 and max(moments[2], 0.0) / mass > LARGEST_GYRATION**2:
        radius = math.sqrt(moments[2] / mass)
        yield f"{mass:g} kg have a radius of gyration of {radius:g} m: a mass or inertia in other units?"
    if mass > 0 and moments[2] > 0 and _density(mass, moments) > DENSEST:
        yield (
            f"{mass:g} kg have the inertia of a body of {1e3 * _size(mass, moments):.2g} mm, too dense for "
            "any material: a mass in g, or an inertia in other units?"
        )


def _size(mass: float, moments: np.ndarray) -> float:
    """Diameter, m, of the ball with the mass and the largest moment, 2/5 m r^2."""
    return 2 * math.sqrt(2.5 * moments[2] / mass)


def _density(mass: float, moments: np.ndarray) -> float:
    """Of that ball, kg/m^3; a slender or flat body of that density is larger in one direction at least."""
    return 6 * mass / (math.pi * _size(mass, moments) ** 3)


def _of_range(joint: Joint) -> str:
    limit = joint.limit
    if limit is None or limit.lower is None or limit.upper is None or joint.type == "prismatic":
        return ""
    length = limit.upper - limit.lower
    return f"a range of {length:g} rad: in degrees?" if length > LONGEST_RANGE else ""
