"""The tip of a robot: the frame at the end of its arm, unless another is asked for."""

from __future__ import annotations

import re
from collections.abc import Collection

from .branches import Branches
from .document import Document
from .report import Notes
from .xml import quoted

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
    tip, last = _outermost(document, end.child, held), _last(document)
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


def _last(document: Document) -> str:
    """The last link, in the order of the document, that carries no other."""
    parents = {joint.parent for joint in document.joints}
    return [link.name for link in document.links if link.name not in parents][-1]


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
    if tip not in {link.name for link in document.links} | {joint.name for joint in document.joints}:
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
