"""Adaptations: each has the storage that the proof asks of it, and says what its rate of change is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from machines import rate
from refusals import refused

from synctrl import Cell, load_robot
from synctrl.control.adaptation import Gradient, Natural, Seen
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four, planar_four
from synctrl.paper.judge import joint_pair
from synctrl.robots import pseudo_inertia as pi

SEEDS = st.integers(0, 2**32 - 1)
CELL = a460_pair().cell
RUBBING = a460_pair(adapt_friction=True).cell
ADAPTATIONS = {
    "gradient": Gradient(0.3),
    "gradient of some entries": Gradient(np.where(np.arange(30) % 3, 0.4, 0.0)),
    "natural": Natural(0.1),
}


@cache
def pair_of(name: str) -> Cell:
    """Two robots of the catalogue, made once for all examples."""
    return joint_pair(name).cell


def seen(rng: np.random.Generator, P: int = 30) -> Seen:
    """Random signals with a gradient that belongs to them."""
    q, v, v_ref, a_ref, s_q = rng.standard_normal((5, 2, 3))
    Y = rng.standard_normal((2, 3, P))
    return Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, s_q, s_q)


def some_state(bound, rng: np.random.Generator) -> np.ndarray:
    z = bound.start()
    return z + 0.1 * rng.standard_normal(z.shape) * np.abs(z)


# -- pseudo-inertia ---------------------------------------------------------------------------------------


@given(SEEDS)
def test_inertial_parameters_and_pseudo_inertia_are_each_others_inverse(seed):
    theta, g = np.random.default_rng(seed).standard_normal((2, 3, 10))
    P = pi.pseudo_inertia(theta)
    np.testing.assert_allclose(pi.inertial_parameters(P), theta, atol=1e-13)
    np.testing.assert_allclose(np.trace(pi.dual(g) @ P, axis1=-2, axis2=-1), (g * theta).sum(-1), atol=1e-12)


@given(SEEDS)
def test_pseudo_inertia_is_the_second_moment_of_the_mass(seed):
    """Of point masses at homogeneous places (r, 1) it is sum m (r, 1)(r, 1)^T."""
    rng = np.random.default_rng(seed)
    mass, places = rng.uniform(0.1, 2, 6), rng.standard_normal((6, 3))
    homogeneous = np.column_stack((places, np.ones(6)))
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(mass, places, strict=True))
    order = [inertia[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    theta = np.array([mass.sum(), *(mass @ places), *order])
    np.testing.assert_allclose(pi.pseudo_inertia(theta), (homogeneous.T * mass) @ homogeneous, atol=1e-12)


def test_bodies_of_real_robots_lie_inside_the_cone():
    for name in ("planar2r", "a460", "ur5", "panda"):
        assert (pi.smallest_eigenvalues(load_robot(name).inertial_parameters) > 0).all()


# -- what the proof asks ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ADAPTATIONS)
@given(seed=SEEDS)
def test_the_storage_changes_by_minus_s_y_tilde_and_the_named_powers(name, seed):
    rng = np.random.default_rng(seed)
    bound, now, theta = ADAPTATIONS[name].bind(CELL), seen(rng), CELL.theta
    z = some_state(bound, rng)
    model = float(np.sum(now.gradient * (theta - bound.estimate(z))))
    expected = -model + sum(bound.powers(z, theta, now).values())
    found = bound.storage_rate(z, bound.rate(z, now), theta)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(now.gradient).max())


@pytest.mark.parametrize("name", ADAPTATIONS)
@given(seed=SEEDS)
def test_the_rate_of_the_storage_is_its_derivative(name, seed):
    rng = np.random.default_rng(seed)
    bound, theta = ADAPTATIONS[name].bind(CELL), CELL.theta
    z = some_state(bound, rng)
    z_dot = 0.1 * rng.standard_normal(z.shape) * np.abs(z)
    by_differences = rate(lambda s: np.array(bound.storage(z + s * z_dot, theta)))
    assert bound.storage_rate(z, z_dot, theta) == pytest.approx(float(by_differences), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("name", ADAPTATIONS)
def test_the_storage_is_zero_at_the_truth_and_positive_elsewhere(name):
    knowing = replace_estimates(1.0)
    bound = ADAPTATIONS[name].bind(knowing)
    truth = bound.start()
    np.testing.assert_allclose(bound.estimate(truth), CELL.theta, atol=1e-12)
    assert bound.storage(truth, CELL.theta) == pytest.approx(0.0, abs=1e-9)
    rng = np.random.default_rng(3)
    assert all(bound.storage(some_state(bound, rng), CELL.theta) > 0 for _ in range(20))


def replace_estimates(share: float):
    """The A460 cell with another first estimate."""
    members = [replace(m, theta_hat0=share * m.robot.inertial_parameters) for m in CELL.members]
    return Cell(members, CELL.coupling, CELL.space, CELL.name)


# -- natural adaptation -----------------------------------------------------------------------------------


@given(seed=SEEDS, step=st.floats(1e-6, 1e3))
def test_natural_estimates_stay_in_the_cone_whatever_the_step(seed, step):
    rng = np.random.default_rng(seed)
    bound = Natural(0.1).bind(CELL)
    z = bound.start()
    z = z + np.clip(step * bound.rate(z, seen(rng)), -20, 20)
    eigenvalues = np.linalg.eigvalsh(pi.pseudo_inertia(bound.estimate(z).reshape(2, 3, 10)))
    assert (eigenvalues[..., 0] >= -1e-13 * eigenvalues[..., -1]).all()


@given(seed=SEEDS, h=st.floats(1e-4, 0.05))
def test_a_sample_of_natural_adaptation_goes_along_a_geodesic(seed, h):
    """P+ = P^1/2 exp(h gamma P^1/2 B P^1/2) P^1/2, which no choice of a factor enters."""
    from scipy.linalg import expm, sqrtm

    now = seen(np.random.default_rng(seed))
    bound = Natural(0.1).bind(CELL)
    z = bound.start()
    after = pi.pseudo_inertia(bound.estimate(bound.leap(z, bound.rate(z, now), h)).reshape(2, 3, 10))
    before, B = (
        pi.pseudo_inertia(bound.estimate(z).reshape(2, 3, 10)),
        pi.dual(now.gradient.reshape(2, 3, 10)),
    )
    for P, P_next, B_k in zip(
        before.reshape(-1, 4, 4), after.reshape(-1, 4, 4), B.reshape(-1, 4, 4), strict=True
    ):
        root = np.real(sqrtm(P))
        expected = root @ expm(0.1 * h * root @ B_k @ root) @ root
        np.testing.assert_allclose(P_next, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


@given(seed=SEEDS, h=st.floats(1e-3, 10))
def test_no_sample_of_natural_adaptation_leaves_the_cone(seed, h):
    bound = Natural(0.1).bind(CELL)
    z = bound.start()
    gradient = seen(np.random.default_rng(seed))
    rate = bound.rate(z, gradient)
    after = bound.leap(z, rate, min(h, 20 / np.abs(rate).max()))
    assert np.isfinite(after).all()
    eigenvalues = np.linalg.eigvalsh(pi.pseudo_inertia(bound.estimate(after).reshape(2, 3, 10)))
    assert (eigenvalues[..., 0] >= -1e-13 * eigenvalues[..., -1]).all()


@pytest.mark.parametrize("name", ["planar2r", "a460", "ur5", "panda"])
@given(seed=SEEDS, gamma=st.floats(1e-3, 1e3), h=st.floats(1e-4, 1.0))
def test_no_step_leaves_the_cone_whatever_the_robot_the_gain_and_the_step(name, seed, gamma, h):
    cell, rng = pair_of(name), np.random.default_rng(seed)
    bound, now = Natural(gamma).bind(cell), seen(rng)
    z = bound.start()
    rate = bound.rate(z, replace(now, gradient=rng.standard_normal(cell.theta.shape)))
    h = min(h, 20 / np.abs(rate).max())
    for after in (z + h * rate, bound.leap(z, rate, h)):
        eigenvalues = np.linalg.eigvalsh(pi.pseudo_inertia(bound.estimate(after).reshape(-1, 10)))
        assert (eigenvalues[:, 0] >= -1e-12 * eigenvalues[:, -1]).all()


@given(seed=SEEDS, gamma=st.floats(1e-3, 10))
def test_the_rate_of_natural_estimates_is_gamma_p_b_p(seed, gamma):
    rng = np.random.default_rng(seed)
    bound, now = Natural(gamma).bind(CELL), seen(rng)
    z = some_state(bound, rng)
    rates = bound.rate(z, now)
    scale = 1e-3 / np.abs(rates).max()
    P, B = (rows.reshape(2, 3, 10) for rows in (bound.estimate(z), now.gradient))
    P, B = pi.pseudo_inertia(P), pi.dual(B)
    found = rate(lambda s: pi.pseudo_inertia(bound.estimate(z + s * scale * rates).reshape(2, 3, 10)))
    expected = scale * gamma * P @ B @ P
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())


@given(seed=SEEDS, h=st.floats(1e-3, 0.1))
def test_natural_adaptation_depends_on_no_unit_and_no_frame_of_the_bodies(seed, h):
    """In millimetres, and about other axes elsewhere, P is A P A^T, and B is A^-T B A^-1."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    A = np.block([[1e3 * turn, rng.standard_normal((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])
    back = np.linalg.inv(A)
    gradient = seen(rng).gradient.reshape(-1, 10)
    moved = np.einsum("kij,bji->bk", pi.E, back.T @ pi.dual(gradient) @ back)
    theta = CELL.theta_hat0.reshape(-1, 10)
    expected = A @ after_a_sample(theta, gradient, h) @ A.T
    found = after_a_sample(pi.inertial_parameters(A @ pi.pseudo_inertia(theta) @ A.T), moved, h)
    size = np.sqrt(np.diagonal(expected, axis1=-2, axis2=-1))
    np.testing.assert_allclose(
        found / (size[:, None] * size[..., None]), expected / (size[:, None] * size[..., None]), atol=1e-8
    )


