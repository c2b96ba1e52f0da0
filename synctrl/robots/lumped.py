"""Lumped inertial parameters: numbers that give the torques of a mechanism's bodies, with many of them zero.

Mass on the axis of a turning joint moves with the body before the joint as well as with that behind it, and
mass that only has a second moment moves through a sliding joint unnoticed. So what of a body is like that may
be counted to the body before it, from the tips to the base, where it does not matter any more (Khalil and
Dombre, *Modeling, Identification and Control of Robots*, 2002, chapter 9). Of a body behind a turning joint
seven of ten numbers remain. Of one that can only turn about one direction, such as all of a planar arm and
the first of any, one moment of inertia stands for six. Torques stay what they were.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from .mechanism import SNAP, Mechanism, MechanismJoint


class Body(NamedTuple):
    """Moments of mass of a body about its joint's origin, in its axes, as CasADi SX.

    Attributes:
        mass: integral of 1.
        first: integral of r, (3, 1).
        second: integral of r r^T, (3, 3); or one moment of inertia, (1, 1), about the direction that it may
            turn about.
    """

    mass: Any
    first: Any
    second: Any

    @property
    def planar(self) -> bool:
        """Whether there is one moment of inertia only."""
        return bool(self.second.numel() == 1)


class Lumping(NamedTuple):
    """How the parameters of a mechanism's bodies are lumped.

    Attributes:
        fixed: the mechanism.
        matrix: lumped ones from the ten of each body in Pinocchio's order, (count, 10 bodies).
        places: where the lumped ones stand among the ten numbers of each `Body`, (count,).
    """

    fixed: Mechanism
    matrix: np.ndarray
    places: np.ndarray

    @property
    def size(self) -> int:
        """How many lumped parameters there are."""
        return len(self.places)

    def bodies(self, numbers: Any) -> list[Body]:
        """The bodies of lumped parameters, (count, 1)."""
        import casadi as ca

        every = [ca.SX(0)] * (10 * len(self.fixed.joints))
        for k, place in enumerate(self.places.tolist()):
            every[place] = numbers[k]
        return [
            _unpacked(every[10 * i : 10 * i + 10], d is not None) for i, d in enumerate(spins(self.fixed))
        ]


def bodies_of(pi: Any) -> list[Body]:
    """Bodies as they are, of their parameters in Pinocchio's order, (10 bodies, 1)."""
    return [_body(pi[10 * i : 10 * i + 10], None) for i in range(pi.numel() // 10)]


def lumped_bodies(fixed: Mechanism, pi: Any) -> list[Body]:
    """Bodies with the same torques as those of some parameters, (10 bodies, 1)."""
    turning = spins(fixed)
    bodies = [_body(pi[10 * i : 10 * i + 10], d) for i, d in enumerate(turning)]
    for i in reversed(range(len(bodies))):
        joint = fixed.joints[i]
        passed, bodies[i] = (_rod if joint.turns else _spread)(joint, bodies[i])
        if joint.parent >= 0:
            bodies[joint.parent] = _joined(bodies[joint.parent], passed, joint, turning[joint.parent])
    return bodies


@lru_cache(maxsize=64)
def lumping(fixed: Mechanism) -> Lumping:
    """How the parameters of any such bodies are lumped; robots that were placed from one ask but once."""
    import casadi as ca

    pi = ca.SX.sym("pi", 10 * len(fixed.joints))
    entries = ca.vertcat(*map(_packed, lumped_bodies(fixed, pi)))
    matrix = np.array(ca.evalf(ca.jacobian(entries, pi)))
    places = np.flatnonzero(matrix.any(axis=1))
    return Lumping(fixed, matrix[places], places)


def spins(fixed: Mechanism) -> list[np.ndarray | None]:
    """The only direction about which each body may turn, in its axes; zeros if about none, None if any."""
    found: list[np.ndarray | None] = []
    for joint in fixed.joints:
        above = np.zeros(3) if joint.parent < 0 else found[joint.parent]
        if above is not None:
            above = _snapped(joint.rotation.T @ above)
            if joint.turns:
                above = None if _snapped(np.cross(above, joint.axis)).any() else joint.axis
        found.append(above)
    return found


# -- what a body hands on to the one before it ------------------------------------------------------------


def _rod(joint: MechanismJoint, body: Body) -> tuple[Body, Body]:
    """What lies on the axis of a turning joint, still in the body's axes, and the rest."""
    import casadi as ca

    axis = ca.SX(ca.DM(joint.axis))
    along = ca.dot(axis, body.first)
    sigma = ca.SX(0) if body.planar else ca.dot(axis, ca.mtimes(body.second, axis))
    rod = Body(body.mass, along, sigma)
    second = body.second if body.planar else body.second - sigma * ca.mtimes(axis, axis.T)
    return rod, Body(ca.SX(0), body.first - axis * along, second)


def _spread(joint: MechanismJoint, body: Body) -> tuple[Body, Body]:
    """The second moment, which a sliding joint hands on, and the rest."""
    import casadi as ca

    none = ca.SX(*body.second.shape)
    return Body(ca.SX(0), ca.SX(0), body.second), Body(body.mass, body.first, ca.densify(none))


def _joined(body: Body, passed: Body, joint: MechanismJoint, spin: np.ndarray | None) -> Body:
    """A body with what the one behind a joint hands on to it."""
    import casadi as ca

    if not joint.turns:
        R = ca.SX(ca.DM(joint.rotation))
        second = passed.second if body.planar else ca.mtimes(ca.mtimes(R, passed.second), R.T)
        return body._replace(second=body.second + second)
    p, axis = joint.translation, _snapped(joint.rotation @ joint.axis)
    mass, along, sigma = passed
    first = body.first + along * ca.SX(ca.DM(axis)) + mass * ca.SX(ca.DM(p))
    parts = [np.outer(p, p), np.outer(p, axis) + np.outer(axis, p), np.outer(axis, axis)]
    if spin is not None:
        parts = [np.array(np.trace(part) - spin @ part @ spin) for part in parts]
    whole, both, rod = (ca.SX(ca.sparsify(ca.DM(_snapped(part)))) for part in parts)
    return Body(body.mass + mass, first, body.second + (mass * whole + along * both + sigma * rod))


# -- numbers ----------------------------------------------------------------------------------------------


def _body(pi: Any, spin: np.ndarray | None) -> Body:
    """A body of its ten parameters."""
    import casadi as ca

    if spin is not None:
        rows = ((pi[4], pi[5], pi[7]), (pi[5], pi[6], pi[8]), (pi[7], pi[8], pi[9]))
        axis = ca.SX(ca.DM(spin))
        return Body(pi[0], pi[1:4], ca.dot(axis, ca.mtimes(_matrix(rows), axis)))
    half = 0.5 * (pi[4] + pi[6] + pi[9])
    return Body(
        pi[0], pi[1:4], _symmetric([half - pi[4], -pi[5], half - pi[6], -pi[7], -pi[8], half - pi[9]])
    )


def _packed(body: Body) -> Any:
    """Ten numbers of a body."""
    import casadi as ca

    second = body.second
    if body.planar:
        rest = [second, *[ca.SX(0)] * 5]
    else:
        rest = [second[i, j] for i, j in ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))]
    return ca.densify(ca.vertcat(body.mass, body.first, *rest))


def _unpacked(numbers: Sequence[Any], planar: bool) -> Body:
    """A body of its ten numbers."""
    import casadi as ca

    mass, first, rest = numbers[0], ca.vertcat(*numbers[1:4]), numbers[4:]
    return Body(mass, first, rest[0] if planar else _symmetric(rest))


def _symmetric(lower: Sequence[Any]) -> Any:
    """A symmetric matrix of xx, xy, yy, xz, yz and zz."""
    xx, xy, yy, xz, yz, zz = lower
    return _matrix(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _matrix(rows: Sequence[Sequence[Any]]) -> Any:
    import casadi as ca

    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def _snapped(values: np.ndarray) -> np.ndarray:
    """Without what is rounding beside numbers of size one."""
    return np.where(np.abs(values) < SNAP, 0.0, values)
