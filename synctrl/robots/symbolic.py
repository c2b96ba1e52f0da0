"""Rigid-body algorithms over a Pinocchio model, written with CasADi symbols.

They are what the compiled engine is generated from. The recursions are those of Featherstone, *Rigid Body
Dynamics Algorithms* (2008), in body coordinates. Every function is checked against Pinocchio by a test, and
generated code again whenever it is built.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .lumped import Body, spins
from .mechanism import Mechanism, MechanismJoint


class Field(NamedTuple):
    """How the points r of a body accelerate, A + B r, in its axes.

    Attributes:
        A, B: (3, 1) and (3, 3).
        turning: what of B is a rate of turning, B's skew part, (3, 1).
    """

    A: Any
    B: Any
    turning: Any


class Symbols:
    """The recursions for one mechanism at symbolic joint positions.

    Args:
        fixed: the mechanism.
        q: joint positions, CasADi SX, (nv, 1).
        sine, cosine: of the joint positions; given so that they are computed once.
    """

    def __init__(self, fixed: Mechanism, q: Any, sine: Any, cosine: Any):
        import casadi as ca

        self.ca, self.fixed, self._sine, self._cosine = ca, fixed, sine, cosine
        self.R: list[Any] = []
        self.p: list[Any] = []
        self.spins = [ca.SX(ca.DM(np.zeros(3) if d is None else d)) for d in spins(fixed)]
        for i, joint in enumerate(fixed.joints):
            turn = _rotation(ca, joint.axis, sine[i], cosine[i]) if joint.turns else ca.SX.eye(3)
            slide = 0 if joint.turns else ca.SX(joint.axis) * q[i]
            self.R.append(ca.mtimes(ca.SX(joint.rotation), turn))
            self.p.append(
                ca.SX(joint.translation) + ca.mtimes(ca.SX(joint.rotation), ca.SX(slide * ca.SX.ones(3, 1)))
            )

    # -- kinematics in the world --------------------------------------------------------------------------

    def tip(self, v: Any, base_rotation: Any, base_translation: Any) -> tuple[Any, Any, Any, Any]:
        """Position, rotation, Jacobian and Jacobian's derivative of the tip, in world axes.

        Args:
            v: joint velocities, (nv, 1).
            base_rotation, base_translation: placement of the first joint in the world.
        """
        ca, joints = self.ca, self.fixed.joints
        R: list[Any] = []
        p, w, pd, axes = list(R), list(R), list(R), list(R)
        for i, joint in enumerate(joints):
            if joint.parent < 0:
                R_up, p_up, w_up, pd_up = base_rotation, base_translation, ca.SX.zeros(3), ca.SX.zeros(3)
            else:
                R_up, p_up, w_up, pd_up = (part[joint.parent] for part in (R, p, w, pd))
            R.append(ca.mtimes(R_up, self.R[i]))
            arm = ca.mtimes(R_up, self.p[i])
            axis = ca.mtimes(R[i], ca.SX(joint.axis))
            axes.append(axis)
            p.append(p_up + arm)
            w.append(w_up + axis * v[i] if joint.turns else w_up)
            pd.append(pd_up + ca.cross(w_up, arm) + (0 if joint.turns else axis * v[i]))
        k = self.fixed.tip_parent
        reach = ca.mtimes(R[k], ca.SX(self.fixed.tip_translation))
        x, x_dot = p[k] + reach, pd[k] + ca.cross(w[k], reach)
        J, J_dot = self._jacobians(axes, p, w, pd, x, x_dot)
        return x, ca.mtimes(R[k], ca.SX(self.fixed.tip_rotation)), J, J_dot

    def _jacobians(self, axes: list, p: list, w: list, pd: list, x: Any, x_dot: Any) -> tuple[Any, Any]:
        """Column by column: axis x lever and axis for a turning joint, axis and 0 for a sliding one."""
        ca, joints = self.ca, self.fixed.joints
        J, J_dot = ca.SX.zeros(6, len(joints)), ca.SX.zeros(6, len(joints))
        for i in self._chain():
            axis, axis_dot = axes[i], ca.cross(w[i], axes[i])
            if joints[i].turns:
                lever, lever_dot = x - p[i], x_dot - pd[i]
                J[:, i] = ca.vertcat(ca.cross(axis, lever), axis)
                J_dot[:, i] = ca.vertcat(ca.cross(axis_dot, lever) + ca.cross(axis, lever_dot), axis_dot)
            else:
                J[:3, i], J_dot[:3, i] = axis, axis_dot
        return J, J_dot

    def _chain(self) -> list[int]:
        """Joints between the base and the tip."""
        chain, i = [], self.fixed.tip_parent
        while i >= 0:
            chain.append(i)
            i = self.fixed.joints[i].parent
        return chain

    # -- dynamics in body coordinates ---------------------------------------------------------------------

    def torque(self, bodies: Sequence[Body], v: Any, v_ref: Any, a_ref: Any, gravity: Any) -> Any:
        """M a_ref + C(v) v_ref + g, (nv, 1), with the symmetric C of Christoffel symbols.

        One recursion with two velocities: every quadratic term of the Newton-Euler recursion is replaced by
        half the sum over both orders of its two factors.

        Args:
            bodies: what moves.
            v, v_ref, a_ref: (nv, 1).
            gravity: acceleration of gravity in the frame of the first joint's placement, (3, 1).
        """
        return self._gather(self.forces(bodies, self.fields((v, 0.5 * v_ref), v_ref, a_ref, gravity)))

    def bias(self, bodies: Sequence[Body], v: Any, gravity: Any) -> Any:
        """C(v) v + g, (nv, 1): `torque` without an acceleration, where both velocities are one."""
        return self._gather(self.biased(bodies, v, gravity))

    def biased(self, bodies: Sequence[Body], v: Any, gravity: Any) -> list[tuple[Any, Any]]:
        """Forces on bodies whose joints do not accelerate."""
        return self.forces(bodies, self.fields((v,), v, self.ca.SX.zeros(len(self.R)), gravity))

    def forces(self, bodies: Sequence[Body], fields: Sequence[Field]) -> list[tuple[Any, Any]]:
        """Force on every body and its moment: integrals of A + B r and r x (A + B r) over its mass."""
        ca, found = self.ca, []
        for (mass, first, second), (A, B, turning), d in zip(bodies, fields, self.spins, strict=True):
            moment = second * d * ca.dot(d, turning) if second.numel() == 1 else _moment(ca, B, second)
            found.append((mass * A + ca.mtimes(B, first), ca.cross(first, A) + moment))
        return found

    def mass_matrix(self, bodies: Sequence[Body]) -> Any:
        """M(q) with armature, (nv, nv), by the composite-rigid-body algorithm."""
        ca, joints = self.ca, self.fixed.joints
        composite = list(bodies)
        for i in reversed(range(len(joints))):
            if (up := joints[i].parent) >= 0:
                composite[up] = self._composed(composite[up], composite[i], i)
        M = ca.SX.zeros(len(joints), len(joints))
        for i, joint in enumerate(joints):
            force = _momentum(ca, composite[i], joint)
            M[i, i] = self._project(joint, force) + joint.armature
            j = i
            while joints[j].parent >= 0:
                force = self.up(j, force)
                j = joints[j].parent
                M[i, j] = M[j, i] = self._project(joints[j], force)
        return M

    # -- steps of the recursions --------------------------------------------------------------------------

    def fields(self, speeds: Sequence[Any], v_ref: Any, a_ref: Any, gravity: Any) -> list[Field]:
        """How all bodies accelerate; gravity is an acceleration of the base.

        Args:
            speeds: v and half of v_ref; or v alone, which v_ref is then.
            v_ref, a_ref: (nv, 1).
            gravity: (3, 1).
        """
        ca, zero = self.ca, self.ca.SX.zeros(3)
        nothing = (zero,) * len(speeds), Field(-gravity, ca.SX.zeros(3, 3), zero)
        turns: list[tuple[Any, ...]] = []
        found: list[Field] = []
        for i, joint in enumerate(self.fixed.joints):
            back, axis, up = self.R[i].T, ca.SX(joint.axis), joint.parent
            w, (A, B, turning) = nothing if up < 0 else (turns[up], found[up])
            w = tuple(ca.mtimes(back, part) for part in w)
            A, turning = ca.mtimes(back, A + ca.mtimes(B, self.p[i])), ca.mtimes(back, turning)
            own = [axis * part[i] for part in speeds]
            swept = sum(map(ca.cross, w, reversed(own)), zero)  # half of what turns the axis
            if joint.turns:
                w = tuple(map(operator.add, w, own))
                turning += axis * a_ref[i] + swept
            else:
                A += axis * a_ref[i] + 2 * swept
            turns.append(w)
            found.append(Field(A, ca.skew(turning) + _centripetal(ca, *w), turning))
        return found

    def _gather(self, forces: list) -> Any:
        tau = [self.ca.SX(0)] * len(forces)
        for i in reversed(range(len(forces))):
            joint = self.fixed.joints[i]
            tau[i] = self._project(joint, forces[i])
            if joint.parent >= 0:
                forces[joint.parent] = _add(forces[joint.parent], self.up(i, forces[i]))
        return self.ca.vertcat(*tau)

    def _project(self, joint: MechanismJoint, force: Sequence) -> Any:
        return self.ca.dot(self.ca.SX(joint.axis), force[1] if joint.turns else force[0])

    def up(self, i: int, force: Sequence) -> tuple[Any, Any]:
        """A force on body i, seen from its parent."""
        ca, R = self.ca, self.R[i]
        push, twist = ca.mtimes(R, force[0]), ca.mtimes(R, force[1])
        return push, twist + ca.cross(self.p[i], push)

    def _composed(self, parent: Body, body: Body, i: int) -> Body:
        """A parent together with body i: there r is R r + p."""
        ca, R, p, d = self.ca, self.R[i], self.p[i], self.spins[self.fixed.joints[i].parent]
        mass, first, second = body
        turned = ca.mtimes(R, first)
        whole, doubled = turned + mass * p, 2 * turned + mass * p
        if parent.planar:
            inertia = second if body.planar else _about(ca, second, ca.mtimes(R.T, d))
            inertia += ca.dot(doubled, p) - ca.dot(d, doubled) * ca.dot(d, p)
        else:
            half = ca.mtimes(0.5 * doubled, p.T)
            inertia = symmetric(ca, self.turned(i, second) + half + half.T)
        return Body(parent.mass + mass, parent.first + whole, parent.second + inertia)

    def turned(self, i: int, S: Any) -> Any:
        """R S R^T of a matrix, (3, 3); about an axis of coordinates with few products."""
        ca, joint = self.ca, self.fixed.joints[i]
        R, place = self.R[i], np.flatnonzero(joint.axis)
        if joint.turns and len(place) == 1:
            z = int(place[0])
            S = _turned(ca, S, z, joint.axis[z] * self._sine[i], self._cosine[i])
            R = ca.SX(ca.sparsify(ca.DM(joint.rotation)))
        return ca.densify(ca.mtimes(ca.mtimes(R, S), R.T))


def _turned(ca: Any, S: Any, z: int, s: Any, c: Any) -> Any:
    """R S R^T for a turn about an axis of coordinates, of which sine and cosine are given."""
    x, y = (z + 1) % 3, (z + 2) % 3
    gap, both = S[x, x] - S[y, y], S[x, y] + S[y, x]
    squared, product = s * s, s * c
    shift, shear = squared * gap + product * both, product * gap - squared * both
    T = ca.SX.zeros(3, 3)
    T[x, x], T[y, y], T[z, z] = S[x, x] - shift, S[y, y] + shift, S[z, z]
    T[x, y], T[y, x] = S[x, y] + shear, S[y, x] + shear
    T[x, z], T[y, z] = c * S[x, z] - s * S[y, z], s * S[x, z] + c * S[y, z]
    T[z, x], T[z, y] = c * S[z, x] - s * S[z, y], s * S[z, x] + c * S[z, y]
    return T


def symmetric(ca: Any, matrix: Any) -> Any:
    """A symmetric matrix by its lower half: what stands above it is not computed again."""
    return ca.densify(ca.tril2symm(ca.tril(matrix)))


def _moment(ca: Any, B: Any, S: Any) -> Any:
    """Integral of r x (B r), of which S is that of r r^T: what B S has more on one side than on the other."""
    rows = []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        sides = B[j, k] * S[k, i] - B[i, k] * S[k, j] + B[j, i] * S[i, i] - B[i, j] * S[j, j]
        rows.append(sides + (B[j, j] - B[i, i]) * S[i, j])
    return ca.vertcat(*rows)


def _about(ca: Any, S: Any, d: Any) -> Any:
    """Moment of inertia about a direction, of which S is the integral of r r^T."""
    return ca.trace(S) - ca.dot(d, ca.mtimes(S, d))


def _momentum(ca: Any, body: Body, joint: MechanismJoint) -> tuple[Any, Any]:
    """Linear and angular momentum of a body about its joint, of which the velocity is one."""
    mass, first, second = body
    axis = ca.SX(joint.axis)
    if not joint.turns:
        return mass * axis, ca.cross(first, axis)
    angular = second * axis if body.planar else ca.trace(second) * axis - ca.mtimes(second, axis)
    return ca.cross(axis, first), angular


def _centripetal(ca: Any, a: Any, half: Any = None) -> Any:
    """[a][a]; or ([a][b] + [b][a]) / 2 = (a b^T + b a^T) / 2 - (a . b) I, given half of b."""
    b = a if half is None else half
    square = (a[k] * b[k] for k in range(3))
    if half is None:
        x, y, z = square
        xy, xz, yz = (a[j] * a[k] for j, k in ((0, 1), (0, 2), (1, 2)))
        sums = y + z, x + z, x + y
    else:
        x, y, z = square
        xy, xz, yz = (a[j] * b[k] + a[k] * b[j] for j, k in ((0, 1), (0, 2), (1, 2)))
        sums = 2 * (y + z), 2 * (x + z), 2 * (x + y)
    rows = ((-sums[0], xy, xz), (xy, -sums[1], yz), (xz, yz, -sums[2]))
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def _rotation(ca: Any, axis: np.ndarray, sine: Any, cosine: Any) -> Any:
    """Rodrigues' formula; for an axis along a coordinate the constant entries stay constant."""
    along = np.outer(axis, axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return ca.SX(along) + ca.SX(np.eye(3) - along) * cosine + ca.SX(skew) * sine


def _add(*parts: Sequence) -> tuple[Any, Any]:
    return sum(part[0] for part in parts), sum(part[1] for part in parts)
