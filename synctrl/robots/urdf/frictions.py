"""Friction that a description states. It is known, and does not act unless somebody asks for it."""

from __future__ import annotations

from collections.abc import Iterator

from .document import Document
from .report import Note


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
