"""Documents with something in the place of what a file says, or lacks: inertials, and joints that are held.

Held are joints that the user names, and those that cannot move by themselves. That comes first: limits and
masses of a joint that is held are not asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...checks import finite_array, finite_number, instance, positive_number, symmetric_matrix
from ...errors import InputError, near
from .branches import Branches
from .checks import body_parameters, carriers
from .document import INERTIA, Document, Inertial, Joint, Limit, Link, Pose, upper_triangle
from .parts import FARTHEST
from .report import Notes
from .xml import quoted

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
            expected = f"expected links of {document.source}"
            raise InputError(f"{expected}, found {found}", subject="inertials", found=found)
    given = {name: _inertial(f"inertials[{name!a}]", value) for name, value in inertials.items()}
    links = (replace(link, inertial=given.get(link.name, link.inertial)) for link in document.links)
    return replace(document, links=tuple(links))


def _inertial(subject: str, value: Inertial | Mapping[str, Any]) -> Inertial:
    if isinstance(value, Inertial):
        return value
    instance(subject, value, Mapping, "an Inertial or a mapping")
    for key in value:
        if key not in KEYS:
            raise InputError(f"expected {', '.join(KEYS)}, found {key!a}", subject=subject, found=key)
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


# -- joints that are held ----------------------------------------------------------------------------------

Found = dict[str, tuple[float, str]]
"""By joint: the position at which it is held, and why."""


def lock_joints(document: Document, positions: Mapping[str, float]) -> Document:
    """The document with joints held at positions, in rad or m: they become fixed joints.

    Raises:
        RobotError: no such moving joint, or a position outside its limits.
        InputError: a position that is no finite number.
    """
    instance("locked", positions, Mapping, "positions by the names of joints")
    moving = {joint.name: joint for joint in document.moving_joints}
    for name, position in positions.items():
        if name not in moving:
            raise document.error(
                f"expected moving joints to lock, found {quoted(str(name))}{near(str(name), moving)}; "
                f"they are: {', '.join(map(quoted, moving))}",
                found=name,
            )
        _check_position(document, moving[name], finite_number(f"position of {moving[name].title}", position))
    return _fixed(document, {name: float(position) for name, position in positions.items()})


def _check_position(document: Document, joint: Joint, position: float) -> None:
    limit = joint.limit
    if limit is None or limit.lower is None or limit.upper is None or limit.lower >= limit.upper:
        return
    if not limit.lower <= position <= limit.upper:
        expected = f"expected a position from {limit.lower:g} to {limit.upper:g}"
        raise document.error(f"{expected}, found {position:g}", joint, found=position)


def _fixed(document: Document, positions: Mapping[str, float]) -> Document:
    for joint in document.moving_joints:
        if abs(position := positions.get(joint.name, 0.0)) > FARTHEST:
            raise document.error(f"expected to be held at {FARTHEST:g} at most, found {position:g}", joint)
    joints = (j.fixed(positions[j.name]) if j.name in positions else j for j in document.joints)
    return replace(document, joints=tuple(joints))


def settle_locks(
    document: Document, asked: Mapping[str, float], tip: str | None, notes: Notes
) -> tuple[Document, dict[str, float]]:
    """The document with everything held that the user asks for, or that cannot move by itself.

    Args:
        document: one tree.
        asked: positions by joint, rad or m.
        tip: the tip that the user asks for: joints that do not move it are held.
        notes: where each joint that is held unasked is named.

    Returns:
        The document, and the positions of the joints that are held in it.
    """
    document, held = lock_joints(document, asked), {name: float(q) for name, q in asked.items()}
    steps = (partial(_leaders, tip=tip), partial(_followers, held=held), partial(_beside, tip=tip))
    for find in (*steps, _virtual, _gripped, partial(_massless, tip=tip)):
        document = _hold_found(document, find(document), held, notes)
    document = _without_range(document, notes)
    return _hold_found(document, _narrow(document), held, notes), held


def _hold_found(document: Document, found: Found, held: dict[str, float], notes: Notes) -> Document:
    """The document with what was found held, told and taken down."""
    moving = {joint.name: joint for joint in document.moving_joints}
    for name, (position, reason) in found.items():
        joint = moving[name]
        notes.add("locked", joint.title, f"held at {position:g} {joint.unit}: {reason}", joint.line)
        held[name] = position
    return _fixed(document, {name: position for name, (position, _) in found.items()})


def _rest(joint: Joint) -> float:
    return 0.0 if joint.limit is None else joint.limit.rest


def _followers(document: Document, held: Mapping[str, float]) -> Found:
    """Joints that mimic another: where that one is, or rests."""
    joints, found = {joint.name: joint for joint in document.joints}, Found()
    for joint in document.moving_joints:
        if joint.mimic is not None:
            lost = "" if joint.mimic.joint in joints else ", which there is not"
            reason = f"it follows joint {quoted(joint.mimic.joint)}{lost}"
            found[joint.name] = _followed(joint, joints, held, ()), reason
    return found


def _followed(
    joint: Joint, joints: Mapping[str, Joint], held: Mapping[str, float], seen: tuple[str, ...]
) -> float:
    """Where a joint is, in rad or m, if what it follows is held or rests."""
    if joint.name in held or joint.mimic is None or joint.name in seen:
        return held.get(joint.name, _rest(joint))
    leader = joints.get(joint.mimic.joint)
    position = 0.0 if leader is None else _followed(leader, joints, held, (*seen, joint.name))
    return joint.mimic.offset + joint.mimic.multiplier * position


def _leaders(document: Document, tip: str | None) -> Found:
    """Fingers that others follow: without these, which are held, they would be half a gripper."""
    branches, found = Branches(document), Found()
    kept = {*branches.moving_tip(tip), *(set(branches.moving) - branches.fingers)} or set(branches.moving)
    for name, joint in branches.moving.items():
        others = branches.joined(name) - {name}
        if joint.mimic is None and others and name not in kept:
            found[name] = _rest(joint), f"joint {quoted(min(others))} follows it, and is held"
    return found


def _beside(document: Document, tip: str | None) -> Found:
    """Joints beside the tip that was asked for, if any joint moves it.

    An arm that goes on behind its tip is not cut there: its joints move the load that the others carry.
    """
    branches = Branches(document)
    chain = branches.moving_tip(tip)
    chain += branches.behind(chain)
    reason = f"it does not move the tip {quoted(str(tip))}"
    others = {name: joint for name, joint in branches.moving.items() if name not in chain}
    return {name: (_rest(joint), reason) for name, joint in others.items()} if chain else {}


def _massless(document: Document, tip: str | None) -> Found:
    """Fingers and sliding last joints that carry no mass: nothing says how they would move."""
    branches, parameters = Branches(document), body_parameters(document)
    arm = branches.moving_tip(tip) if tip is not None else branches.longest
    return {
        name: (_rest(joint), f"link {quoted(joint.child)} and what it carries have no mass")
        for name, joint in branches.moving.items()
        if (name not in arm or (joint.type == "prismatic" and tip is None))
        and not any(parameters[carried][0] for carried in branches.carried_by(name))
    }


def _virtual(document: Document) -> Found:
    """Joints of a base that is none, as planners need it: two or more, one of them sliding.

    Their bodies have neither mass nor shape; of a base that turns and then drives, the one that drives may.
    """
    branches, parameters, carrier = Branches(document), body_parameters(document), carriers(document)
    seen = {carrier[link.name][0] for link in document.links if link.visuals or link.collisions}
    chain: list[str] = []
    on = [name for name, above in branches.chains.items() if len(above) == 1]
    while len(on) == 1 and not parameters[on[0]][0] and on[0] not in seen:
        chain, on = [*chain, on[0]], branches.next[on[0]]
    slides = {name for name, joint in branches.moving.items() if joint.type == "prismatic"}
    if len(on) == 1 and on[0] in slides and not slides.intersection(chain):
        chain, on = [*chain, on[0]], branches.next[on[0]]
    if len(chain) < 2 or not slides.intersection(chain) or not on:
        return {}
    return {name: (_rest(branches.moving[name]), "it moves a base without mass or shape") for name in chain}


def _gripped(document: Document) -> Found:
    """Fingers of a last link that weighs nothing without them: what the arm carries is they."""
    branches, parameters = Branches(document), body_parameters(document)
    found: Found = {}
    for name, joint in branches.moving.items():
        on = set(branches.next[name])
        if name not in branches.fingers and on and on <= branches.fingers and not parameters[name][0]:
            reason = f"it is a finger of link {quoted(joint.child)}, which has no mass of its own"
            fingers = branches.carried_by(name) - {name}
            found |= {finger: (_rest(branches.moving[finger]), reason) for finger in fingers}
    return found


# -- ranges of no length -----------------------------------------------------------------------------------


def _is_narrow(joint: Joint) -> bool:
    limit = joint.limit
    return limit is not None and limit.lower is not None and limit.lower == limit.upper


def _without_range(document: Document, notes: Notes) -> Document:
    """If every joint of the arm has the range 0 to 0, the file knows no ranges: there are none."""
    branches = Branches(document)
    arm = [joint for name, joint in branches.moving.items() if name not in branches.fingers]
    if not arm or not all(_is_narrow(joint) and _rest(joint) == 0 for joint in arm):
        return document
    for joint in arm:
        notes.add("assumed", f"{joint.title}, limit", "the range 0 to 0 of every joint is none", joint.line)
    opened = {j.name: replace(j, limit=replace(j.limit or Limit(), lower=None, upper=None)) for j in arm}
    return replace(document, joints=tuple(opened.get(j.name, j) for j in document.joints))


def _narrow(document: Document) -> Found:
    """Joints whose range has no length."""
    return {
        joint.name: (_rest(joint), f"its range is {_rest(joint):g} to {_rest(joint):g}")
        for joint in document.moving_joints
        if _is_narrow(joint)
    }
