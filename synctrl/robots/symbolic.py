"""Rigid-body algorithms over a Pinocchio model, written with CasADi symbols.

They are what the compiled engine is generated from. The recursions are those of Featherstone, *Rigid Body
Dynamics Algorithms* (2008), in body coordinates. Every function is checked against Pinocchio by a test, and
generated code again whenever it is built.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .mechanism import Joint, Mechanism


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
        half the sum over both orders of its two factors.

        Args:
            pi: inertial parameters, (10 bodies, 1), in Pinocchio's order.
            v, v_ref, a_ref: (nv, 1).
            gravity: acceleration of gravity in the frame of the first joint's placement, (3, 1).
        """
        ca = self.ca
        twists, references = self._twists(v), self._twists(v_ref)
        forces = []
        accelerations: list[Any] = []
        for i, joint in enumerate(self.fixed.joints):
            subspace = self._subspace(joint)
            above = accelerations[joint.parent] if joint.parent >= 0 else (-gravity, ca.SX.zeros(3))
            bias = _mean(
                _motion_cross(ca, twists[i], _scale(subspace, v_ref[i])),
                _motion_cross(ca, references[i], _scale(subspace, v[i])),
            )
            accelerations.append(_add(self._down(i, above), _scale(subspace, a_ref[i]), bias))
            inertia = _Inertia(ca, pi[10 * i : 10 * i + 10])
            swirl = _mean(
                _force_cross(ca, twists[i], inertia.times(references[i])),
                _force_cross(ca, references[i], inertia.times(twists[i])),
            )
            forces.append(_add(inertia.times(accelerations[i]), swirl))
        return self._gather(forces)

    def mass_matrix(self, pi: Any) -> Any:
        """M(q) with armature, (nv, nv), by the composite-rigid-body algorithm."""
        ca, joints = self.ca, self.fixed.joints
        composite = [pi[10 * i : 10 * i + 10] for i in range(len(joints))]
        for i in reversed(range(len(joints))):
            if joints[i].parent >= 0:
                composite[joints[i].parent] += _moved_inertia(ca, composite[i], self._R[i], self._p[i])
        M = ca.SX.zeros(len(joints), len(joints))
        for i, joint in enumerate(joints):
            force = _Inertia(ca, composite[i]).times(self._subspace(joint))
            M[i, i] = self._project(joint, force) + joint.armature
            j = i
            while joints[j].parent >= 0:
                force = self._up(j, force)
                j = joints[j].parent
                M[i, j] = M[j, i] = self._project(joints[j], force)
        return M

    # -- steps of the recursions --------------------------------------------------------------------------

    def _twists(self, v: Any) -> list:
        zero = self.ca.SX.zeros(3)
        twists: list[Any] = []
        for i, joint in enumerate(self.fixed.joints):
            above = twists[joint.parent] if joint.parent >= 0 else (zero, zero)
            twists.append(_add(self._down(i, above), _scale(self._subspace(joint), v[i])))
        return twists

    def _gather(self, forces: list) -> Any:
        tau = [self.ca.SX(0)] * len(forces)
        for i in reversed(range(len(forces))):
            joint = self.fixed.joints[i]
            tau[i] = self._project(joint, forces[i])
            if joint.parent >= 0:
                forces[joint.parent] = _add(forces[joint.parent], self._up(i, forces[i]))
        return self.ca.vertcat(*tau)

    def _subspace(self, joint: Joint) -> tuple[Any, Any]:
        axis, zero = self.ca.SX(joint.axis), self.ca.SX.zeros(3)
        return (zero, axis) if joint.turns else (axis, zero)

    def _project(self, joint: Joint, force: Sequence) -> Any:
        return self.ca.dot(self.ca.SX(joint.axis), force[1] if joint.turns else force[0])

    def _down(self, i: int, motion: Sequence) -> tuple[Any, Any]:
        """A motion of the parent body, seen from body i."""
        ca, back = self.ca, self._R[i].T
        return ca.mtimes(back, motion[0] + ca.cross(motion[1], self._p[i])), ca.mtimes(back, motion[1])

    def _up(self, i: int, force: Sequence) -> tuple[Any, Any]:
        """A force on body i, seen from its parent."""
        ca, R = self.ca, self._R[i]
        push, twist = ca.mtimes(R, force[0]), ca.mtimes(R, force[1])
        return push, twist + ca.cross(self._p[i], push)


class _Inertia:
    """Ten parameters of a body as the map from its motion to its momentum, about the joint origin."""

    def __init__(self, ca: Any, pi: Any):
        self._ca, self._m, self._h = ca, pi[0], pi[1:4]
        rows = ((4, 5, 7), (5, 6, 8), (7, 8, 9))
        self._I = ca.vertcat(*(ca.horzcat(*(pi[k] for k in row)) for row in rows))

    def times(self, motion: Sequence) -> tuple[Any, Any]:
        ca, (linear, angular) = self._ca, motion
        return (
            self._m * linear + ca.cross(angular, self._h),
            ca.mtimes(self._I, angular) + ca.cross(self._h, linear),
        )


def _moved_inertia(ca: Any, pi: Any, R: Any, p: Any) -> Any:
    """Parameters of a body in the coordinates of its parent."""
    m, h = pi[0], ca.mtimes(R, pi[1:4])
    body = _Inertia(ca, pi)
    about = ca.mtimes(ca.mtimes(R, body._I), R.T)
    cross_h, cross_p = ca.skew(h), ca.skew(p)
    shift = -(ca.mtimes(cross_h, cross_p) + ca.mtimes(cross_p, cross_h)) - m * ca.mtimes(cross_p, cross_p)
    I = about + shift
    return ca.vertcat(m, h + m * p, I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2])


def _rotation(ca: Any, axis: np.ndarray, sine: Any, cosine: Any) -> Any:
    """Rodrigues' formula; for an axis along a coordinate the constant entries stay constant."""
    along = np.outer(axis, axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return ca.SX(along) + ca.SX(np.eye(3) - along) * cosine + ca.SX(skew) * sine


def _add(*parts: Sequence) -> tuple[Any, Any]:
    return sum(part[0] for part in parts), sum(part[1] for part in parts)


def _scale(motion: Sequence, factor: Any) -> tuple[Any, Any]:
    return motion[0] * factor, motion[1] * factor


def _mean(a: Sequence, b: Sequence) -> tuple[Any, Any]:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])


def _motion_cross(ca: Any, a: Sequence, b: Sequence) -> tuple[Any, Any]:
    return ca.cross(a[1], b[0]) + ca.cross(a[0], b[1]), ca.cross(a[1], b[1])


def _force_cross(ca: Any, a: Sequence, f: Sequence) -> tuple[Any, Any]:
    return ca.cross(a[1], f[0]), ca.cross(a[1], f[1]) + ca.cross(a[0], f[0])
