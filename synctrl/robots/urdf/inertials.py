"""Masses and inertias that a user states in the place of those in a file, or of those that it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...checks import finite_array, instance, positive_number, symmetric_matrix
from ...errors import InputError, near
from .checks import carriers
from .document import INERTIA, Document, Inertial, Link, Pose, upper_triangle

KEYS = ("mass", "com", "inertia")


def with_inertials(document: Document, inertials: Mapping[str, Inertial | Mapping[str, Any]]) -> Document:
    """The document with inertials of links replaced.

    Args:
        document: the robot.
        inertials: by link, an `Inertial` or a mapping of "mass", kg, "com", (3,), m, by default the origin of
            the link, and "inertia" about the centre of mass in the axes of the link, kg·m^2: a matrix,
            (3, 3), its diagonal, (3,), or ixx, ixy, ixz, iyy, iyz, izz, (6,).

    Raises:
        InputError: no such link, or what is no inertial.
    """
    instance("inertials", inertials, Mapping, "inertials by the names of links")
    names = [link.name for link in document.links]
    for name in inertials:
        if name not in names:
            found = f"{name!a}{near(str(name), names)}"
            raise InputError(f"expected links of {document.source}, found {found}", subject="inertials")
    given = {name: _inertial(f"inertials[{name!a}]", value) for name, value in inertials.items()}
    links = (replace(link, inertial=given.get(link.name, link.inertial)) for link in document.links)
    return replace(document, links=tuple(links))


def _inertial(subject: str, value: Inertial | Mapping[str, Any]) -> Inertial:
    if isinstance(value, Inertial):
        return value
    instance(subject, value, Mapping, "an Inertial or a mapping")
    for key in value:
        if key not in KEYS:
            raise InputError(f"expected {', '.join(KEYS)}, found {key!a}", subject=subject)
    for key in ("mass", "inertia"):
        if key not in value:
            raise InputError(f"expected '{key}', found none", subject=subject)
    com = finite_array(f"{subject}['com']", value.get("com", (0, 0, 0)), (3,))
    moments = _moments(f"{subject}['inertia']", value["inertia"])
    mass = positive_number(f"{subject}['mass']", value["mass"])
    return Inertial(mass, moments, Pose(tuple(map(float, com))))


def _moments(subject: str, value: Any) -> tuple[float, ...]:
    shape = np.shape(value)
    if shape == (len(INERTIA),):
        return tuple(map(float, finite_array(subject, value, shape)))
    if shape == (3,):
        value = np.diag(finite_array(subject, value, (3,)))
    return upper_triangle(symmetric_matrix(subject, value, 3))


def with_bodies(document: Document, rows: Mapping[str, np.ndarray]) -> Document:
    """The document with other inertial parameters of its moving bodies.

    Args:
        document: one tree.
        rows: ten parameters in Pinocchio's order by moving joint; its child link gets them all, and the links
            fixed to that none.
    """
    carrier, own = carriers(document), {joint.child: joint.name for joint in document.moving_joints}

    def changed(link: Link) -> Link:
        if link.name in own:
            return replace(link, inertial=_from_parameters(rows[own[link.name]]))
        return link if carrier[link.name][0] is None else replace(link, inertial=None)

    return replace(document, links=tuple(map(changed, document.links)))


def _from_parameters(row: np.ndarray) -> Inertial:
    mass, com = float(row[0]), row[1:4] / row[0]
    I = np.zeros((3, 3))
    I[np.tril_indices(3)] = row[4:]
    I += np.tril(I, -1).T - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return Inertial(mass, upper_triangle(I), Pose(tuple(map(float, com))))
