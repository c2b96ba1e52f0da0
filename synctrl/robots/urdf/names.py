"""Names of robots, links and joints: any text, escaped where it is shown; said where that may surprise."""

from __future__ import annotations

import re

from .document import Document
from .report import Notes
from .xml import quoted

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
