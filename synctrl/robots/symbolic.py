"""Rigid-body algorithms over a Pinocchio model, written with CasADi symbols.

They are what the compiled engine is generated from. The recursions are those of Featherstone, *Rigid Body
Dynamics Algorithms* (2008), in body coordinates. Every function is checked against Pinocchio by a test, and
generated code again whenever it is built.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .mechanism import Mechanism, MechanismJoint


class Symbols:
    """The recursions for one mechanism at symbolic joint positions.

    Args:
        fixed: the mechanism.
        q: joint positions, CasADi SX, (nv, 1).
        sine, cosine: of the joint positions; given so that they are computed once.
    """

    def __init__(self, fixed: Mechanism, q: Any, sine: Any, cosine: Any):
        import casadi as ca

        self.ca, self.fixed = ca, fixed
        self._R, self._p = [], []
        for i, joint in enumerate(fixed.joints):
            turn = _rotation(ca, joint.axis, sine[i], cosine[i]) if joint.turns else ca.SX.eye(3)
            slide = 0 if joint.turns else ca.SX(joint.axis) * q[i]
            self._R.append(ca.mtimes(ca.SX(joint.rotation), turn))
            self._p.append(
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
            R.append(ca.mtimes(R_up, self._R[i]))
            arm = ca.mtimes(R_up, self._p[i])
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

    def torque(self, pi: Any, v: Any, v_ref: Any, a_ref: Any, gravity: Any) -> Any:
        """M a_ref + C(v) v_ref + g, (nv, 1), with the symmetric C of Christoffel symbols.

        One recursion with two velocities: every quadratic term of the Newton-Euler recursion is replaced by
        half the sum over both orders of its two factors. The points r of a body accelerate with A + B r, and
        the force on the body and its moment are the integrals of A + B r and r x (A + B r) over its mass.

        Args:
            pi: inertial parameters, (10 bodies, 1), in Pinocchio's order.
            v, v_ref, a_ref: (nv, 1).
            gravity: acceleration of gravity in the frame of the first joint's placement, (3, 1).
        """
        ca = self.ca
        forces = []
        for i, (A, B) in enumerate(self._accelerations(v, v_ref, a_ref, gravity)):
            mass, first, second = _moments(ca, pi[10 * i : 10 * i + 10])
            spread = ca.mtimes(B, second)  # integral of (B r) r^T
            moment = ca.vertcat(*(spread[k - 1, k - 2] - spread[k - 2, k - 1] for k in range(3)))
            forces.append((mass * A + ca.mtimes(B, first), ca.cross(first, A) + moment))
        return self._gather(forces)

    def mass_matrix(self, pi: Any) -> Any:
        """M(q) with armature, (nv, nv), by the composite-rigid-body algorithm."""
        ca, joints = self.ca, self.fixed.joints
        composite = [_moments(ca, pi[10 * i : 10 * i + 10]) for i in range(len(joints))]
        for i in reversed(range(len(joints))):
            if (up := joints[i].parent) >= 0:
                moved = _moved(ca, composite[i], self._R[i], self._p[i])
                composite[up] = tuple(a + b for a, b in zip(composite[up], moved, strict=True))
        M = ca.SX.zeros(len(joints), len(joints))
        for i, joint in enumerate(joints):
            force = _momentum(ca, composite[i], joint)
            M[i, i] = self._project(joint, force) + joint.armature
            j = i
            while joints[j].parent >= 0:
                force = self._up(j, force)
                j = joints[j].parent
                M[i, j] = M[j, i] = self._project(joints[j], force)
        return M

    # -- steps of the recursions --------------------------------------------------------------------------

    def _accelerations(self, v: Any, v_ref: Any, a_ref: Any, gravity: Any) -> list[tuple[Any, Any]]:
        """A, (3, 1), and B, (3, 3), per body, in its coordinates; gravity is an acceleration of the base."""
        ca, zero = self.ca, self.ca.SX.zeros(3)
        w: list[Any] = []
        w_ref, turning, fields = list(w), list(w), list(w)
        for i, joint in enumerate(self.fixed.joints):
            back, axis = self._R[i].T, ca.SX(joint.axis)
            if joint.parent < 0:
                above, (A, B) = (zero, zero, zero), (-gravity, ca.SX.zeros(3, 3))
            else:
                above = tuple(part[joint.parent] for part in (w, w_ref, turning))
                A, B = fields[joint.parent]
            w_i, w_ref_i, turning_i = (ca.mtimes(back, part) for part in above)
            A = ca.mtimes(back, A + ca.mtimes(B, self._p[i]))
            swept = ca.cross(w_i, axis * v_ref[i]) + ca.cross(w_ref_i, axis * v[i])
            if joint.turns:
                w_i, w_ref_i = w_i + axis * v[i], w_ref_i + axis * v_ref[i]
                turning_i += axis * a_ref[i] + 0.5 * swept
            else:
                A += axis * a_ref[i] + swept
            for parts, part in zip((w, w_ref, turning), (w_i, w_ref_i, turning_i), strict=True):
                parts.append(part)
            fields.append((A, ca.skew(turning_i) + _centripetal(ca, w_i, w_ref_i)))
        return fields

    def _gather(self, forces: list) -> Any:
        tau = [self.ca.SX(0)] * len(forces)
        for i in reversed(range(len(forces))):
            joint = self.fixed.joints[i]
            tau[i] = self._project(joint, forces[i])
            if joint.parent >= 0:
                forces[joint.parent] = _add(forces[joint.parent], self._up(i, forces[i]))
        return self.ca.vertcat(*tau)

    def _project(self, joint: MechanismJoint, force: Sequence) -> Any:
        return self.ca.dot(self.ca.SX(joint.axis), force[1] if joint.turns else force[0])

    def _up(self, i: int, force: Sequence) -> tuple[Any, Any]:
        """A force on body i, seen from its parent."""
        ca, R = self.ca, self._R[i]
        push, twist = ca.mtimes(R, force[0]), ca.mtimes(R, force[1])
        return push, twist + ca.cross(self._p[i], push)


def _moments(ca: Any, pi: Any) -> tuple[Any, Any, Any]:
    """Integrals of 1, r and r r^T over the mass of a body, about the joint origin, from ten parameters."""
    half = 0.5 * (pi[4] + pi[6] + pi[9])
    xx, yy, zz = half - pi[4], half - pi[6], half - pi[9]
    rows = ((xx, -pi[5], -pi[7]), (-pi[5], yy, -pi[8]), (-pi[7], -pi[8], zz))
    return pi[0], pi[1:4], ca.vertcat(*(ca.horzcat(*row) for row in rows))


def _moved(ca: Any, moments: Sequence, R: Any, p: Any) -> tuple[Any, Any, Any]:
    """Moments of a body in the coordinates of its parent: there r is R r + p."""
    mass, first, second = moments
    turned = ca.mtimes(R, first)
    half = ca.mtimes(turned + 0.5 * mass * p, p.T)
    whole = ca.mtimes(ca.mtimes(R, second), R.T) + half + half.T
    return mass, turned + mass * p, ca.tril2symm(ca.tril(whole))


def _momentum(ca: Any, moments: Sequence, joint: MechanismJoint) -> tuple[Any, Any]:
    """Linear and angular momentum of a body about its joint, of which the velocity is one."""
    mass, first, second = moments
    axis = ca.SX(joint.axis)
    if joint.turns:
        return ca.cross(axis, first), ca.trace(second) * axis - ca.mtimes(second, axis)
    return mass * axis, ca.cross(first, axis)


def _centripetal(ca: Any, a: Any, b: Any) -> Any:
    """([a][b] + [b][a]) / 2 = (a b^T + b a^T) / 2 - (a . b) I."""
    x, y, z = (a[k] * b[k] for k in range(3))
    xy, xz, yz = (0.5 * (a[j] * b[k] + a[k] * b[j]) for j, k in ((0, 1), (0, 2), (1, 2)))
    rows = ((-y - z, xy, xz), (xy, -x - z, yz), (xz, yz, -x - y))
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def _rotation(ca: Any, axis: np.ndarray, sine: Any, cosine: Any) -> Any:
    """Rodrigues' formula; for an axis along a coordinate the constant entries stay constant."""
    along = np.outer(axis, axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return ca.SX(along) + ca.SX(np.eye(3) - along) * cosine + ca.SX(skew) * sine


def _add(*parts: Sequence) -> tuple[Any, Any]:
    return sum(part[0] for part in parts), sum(part[1] for part in parts)
