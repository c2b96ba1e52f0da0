"""The articulated-body algorithm with CasADi symbols: operations of n joints grow like n.

What a body with all that hangs from it opposes to an acceleration is found from the tips to the base, while
its joints are free to give way; then the joints' accelerations follow from the base to the tips
(Featherstone, *Rigid Body Dynamics Algorithms*, 2008, chapter 7). Only its pivots have to be positive, and
they are those of the mass matrix, so bodies may be lumped.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .lumped import Body
from .symbolic import Symbols, symmetric


class Opposition(NamedTuple):
    """Force and moment about a joint's origin per acceleration of that point, and of turning.

    Attributes:
        push: force per acceleration, symmetric, (3, 3).
        mixed: force per acceleration of turning; transposed, moment per acceleration, (3, 3).
        twist: moment per acceleration of turning, symmetric, (3, 3).
    """

    push: Any
    mixed: Any
    twist: Any


class Pivot(NamedTuple):
    """What a joint gives way to.

    Attributes:
        push, twist: acceleration of the joint per acceleration of the body's point and of turning, (3, 1).
        alone: its acceleration where the body before it is at rest.
    """

    push: Any
    twist: Any
    alone: Any


def accelerations(recursion: Symbols, bodies: Sequence[Body], forces: Sequence, tau: Any) -> Any:
    """v', (nv, 1), of joints with armature.

    Args:
        recursion: at the joint positions.
        bodies: what moves.
        forces: on bodies whose joints do not accelerate, see `Symbols.biased`.
        tau: torques at the joints, (nv, 1).
    """
    joints, ca = recursion.fixed.joints, recursion.ca
    opposed = [_of_body(ca, body, spin) for body, spin in zip(bodies, recursion.spins, strict=True)]
    acting, pivots = list(forces), {}
    for i in reversed(range(len(joints))):
        pivots[i], rest, passed = _give_way(ca, joints[i], opposed[i], acting[i], tau[i])
        up = joints[i].parent
        if up >= 0:
            opposed[up] = Opposition(*_add(opposed[up], _moved(recursion, i, rest)))
            acting[up] = tuple(_add(acting[up], recursion.up(i, passed)))
    return ca.vertcat(*_outwards(recursion, pivots))


def _of_body(ca: Any, body: Body, spin: Any) -> Opposition:
    """What one body opposes."""
    twist = body.second * ca.mtimes(spin, spin.T) if body.planar else ca.trace(body.second) * ca.SX.eye(3)
    return Opposition(
        body.mass * ca.SX.eye(3),
        -ca.skew(body.first),
        ca.densify(twist if body.planar else twist - body.second),
    )


def _give_way(ca: Any, joint: Any, body: Opposition, force: Any, tau: Any) -> tuple[Pivot, Opposition, Any]:
    """A joint that gives way, what remains of the opposition, and of the force on the body."""
    axis = ca.SX(joint.axis)
    if joint.turns:
        push, twist = ca.mtimes(body.mixed, axis), ca.mtimes(body.twist, axis)
    else:
        push, twist = ca.mtimes(body.push, axis), ca.mtimes(body.mixed.T, axis)
    pivot = ca.dot(axis, twist if joint.turns else push) + joint.armature
    alone = (tau - ca.dot(axis, force[joint.turns])) / pivot
    by = Pivot(push / pivot, twist / pivot, alone)
    rest = Opposition(
        symmetric(ca, body.push - ca.mtimes(push, by.push.T)),
        body.mixed - ca.mtimes(push, by.twist.T),
        symmetric(ca, body.twist - ca.mtimes(twist, by.twist.T)),
    )
    passed = [part + U * alone for part, U in zip(force, (push, twist), strict=True)]
    along = np.flatnonzero(joint.axis)
    if len(along) == 1:  # what reaches the body before it along the axis is what the motor gives
        sign, k = float(joint.axis[along[0]]), int(along[0])
        passed[joint.turns][k] = sign * (tau - joint.armature * alone)
    return by, rest, tuple(passed)


def _moved(recursion: Symbols, i: int, body: Opposition) -> Opposition:
    """What body i opposes, seen from its parent."""
    ca = recursion.ca
    push, mixed, twist = (recursion.turned(i, part) for part in body)
    push, cross = symmetric(ca, push), ca.skew(recursion.p[i])
    far = mixed - ca.mtimes(push, cross)
    return Opposition(push, far, symmetric(ca, twist - ca.mtimes(mixed.T, cross) + ca.mtimes(cross, far)))


def _outwards(recursion: Symbols, pivots: dict[int, Pivot]) -> list[Any]:
    """Accelerations of all joints, from the base on."""
    ca, found = recursion.ca, []
    bodies: list[tuple[Any, Any]] = []
    for i, joint in enumerate(recursion.fixed.joints):
        pushed = turned = ca.SX.zeros(3)
        if joint.parent >= 0:
            pushed, turned = bodies[joint.parent]
            back = recursion.R[i].T
            pushed, turned = (
                ca.mtimes(back, pushed + ca.cross(turned, recursion.p[i])),
                ca.mtimes(back, turned),
            )
        push, twist, alone = pivots[i]
        found.append(alone - (ca.dot(push, pushed) + ca.dot(twist, turned)))
        own = ca.SX(joint.axis) * found[i]
        bodies.append((pushed, turned + own) if joint.turns else (pushed + own, turned))
    return found


def _add(first: tuple, second: tuple) -> list[Any]:
    return [a + b for a, b in zip(first, second, strict=True)]
