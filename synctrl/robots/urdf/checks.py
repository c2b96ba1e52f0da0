"""What a robot description must satisfy before Pinocchio sees it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from ...errors import RobotError, near
from ..pseudo_inertia import NO_MOMENT, principal_moments
from .document import NO_INERTIA, Document, Inertial, Joint, Link
from .report import Notes
from .xml import quoted

MAX_LINKS = 1000
MAX_MOVING_JOINTS = 100
ROUNDING = 1e-9
"""Relative size of what passes for rounding, in the file and in Pinocchio's arithmetic."""


def inertial_fault(inertial: Inertial) -> str | None:
    """What no link can have, or None: "expected ..., found ...".

    A link may be massless (a frame) or a point mass. That no principal moment exceeds the sum of the others
    is not asked for: files of makers violate it, and their dynamics are well defined, see `triangle_fault`.
    """
    low, middle, high = np.linalg.eigvalsh(inertial.matrix)
    if inertial.mass < 0:
        return f"expected a mass of at least 0 kg, found {inertial.mass:g}"
    if low < -max(NO_MOMENT, ROUNDING * abs(inertial.matrix).max()):
        moments = f"principal moments {low:g}, {middle:g}, {high:g} kg·m^2"
        return f"expected a positive definite inertia, found {moments}"
    return None


def check_some_mass(document: Document) -> None:
    """Refuse a description that knows no inertia at all, as many do that were made for pictures.

    Raises:
        RobotError: no link has a mass.
    """
    if not any(link.inertial is not None and link.inertial.mass for link in document.links):
        raise document.error(
            "expected masses and inertias, found no link with a mass: the file describes how the robot looks "
            "and moves, not its dynamics; look for another file of it, or give them: inertials={...}"
        )


# -- the tree ----------------------------------------------------------------------------------------------


def check_tree(document: Document) -> None:
    """Refuse a document whose links and joints are not one tree with a moving joint in it.

    Raises:
        RobotError: with the link or joint concerned.
    """
    _check_counts(document)
    _check_unique(document)
    _check_references(document)
    _check_roots(document)
    _check_reached(document)


def _check_counts(document: Document) -> None:
    count, moving = len(document.links), len(document.moving_joints)
    if not 1 <= count <= MAX_LINKS:
        raise document.error(f"expected 1 to {MAX_LINKS} links, found {count}", found=count)
    if not 1 <= moving <= MAX_MOVING_JOINTS:
        expected = f"expected 1 to {MAX_MOVING_JOINTS} joints that move"
        raise document.error(f"{expected}, found {moving}", found=moving)


def _check_unique(document: Document) -> None:
    for kind, items in (("link", document.links), ("joint", document.joints)):
        first: dict[str, Link | Joint] = {}
        for item in items:
            if item.name in first:
                before = first[item.name].line
                line = f" in line {before}" if before else ""
                raise document.error(
                    f"expected a unique name, found another {kind}{line}", item, found=f"another {kind}"
                )
            first[item.name] = item


def _check_references(document: Document) -> None:
    links = [link.name for link in document.links]
    for joint in document.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise document.error(
                    f"expected a {role} among the links, found {quoted(name)}{near(name, links)}",
                    joint,
                    found=name,
                )
        if joint.parent == joint.child:
            raise document.error(
                f"expected two links, found {quoted(joint.child)} as both parent and child",
                joint,
                found=joint.child,
            )


def _check_roots(document: Document) -> None:
    joint_of: dict[str, Joint] = {}
    for joint in document.joints:
        if joint.child in joint_of:
            raise document.error(
                f"expected a tree, in which link {quoted(joint.child)} has one parent joint, found "
                f"{quoted(joint_of[joint.child].name)} too",
                joint,
                found=joint_of[joint.child].name,
            )
        joint_of[joint.child] = joint
    roots = [link.name for link in document.links if link.name not in joint_of]
    if len(roots) > 1:
        raise document.error(
            f"expected one root link, found {len(roots)}: {some(roots)}; "
            "each other link needs a joint whose child it is",
            found=len(roots),
        )
    if not roots:
        raise document.error("expected a root link, found a cycle through every link")


def _check_reached(document: Document) -> None:
    reached = set(walk(document))
    lost = [link.name for link in document.links if link.name not in reached]
    if lost:
        raise document.error(
            f"expected every link to hang from {quoted(document.root)}, found a cycle of links: {some(lost)}"
        )


def walk(document: Document) -> list[str]:
    """Names of the links that hang from the root, each after its parent."""
    children: dict[str, list[str]] = {}
    for joint in document.joints:
        children.setdefault(joint.parent, []).append(joint.child)
    order = [document.root]
    for name in order:
        order.extend(children.get(name, ()))
    return order