def after_a_sample(theta_hat0: np.ndarray, gradient: np.ndarray, h: float) -> np.ndarray:
    """P_hat of the bodies of both robots, (6, 4, 4), a sample of h s after a first estimate, (6, 10)."""
    members = [
        replace(member, theta_hat0=row)
        for member, row in zip(CELL.members, theta_hat0.reshape(2, 30), strict=True)
    ]
    bound = Natural(0.1).bind(Cell(members, CELL.coupling, CELL.space, CELL.name))
    now = replace(seen(np.random.default_rng(0)), gradient=gradient.reshape(2, 30))
    z = bound.start()
    return pi.pseudo_inertia(bound.estimate(bound.leap(z, bound.rate(z, now), h)).reshape(-1, 10))


@pytest.mark.parametrize("gamma_friction", [0.0, 0.3])
@given(seed=SEEDS)
def test_friction_is_learned_beside_bodies_by_a_gradient_or_named_as_model_error(gamma_friction, seed):
    rng = np.random.default_rng(seed)
    theta, P = RUBBING.theta, RUBBING.theta.shape[1]
    bound, now = Natural(0.1, gamma_friction).bind(RUBBING), seen(rng, P)
    z = some_state(bound, rng)
    z_dot, powers = bound.rate(z, now), bound.powers(z, theta, now)
    np.testing.assert_allclose(z_dot[:, 30:], gamma_friction * now.gradient[:, 30:])
    model = float(np.sum(now.gradient * (theta - bound.estimate(z))))
    found = bound.storage_rate(z, z_dot, theta)
    expected = -model + sum(powers.values())
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(now.gradient).max())
    assert (powers["model error"] == 0) == (gamma_friction > 0)


def test_natural_refuses_what_has_no_bodies_by_name():
    with refused(InputError, "robot 1, adaptation"):
        Natural(0.1).bind(planar_four().cell)


def test_natural_refuses_robots_of_different_numbers_of_bodies():
    cell = mixed_four().cell
    with refused(InputError, "adaptation", found=tuple(len(p.theta) // 10 for p in cell.parameters)):
        Natural(0.1).bind(cell)


def test_natural_refuses_a_first_estimate_that_no_body_can_have():
    with refused(InputError, "theta_hat0 of robot 1"):
        Natural(0.1).bind(replace_estimates(0.0)).start()


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, "fast"])
def test_natural_refuses_rates_that_are_not_positive(wrong):
    with refused(InputError, "gamma"):
        Natural(wrong)
