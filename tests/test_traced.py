"""Spaces, inverse maps and rotations: one robot, a row of robots and symbols all get the same numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synctrl import CartesianSpace, Damping, PoseSpace
from synctrl.tasks import rotations
from synctrl.tasks.algebra import LAPACK
from synctrl.tasks.redundancy import DampedInverse, Inverse, Pseudoinverse

ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

seeds = st.integers(0, 2**20)
SPACES = {
    "position": CartesianSpace("zx"),
    "damped position": CartesianSpace("xyz", singularity=Damping(2.0, 0.5)),
    "pose": PoseSpace(),
    "damped pose": PoseSpace(singularity=Damping(2.0, 0.3)),
}


def evaluated(function, *arguments: np.ndarray) -> list[np.ndarray]:
    """What a function of arrays makes of symbols, at these numbers."""
    from synctrl.compiled.algebra import column_of, symbols

    given = [symbols("x", *argument.shape) for argument in arguments]
    traced = function(*given)
    outputs = ca.Function("f", [*map(column_of, given)], [*map(column_of, traced)])
    found = outputs.call([argument.ravel() for argument in arguments])
    return [np.array(x).reshape(a.shape) for x, a in zip(found, traced, strict=True)]


def assert_all_agree(function, symbolic, *arguments: np.ndarray) -> None:
    """Of arguments with one row per robot: all rows at once, each alone, and each as symbols."""
    together = function(*arguments)
    for i, row in enumerate(zip(*arguments, strict=True)):
        for alone in (function(*row), evaluated(symbolic, *row)):
            for whole, part in zip(together, alone, strict=True):
                np.testing.assert_allclose(part, whole[i], rtol=1e-9, atol=1e-10)


@settings(max_examples=10)
@given(seed=seeds, length=st.sampled_from([0.0, 1e-9, 1e-3, 0.7, 2.0, 3.0]))
def test_rotations(seed, length):
    phi, phi_dot = np.random.default_rng(seed).standard_normal((2, 3, 3))
    phi *= length / np.linalg.norm(phi, axis=1, keepdims=True)

    def computed(phi, phi_dot):
        R = rotations.exp(phi)
        jacobians = rotations.left_jacobian_inverse(phi), rotations.left_jacobian_inverse_dot(phi, phi_dot)
        return R, rotations.log(R), rotations.from_quaternion(rotations.quaternion(R)), *jacobians

    assert_all_agree(computed, computed, phi, phi_dot)


class GivenTips(NamedTuple):
    """Tips that are where they are said to be."""

    moved: np.ndarray
    R: np.ndarray
    J: np.ndarray
    J_dot: np.ndarray

    def poses(self, q, v):
        return self

    def positions(self, q, v):
        return self.moved, self.J[..., :3, :], self.J_dot[..., :3, :]


def task_of(space, kind: type, algebra):
    """Everything that a space computes of one instant, by any algebra."""

    def computed(q, v, desired, p, phi, J, J_dot, xref_dot, xref_ddot, force, W_inv, posture, gain):
        def leading(array):
            return np.moveaxis(array, -2, 0)

        tips = GivenTips(leading(p), rotations.exp(phi), J, J_dot)
        bound = space.over(tips, [q.shape[-1]], (W_inv, posture, gain), algebra)
        assert type(bound._inverse) is kind
        task = bound.measure(np.stack((q, v)), leading(desired))
        joints = bound.to_joints(task, xref_dot, xref_ddot)
        looks = [bound.watched(task)] if bound.limits else []
        known = [part for part in task.inversion if part is not None]
        parts = task.x, task.x_dot, task.e, task.e_dot, task.xd_dot, task.xd_ddot, task.J, task.J_dot
        return *parts, *known, *joints, bound.to_torque(task, force), *looks

    return computed


@pytest.mark.parametrize("name", SPACES)
@settings(max_examples=3)
@given(seed=seeds)
def test_spaces_and_inverse_maps(name, seed):
    from synctrl.compiled.algebra import SYMBOLS

    space, rng, n = SPACES[name], np.random.default_rng(seed), 2
    kinds = (DampedInverse,) if space.damping is not None else (Inverse, Pseudoinverse)
    for kind in kinds:
        m, nv = space.m, space.m + (kind is not Inverse)
        shapes = [(nv,), (nv,), (3, m), (2, 3), (3,), (6, nv), (6, nv), (m,), (m,), (m,), (nv,), (nv,), (nv,)]
        arguments = [rng.uniform(-1, 1, (n, *shape)) for shape in shapes]
        arguments[5] += 2 * np.eye(6, nv)  # far from singular, along every axis
        arguments[10] = np.abs(arguments[10]) + 0.3
        numeric, symbolic = (task_of(space, kind, algebra) for algebra in (LAPACK, SYMBOLS))
        assert_all_agree(numeric, symbolic, *arguments)


@settings(max_examples=10)
@given(seed=seeds, m=st.sampled_from([1, 2, 3, 6]))
def test_the_algebra_of_symbols_is_that_of_numbers(seed, m):
    from synctrl.compiled.algebra import SYMBOLS

    A = np.random.default_rng(seed).uniform(-1, 1, (2, m, m)) + 2 * np.diag(np.arange(m))

    def computed(algebra):
        def of(A):
            value, vector = algebra.smallest(A @ A.mT)
            return algebra.inverse(A), algebra.determinant(A), value, abs(vector)

        return of

    assert_all_agree(computed(LAPACK), computed(SYMBOLS), A)
