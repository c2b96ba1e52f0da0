"""From task space to joint space: exact derivatives, exact task motion, null-space postures, damping."""

from __future__ import annotations

import numpy as np
import pytest
from flows import Sines, derivative, desired_flow, joint_flow
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from refusals import refused

from synctrl import CartesianSpace, Damping, PoseSpace, Redundancy, load_robot
from synctrl.errors import InputError
from synctrl.tasks.algebra import LAPACK
from synctrl.tasks.redundancy import Inverse

UR5, PANDA, PLANAR = load_robot("ur5"), load_robot("panda"), load_robot("planar2r")
CELLS = {"two Pandas": [PANDA, PANDA], "UR5 and Panda": [UR5, PANDA]}
seeds = st.integers(0, 10_000)


def redundancy(rng: np.random.Generator, robots: list) -> Redundancy:
    return Redundancy(
        posture=[rng.uniform(-1, 1, r.nv) for r in robots],
        gain=1.7,
        weights=[rng.uniform(0.3, 3.0, r.nv) for r in robots],
    )


def motion(space, robots: list, seed: int):
    """v_ref, a_ref and the measurement as functions of time, along a flow with a smooth task reference."""
    rng = np.random.default_rng(seed)
    bound = space(redundancy(rng, robots)).bind(robots)
    q = joint_flow(rng, robots)
    n, m = len(robots), space(None).m
    desired, xref = [desired_flow(rng, m) for _ in robots], Sines(rng, (n, m))

    def measure(t: float):
        return bound.measure(np.stack((q(t), q.dot(t))), np.stack(stacked(desired, t)))

    def references(t: float):
        return bound.to_joints(measure(t), xref.dot(t), xref.ddot(t))

    return measure, references, xref


def stacked(desired: list, t: float) -> list[np.ndarray]:
    """Desired motion of all robots at t."""
    return [np.stack(part) for part in zip(*(trajectory(t) for trajectory in desired), strict=True)]


SPACES = {
    "position": lambda r: CartesianSpace("xyz", redundancy=r),
    "two axes": lambda r: CartesianSpace("zx", redundancy=r),
    "pose": lambda r: PoseSpace(redundancy=r),
    "damped position": lambda r: CartesianSpace("xyz", singularity=Damping(2.0, 0.5), redundancy=r),
    "damped pose": lambda r: PoseSpace(singularity=Damping(2.0, 0.3), redundancy=r),
}


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("space", SPACES)
@settings(max_examples=12)
@given(seed=seeds, t=st.floats(0, 5))
def test_a_ref_is_the_time_derivative_of_v_ref_along_any_motion(space, cell, seed, t):
    measure, references, _ = motion(SPACES[space], CELLS[cell], seed)
    assume(np.linalg.cond(measure(t).J).max() < 50 and smallest_gap(measure(t)) > 0.05)
    a_ref = references(t)[1]
    numeric = derivative(lambda t: references(t)[0], t, 2e-4)
    np.testing.assert_allclose(a_ref, numeric, atol=2e-6 * max(1, np.abs(numeric).max()))


def smallest_gap(task) -> float:
    """Relative distance of the two smallest singular values of J: where they cross, damping has a kink."""
    values = np.linalg.svd(task.J, compute_uv=False)
    return (
        float(((values[:, -2] - values[:, -1]) / values[:, -2]).min())
        if task.inversion.damping is not None
        else 1
    )


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("space", ["position", "two axes", "pose"])
@settings(max_examples=20)
@given(seed=seeds)
def test_the_tip_moves_exactly_with_the_task_reference_whatever_the_posture(space, cell, seed):
    measure, references, xref = motion(SPACES[space], CELLS[cell], seed)
    task, (v_ref, a_ref) = measure(1.0), references(1.0)
    assume(np.linalg.cond(task.J).max() < 100)
    np.testing.assert_allclose(np.matvec(task.J, v_ref), xref.dot(1.0), atol=1e-9)
    acceleration = np.matvec(task.J, a_ref) + np.matvec(task.J_dot, v_ref)
    np.testing.assert_allclose(acceleration, xref.ddot(1.0), atol=1e-8)


@settings(max_examples=20)
@given(seed=seeds)
def test_the_reference_velocity_is_the_one_closest_to_the_preferred_one(seed):
    measure, references, _ = motion(SPACES["position"], [PANDA, PANDA], seed)
    task, (v_ref, _) = measure(0.0), references(0.0)
    rng = np.random.default_rng(seed)
    weights = 1 / redundancy(rng, [PANDA, PANDA]).spread([PANDA, PANDA])[0]
    J, zeta = task.J, task.inversion.zeta
    for i in range(2):
        _, _, Vt = np.linalg.svd(J[i])
        null_space = Vt[3:].T
        np.testing.assert_allclose(null_space.T @ (weights[i] * (v_ref[i] - zeta[i])), 0, atol=1e-9)


@settings(max_examples=20)
@given(seed=seeds)
def test_joints_a_robot_does_not_have_do_not_move(seed):
    _, references, _ = motion(SPACES["position"], [UR5, PANDA], seed)
    v_ref, a_ref = references(0.5)
    assert v_ref[0, 6] == 0 and a_ref[0, 6] == 0


