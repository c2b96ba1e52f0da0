"""What a robot description must satisfy, before Pinocchio sees it and after."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from ...errors import RobotWarning, near, warn
from ..pseudo_inertia import principal_moments
from .document import Document, Inertial, Joint, Link

MAX_LINKS = 1000
MAX_MOVING_JOINTS = 100
ROUNDING = 1e-9
"""Relative size of what passes for rounding, in the file and in Pinocchio's arithmetic."""
WORST_CONDITION = 1e13
"""Of the mass matrix: beyond it accelerations have no correct digits left that matter."""


def inertial_fault(inertial: Inertial) -> str | None:
    """What is wrong with mass and inertia of a link, or None: "expected ..., found ...".

    A link may be massless (a frame) or a point mass; principal moments A, B, C of a body are positive and
    satisfy A + B >= C, because they are integrals of squares over it.
    """
    low, middle, high = np.linalg.eigvalsh(inertial.matrix)
    moments = f"principal moments {low:g}, {middle:g}, {high:g} kg·m^2"
    if inertial.mass < 0:
        return f"expected a mass of at least 0 kg, found {inertial.mass:g}"
    if low < -ROUNDING * abs(inertial.matrix).max():
        return f"expected a positive definite inertia, found {moments}"
    if low + middle < (1 - ROUNDING) * high:
        return (
            f"expected an inertia in which no principal moment exceeds the sum of the others, found {moments}"
        )
    if inertial.mass == 0 and high > 0:
        return f"expected no inertia without a mass, found mass 0 and {moments}"
    return None


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
                raise document.error(f"expected a unique name, found another {kind}{line}", item)
            first[item.name] = item


def _check_references(document: Document) -> None:
    links = [link.name for link in document.links]
    for joint in document.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise document.error(
                    f"expected a {role} among the links, found '{name}'{near(name, links)}", joint
                )
        if joint.parent == joint.child:
            raise document.error(f"expected two links, found '{joint.child}' as both parent and child", joint)


def _check_roots(document: Document) -> None:
    joint_of: dict[str, Joint] = {}
    for joint in document.joints:
        if joint.child in joint_of:
            raise document.error(
                f"expected a tree, in which link '{joint.child}' has one parent joint, found "
                f"'{joint_of[joint.child].name}' too",
                joint,
            )
        joint_of[joint.child] = joint
    roots = [link.name for link in document.links if link.name not in joint_of]
    if len(roots) > 1:
        raise document.error(
            f"expected one root link, found {len(roots)}: {_some(roots)}; "
            "each other link needs a joint whose child it is"
        )
    if not roots:
        raise document.error("expected a root link, found a cycle through every link")


def _check_reached(document: Document) -> None:
    reached = set(walk(document))
    lost = [link.name for link in document.links if link.name not in reached]
    if lost:
        raise document.error(
            f"expected every link to hang from '{document.root}', found a cycle of links: {_some(lost)}"
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


def _some(names: Iterable[str]) -> str:
    names = list(names)
    return ", ".join(map(repr, names[:5])) + (", ..." if len(names) > 5 else "")


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


def check_bodies(document: Document) -> None:
    """Refuse what cannot move as a mechanism: impossible inertias, joints without mass, mimic joints.

    Raises:
        RobotError: with the link or joint concerned.

    Warns:
        RobotWarning: an impossible inertia of a link that is fixed to the world, where it plays no part.
    """
    _check_links(document)
    links = {link.name for link in document.links}
    parameters = body_parameters(document)
    for joint in document.moving_joints:
        if fault := _joint_fault(joint, links) or _body_fault(joint, parameters[joint.name]):
            raise document.error(fault, joint)


def _check_links(document: Document) -> None:
    carrier = carriers(document)
    for link in document.links:
        fault = link.inertial and inertial_fault(link.inertial)
        if link.inertial is None or not fault:
            continue
        error = document.error(fault, link, part="inertial", line=link.inertial.line)
        if carrier[link.name][0] is not None:
            raise error
        warn(f"{error}; the link does not move, so this plays no part", RobotWarning)


def _joint_fault(joint: Joint, links: set[str]) -> str | None:
    if joint.mimics is not None:
        return (
            f"expected joints that move by themselves, found one that mimics '{joint.mimics}'; "
            "lock both (locked={...}), or remove <mimic>"
        )
    if joint.name in links:
        return "expected names that tell a moving joint from a link, found a link of the same name"
    return None


def _body_fault(joint: Joint, parameters: np.ndarray) -> str | None:
    mass, body = parameters[0], f"link '{joint.child}' and the links fixed to it"
    if mass <= 0:
        return f"{body}: expected a mass above 0 kg, found {mass:g}; does a link lack its <inertial>?"
    lowest, _, highest = principal_moments(parameters)
    if lowest <= 0 or lowest <= 1e-15 * abs(parameters[4:]).max():
        moments = f"principal moments from {lowest:g} to {highest:g} kg·m^2"
        return f"{body}: expected a positive definite inertia, found {moments}"
    return None


# -- the model ---------------------------------------------------------------------------------------------


def check_model(document: Document, model: pin.Model) -> None:
    """Refuse a model that is not what the document says, or whose dynamics are not those of a mechanism.

    Raises:
        RobotError: joints or inertial parameters differ, or H(q) is not positive definite.
    """
    joints = sorted(joint.name for joint in document.moving_joints)
    if sorted(model.names) != sorted([*joints, "universe"]):
        found = _some(model.names[1:])
        raise document.error(f"expected a model with the joints {_some(joints)}, found {found}", found=found)
    _check_inertias(document, model)
    for q in _configurations(model):
        _check_mass_matrix(document, model, q)


def _check_inertias(document: Document, model: pin.Model) -> None:
    expected = body_parameters(document)
    for joint in document.moving_joints:
        wanted = expected[joint.name]
        found = model.inertias[model.getJointId(joint.name)].toDynamicParameters()
        if abs(found - wanted).max() > ROUNDING * abs(wanted).max():
            raise document.error(
                f"expected a model with the inertial parameters of the document, {wanted}, found {found}",
                joint,
            )


def _configurations(model: pin.Model) -> list[np.ndarray]:
    """The neutral configuration and three others, the same in every run."""
    rng = np.random.default_rng(0)
    neutral = pin.neutral(model)
    return [neutral, *(pin.integrate(model, neutral, rng.uniform(-1, 1, model.nv)) for _ in range(3))]


def _check_mass_matrix(document: Document, model: pin.Model, q: np.ndarray) -> None:
    data = model.createData()
    H = pin.crba(model, data, q)
    gravity = pin.computeGeneralizedGravity(model, data, q)
    expected = "expected a positive definite mass matrix and finite gravity"
    if not (np.isfinite(H).all() and np.isfinite(gravity).all()):
        raise document.error(f"{expected}, found numbers that are not finite")
    # scaled to ones on the diagonal, so that units and sizes of joints do not matter
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    lowest, highest = np.linalg.eigvalsh(H / np.outer(scale, scale))[[0, -1]]
    if lowest <= 0 or highest / lowest > WORST_CONDITION:
        raise document.error(f"{expected}, found eigenvalues from {lowest:g} to {highest:g} after scaling")