def some(names: Iterable[str]) -> str:
    """The first few names, as they can be shown."""
    names = list(names)
    return ", ".join(map(quoted, names[:5])) + (", ..." if len(names) > 5 else "")


# -- the moving bodies -------------------------------------------------------------------------------------


def carriers(document: Document) -> dict[str, tuple[str | None, pin.SE3]]:
    """By link: the joint it moves with (None: the world) and its placement in that body's frame."""
    joint_of = {joint.child: joint for joint in document.joints}
    carrier: dict[str, tuple[str | None, pin.SE3]] = {document.root: (None, pin.SE3.Identity())}
    for name in walk(document)[1:]:
        joint = joint_of[name]
        body, placement = carrier[joint.parent]
        fixed = (body, placement * joint.origin.se3)
        carrier[name] = (joint.name, pin.SE3.Identity()) if joint.moves else fixed
    return carrier


def body_parameters(document: Document) -> dict[str, np.ndarray]:
    """Inertial parameters of each moving body: the ten numbers of its links together, by joint name.

    A body is what moves with one joint: its child link and all links fixed to it, in the frame of that child.
    """
    carrier = carriers(document)
    bodies = {joint.name: np.zeros(10) for joint in document.moving_joints}
    for link in document.links:
        body, placement = carrier[link.name]
        if body is not None and link.inertial is not None:
            bodies[body] += link.inertial.parameters(placement)
    return bodies


def check_bodies(document: Document, notes: Notes | None = None) -> None:
    """Refuse what cannot move as a mechanism: impossible inertias, joints without mass, ranges upside down.

    Args:
        document: one tree.
        notes: where it is said what plays no part, or was assumed.

    Raises:
        RobotError: with the link or joint concerned.
    """
    notes = notes or Notes(document.file)
    _check_links(document, notes)
    parameters = body_parameters(document)
    for joint in document.moving_joints:
        if fault := _joint_fault(joint) or _body_fault(joint, parameters[joint.name]):
            raise document.error(fault, joint)
        for note in joint.remarks:
            notes.add(note.kind, note.where, note.text, note.line)


def _check_links(document: Document, notes: Notes) -> None:
    carrier, own = carriers(document), {joint.child for joint in document.moving_joints}
    for link in document.links:
        inertial, moves = link.inertial, carrier[link.name][0] is not None
        if inertial is None:
            continue
        try:
            _check_inertial(document, link, inertial, link.name in own)
        except RobotError as error:
            if moves:
                raise
            notes.absorb(error)
        if moves:
            _remark_inertial(link, inertial, notes)


def _check_inertial(document: Document, link: Link, inertial: Inertial, moved: bool) -> None:
    """Refuse an inertial that no link has, or that a link which a joint moves cannot have."""
    fault = inertial_fault(inertial)
    if moved and inertial.mass > 0 and inertial.inertia == NO_INERTIA:
        fault = f"expected an inertia, found none, or zeros, for {inertial.mass:g} kg that a joint moves"
    if fault:
        raise document.error(fault, link, part="inertial", line=inertial.line)


def _remark_inertial(link: Link, inertial: Inertial, notes: Notes) -> None:
    if inertial.mass == 0 and inertial.inertia != NO_INERTIA:
        text = "an inertia without a mass is taken as it stands"
        notes.add("assumed", f"{link.title}, inertial", text, inertial.line)


def _joint_fault(joint: Joint) -> str | None:
    limit = joint.limit
    if joint.mimic is not None:
        return (
            f"expected joints that move by themselves, found one that mimics {quoted(joint.mimic.joint)}; "
            "lock both (locked={...}), or remove <mimic>"
        )
    if limit is None or limit.lower is None or limit.upper is None or limit.lower <= limit.upper:
        return None
    return f"expected lower below upper, found {limit.lower:g} and {limit.upper:g}"


def _body_fault(joint: Joint, parameters: np.ndarray) -> str | None:
    mass, body = parameters[0], f"link {quoted(joint.child)} and the links fixed to it"
    if mass <= 0:
        return (
            f"{body}: expected a mass above 0 kg, found {mass:g}; does a link lack its <inertial>? "
            "inertials={...} gives it one, locked={...} holds the joint"
        )
    lowest, _, highest = principal_moments(parameters)  # not negative, as those of each link are not
    if highest <= 1e-15 * abs(parameters[4:]).max():
        moments = f"principal moments from {lowest:g} to {highest:g} kg·m^2"
        return f"{body}: expected a positive definite inertia, found {moments}"
    return None