@settings(max_examples=20)
@given(seed=seeds)
def test_a_square_robot_moves_as_with_the_plain_inverse_in_a_mixed_cell_too(seed):
    rng = np.random.default_rng(seed)
    mixed, alone = PoseSpace(redundancy=redundancy(rng, [UR5, PANDA])), PoseSpace()
    q, desired = joint_flow(rng, [UR5, PANDA]), [desired_flow(rng, 6) for _ in range(2)]
    xref_dot, xref_ddot = rng.standard_normal((2, 2, 6))
    found = []
    for space, robots, nv in ((mixed, [UR5, PANDA], 7), (alone, [UR5], 6)):
        bound, k = space.bind(robots), len(robots)
        task = bound.measure(np.stack((q(0), q.dot(0)))[:, :k, :nv], np.stack(stacked(desired[:k], 0.0)))
        assume(np.linalg.cond(task.J[0, :, :6]) < 100)
        found.append([part[0, :6] for part in bound.to_joints(task, xref_dot[:k], xref_ddot[:k])])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7, atol=1e-8)


def test_square_robots_use_the_accurate_direct_inverse():
    assert isinstance(PoseSpace().bind([UR5, UR5])._inverse, Inverse)


@pytest.mark.parametrize("elbow", [0.01, 1.2], ids=["nearly straight", "bent"])
@pytest.mark.parametrize("what", ["posture", "weights"])
def test_with_damping_posture_and_weights_act_on_square_robots_near_singular_configurations_only(what, elbow):
    """Far away, where 1 - J# J is zero, a square robot moves as without them."""
    given, damping = {"posture": [1.0, -1.0], "weights": [1.0, 1.5]}[what], Damping(0.05, 0.05)
    q = np.array([[0.3, elbow]] * 2)
    moved = []
    for redundancy in (None, Redundancy(**{what: given})):
        bound = CartesianSpace("xy", singularity=damping, redundancy=redundancy).bind([PLANAR] * 2)
        task = bound.measure(np.stack((q, 0 * q)), np.zeros((3, 2, 2)))
        assert (task.inversion.damping > 0).all() == (elbow < 0.1)
        moved.append(bound.to_joints(task, np.ones((2, 2)), np.zeros((2, 2)))[0])
    assert (np.abs(moved[0] - moved[1]).max() > 0.01) == (elbow < 0.1)
    assert elbow < 0.1 or np.abs(moved[0] - moved[1]).max() < 1e-12


@settings(max_examples=20)
@given(seed=seeds)
def test_damping_is_zero_above_its_threshold_and_the_reference_is_then_followed_exactly(seed):
    def space(r):
        return CartesianSpace("xyz", singularity=Damping(1e-6, 0.05), redundancy=r)

    measure, references, xref = motion(space, [PANDA, UR5], seed)
    task = measure(0.0)
    assert (task.inversion.damping == 0).all()
    np.testing.assert_allclose(np.matvec(task.J, references(0.0)[0]), xref.dot(0.0), atol=1e-8)


@given(seed=seeds, angle=st.floats(-1e-3, 1e-3))
def test_damped_reference_velocities_stay_bounded_through_a_singular_configuration(seed, angle):
    rng = np.random.default_rng(seed)
    damping = Damping(0.1, 0.05)
    bound = CartesianSpace("xy", singularity=damping).bind([PLANAR] * 2)
    q = np.array([[rng.uniform(-3, 3), angle]] * 2)
    still, xref_dot = np.zeros((2, 2)), rng.uniform(-1, 1, (2, 2))
    task = bound.measure(np.stack((q, still)), np.zeros((3, 2, 2)))
    v_ref, a_ref = bound.to_joints(task, xref_dot, still)
    assert (task.inversion.damping > 0.99 * damping.largest).all()
    assert (
        np.linalg.norm(v_ref, axis=1).max()
        <= np.linalg.norm(xref_dot, axis=1).max() / (2 * damping.largest) * 1.1
    )
    assert np.isfinite(a_ref).all()


def test_a_robot_whose_jacobian_is_no_number_leaves_the_damping_of_the_others_as_it_is():
    A = np.random.default_rng(0).normal(size=(3, 2, 2))
    A = A @ A.mT
    whole = LAPACK.smallest(A)
    A[1, 0, 1] = np.nan
    for found, expected in zip(LAPACK.smallest(A), whole, strict=True):
        assert np.isnan(found[1]).all()
        np.testing.assert_array_equal(found[[0, 2]], expected[[0, 2]])


def test_weights_and_postures_that_do_not_fit_are_refused_with_the_robot_named():
    cases = {
        Redundancy(posture=np.zeros(6)): "redundancy, posture of 'panda'",
        Redundancy(posture=[np.zeros(7)]): "redundancy, posture",
        Redundancy(weights=-np.ones(7)): "redundancy, weights",
        Redundancy(weights=3.0): "redundancy, weights",
        Redundancy(weights=np.array(3.0)): "redundancy, weights",
        Redundancy(posture=[]): "redundancy, posture",
        Redundancy(posture=np.zeros((0, 7))): "redundancy, posture",
    }
    for wrong, subject in cases.items():
        with refused(InputError, subject):
            CartesianSpace("xyz", redundancy=wrong).bind([PANDA, PANDA])
    with refused(InputError, "redundancy, gain"):
        Redundancy(gain=-1)
    with refused(InputError, "damping, threshold"):
        Damping(threshold=0)


def test_a_robot_with_too_few_joints_is_refused():
    with refused(InputError, "PoseSpace()"):
        PoseSpace().bind([UR5, PLANAR])
