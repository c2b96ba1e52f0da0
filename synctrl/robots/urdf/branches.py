"""Which joints move what: chains from the base, the branches of a robot, its fingers, and its tip."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import cached_property

from .document import Document, Joint
from .report import Notes
from .xml import quoted

_FINGER = re.compile(r"finger|jaw|claw|knuckle|thumb", re.IGNORECASE)
_GRIPS = re.compile(r"grip", re.IGNORECASE)
_SHORTEST_ARM = 2
"""Joints that carry a body before branches on it count as its fingers."""


class Branches:
    """The moving joints of a document as a tree.

    Args:
        document: whose links and joints are one tree.
    """

    def __init__(self, document: Document):
        self.document = document
        self._above = {joint.child: joint for joint in document.joints}
        self.moving = {joint.name: joint for joint in document.moving_joints}
        #: by moving joint: all moving joints that carry it, and itself, from the base outward
        self.chains = {name: self.chain(joint.child) for name, joint in self.moving.items()}
        #: by moving joint: the moving joints on its body
        self.next: dict[str, list[str]] = {name: [] for name in self.moving}
        for name, chain in self.chains.items():
            if len(chain) > 1:
                self.next[chain[-2]].append(name)

    def chain(self, link: str) -> tuple[str, ...]:
        """Names of the moving joints that move a link, from the base outward."""
        chain: list[str] = []
        while link in self._above:
            joint = self._above[link]
            chain += [joint.name] if joint.moves else []
            link = joint.parent
        return tuple(reversed(chain))

    def moving_tip(self, tip: str | None) -> tuple[str, ...]:
        """Names of the joints that move a tip: a link or, if there is none of that name, a joint."""
        if tip is None or tip in {link.name for link in self.document.links}:
            return self.chain(tip or "")
        return self.chain(next((j.child for j in self.document.joints if j.name == tip), ""))

    def behind(self, chain: tuple[str, ...]) -> tuple[str, ...]:
        """How a chain of joints goes on to the end of its arm; not at all if there are several ways on."""
        found: tuple[str, ...] = ()
        on = [name for name in self.next[chain[-1]] if name not in self.fingers] if chain else []
        while len(on) == 1:
            found += (on[0],)
            on = [name for name in self.next[on[0]] if name not in self.fingers]
        return () if on else found

    def carried_by(self, name: str) -> set[str]:
        """A moving joint and all that it carries."""
        return {other for other, chain in self.chains.items() if name in chain}

    def joined(self, name: str) -> set[str]:
        """A moving joint, the one that it mimics, and those that mimic either."""
        leader = _leader(self.moving[name], self.moving)
        return {other for other, joint in self.moving.items() if _leader(joint, self.moving) == leader}

    @cached_property
    def fingers(self) -> frozenset[str]:
        """Moving joints that are no part of an arm, by their names, by what they mimic, or by their place.

        A finger carries fingers alone. It is called so; or it moves together with one beside it; or it is one
        of several last joints on a body that an arm carries.
        """
        found: set[str] = set()
        for name in sorted(self.moving, key=lambda name: -len(self.chains[name])):
            if self.carried_by(name) - {name} <= found and self._like_a_finger(name):
                found.add(name)
        return frozenset(found)

    def _like_a_finger(self, name: str) -> bool:
        joint, chain = self.moving[name], self.chains[name]
        if _GRIPS.search(joint.name) or _FINGER.search(f"{joint.name} {joint.child}"):
            return True
        beside = [
            other for other in self.joined(name) if other not in chain and name not in self.chains[other]
        ]
        last = [other for other in self.next.get(chain[-2], []) if not self.next[other]] if chain[:-1] else []
        return bool(beside) or (len(chain) > _SHORTEST_ARM and len(last) > 1 and name in last)

    @cached_property
    def ends(self) -> tuple[str, ...]:
        """The last joint of each branch that is no finger, the longest branch first."""
        arm = [name for name in self.moving if name not in self.fingers] or list(self.moving)
        last = [name for name in arm if not self.carried_by(name) & (set(arm) - {name})]
        return tuple(sorted(last, key=lambda name: -len(self.chains[name])))

    @property
    def longest(self) -> tuple[str, ...]:
        """The joints of the longest branch that is no finger, from the base outward."""
        return self.chains[self.ends[0]] if self.ends else ()


def _leader(joint: Joint, moving: dict[str, Joint]) -> str:
    """The joint that is followed in the end; where joints follow each other, one of them."""
    seen = [joint.name]
    while joint.mimic is not None and joint.mimic.joint in moving and joint.mimic.joint not in seen:
        joint = moving[joint.mimic.joint]
        seen.append(joint.name)
    return joint.name


# -- the tip -----------------------------------------------------------------------------------------------

_TOOL = re.compile(r"tcp|tool|tip|(?<![a-z])eef?(?![a-z])|effector|grasp|flange|hand|gripper", re.IGNORECASE)
_SENSOR = re.compile(r"camera|sensor|imu|lidar|laser", re.IGNORECASE)


def default_tip(document: Document, held: Collection[str], notes: Notes) -> str:
    """The link at the end of the longest branch of moving joints that is no finger.

    Of the links that are fixed there it is the last that carries no other, one named as a tool before others;
    a held joint leads to no further ones.

    Args:
        document: one tree, with held joints fixed in it.
        held: the names of these.
        notes: where several branches are remarked.
    """
    branches = Branches(document)
    end = branches.moving[branches.ends[0]]
    tip, parents = _outermost(document, end.child, held), {joint.parent for joint in document.joints}
    last = [link.name for link in document.links if link.name not in parents][-1]
    where = f"robot {quoted(document.name)}"
    others = [name for name in branches.moving if name not in branches.chains[end.name]]
    if others:
        notes.add(
            "suspicious",
            where,
            f"several branches move: the tip is taken to be {quoted(tip)}, and these do not move it: "
            f"{', '.join(map(quoted, others[:8]))}; with tip=... all joints are held that do not move it",
        )
    elif not branches.chain(last):
        notes.add(
            "assumed", where, f"the tip is taken to be {quoted(tip)}; {quoted(last)} is fixed to the base"
        )
    return tip


def _outermost(document: Document, link: str, held: Collection[str]) -> str:
    """The outermost of the links that are fixed to a link."""
    fixed: dict[str, list[str]] = {}
    for joint in document.joints:
        if not joint.moves and joint.name not in held and not _SENSOR.search(joint.child):
            fixed.setdefault(joint.parent, []).append(joint.child)
    found = [link]
    for name in found:
        found += fixed.get(name, [])
    order = [item.name for item in document.links]
    last = sorted((name for name in found if name not in fixed), key=order.index)
    return ([name for name in last if _TOOL.search(name)] or last)[-1]


def check_tip(document: Document, tip: str | None, notes: Notes) -> None:
    """Remark a tip that the user asked for, but that no joint moves, or a finger; nothing is held yet."""
    links, joints = ({item.name for item in items} for items in (document.links, document.joints))
    if tip not in links | joints | {"universe"}:
        return
    branches = Branches(document)
    chain = branches.moving_tip(tip)
    where = f"robot {quoted(document.name)}"
    if not chain:
        notes.add("suspicious", where, f"the tip {quoted(str(tip))} is fixed to the base: no joint moves it")
    elif chain[-1] in branches.fingers:
        notes.add(
            "suspicious", where, f"the tip {quoted(str(tip))} is on a finger, which {quoted(chain[-1])} moves"
        )
