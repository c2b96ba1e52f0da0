"""The law: every derivative along the closed loop, the identities it rests on, and what it contains."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from cells import SMALL_GAINS, along, look, random_experiment, random_state, small_cell
from hypothesis import given, settings
from machines import seeds

from synctrl import Cell, Coupling, simulate
from synctrl.control import law
from synctrl.control.laws import Errors
from synctrl.control.laws.sun_mills import BoundSunMills
from synctrl.coupling.weights import Weights
from synctrl.errors import CouplingWarning
from synctrl.simulation.simulate import Experiment

CASES = pytest.mark.parametrize(
    ("space", "coupling"), [("joint", "ring"), ("joint", "pair"), ("tip", "ring"), ("tip", "chain")]
)
T = 0.37


def case(seed: int, **options):
    """A random loop, a state in it, and what the controller sees there."""
    loop = random_experiment(seed, **options).closed_loop()
    y = random_state(loop, seed)
    return loop, y, look(loop, T, y)[1]


def assert_rate(loop, y, value, expected):
    found = along(loop, T, y, value)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * (1 + np.abs(expected).max()))


# -- derivatives along the motion -------------------------------------------------------------------------


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_every_dotted_signal_is_the_derivative_of_its_plain_one(seed, space, coupling):
    loop, y, now = case(seed, space=space, coupling=coupling)
    assert_rate(loop, y, lambda t, y, s: s.e, now.e_dot)
    assert_rate(loop, y, lambda t, y, s: s.epsilon, now.epsilon_dot)
    assert_rate(loop, y, lambda t, y, s: s.u, now.u_dot)
    assert_rate(loop, y, lambda t, y, s: loop.split(y)[3], now.epsilon)
    assert_rate(loop, y, lambda t, y, s: s.E, now.sigma)


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_r_is_the_derivative_of_e_star_plus_lambda_e_star(seed, space, coupling):
    loop, y, now = case(seed, space=space, coupling=coupling)
    Lambda = loop.controller.Lambda
    assert_rate(loop, y, lambda t, y, s: s.e_star, now.r - Lambda * now.e_star)


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_the_reference_acceleration_is_the_derivative_of_the_reference_velocity(seed, space, coupling):
    # with full matrices c that change with time; in joint space v_ref is xref', otherwise J^-1 xref'
    loop, y, now = case(seed, space=space, coupling=coupling)
    assert_rate(loop, y, lambda t, y, s: s.v_ref, now.a_ref)
    assert_rate(loop, y, lambda t, y, s: np.matvec(s.reference.c_inv, s.u), xref_ddot(now))


def xref_ddot(now) -> np.ndarray:
    """Back from a_ref: xref'' = J a_ref + J' v_ref."""
    if now.task.J is None:
        return now.a_ref
    return np.matvec(now.task.J, now.a_ref) + np.matvec(now.task.J_dot, now.v_ref)


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_the_papers_reference_acceleration_differs_by_what_erratum_three_says(seed, space, coupling):
    _, _, exact = case(seed, space=space, coupling=coupling)
    _, _, paper = case(seed, space=space, coupling=coupling, reference_acceleration="paper")
    c_inv, c_dot = exact.reference.c_inv, exact.reference.c_dot
    surplus = np.matvec(c_inv, np.matvec(c_dot, np.matvec(c_inv, exact.r)))
    np.testing.assert_allclose(xref_ddot(paper) - xref_ddot(exact), surplus, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(paper.v_ref, exact.v_ref)


@CASES
@given(seed=seeds)
@settings(max_examples=5)
def test_for_constant_c_both_reference_accelerations_are_the_same(seed, space, coupling):
    _, _, exact = case(seed, space=space, coupling=coupling, moving=False)
    _, _, paper = case(seed, space=space, coupling=coupling, moving=False, reference_acceleration="paper")
    np.testing.assert_array_equal(exact.a_ref, paper.a_ref)
    np.testing.assert_array_equal(exact.tau, paper.tau)


# -- identities -------------------------------------------------------------------------------------------


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_epsilon_and_its_shares_are_sums_with_the_matrix_s(seed, space, coupling):
    loop, y, now = case(seed, space=space, coupling=coupling)
    S, c = loop.cell.coupling.matrix, now.reference.c
    w = np.einsum("nij,nj->ni", c, now.e)
    np.testing.assert_allclose(now.epsilon, S @ w, atol=1e-12)
    np.testing.assert_allclose(now.sigma, S.T @ now.epsilon, atol=1e-12)
    np.testing.assert_allclose(now.E, S.T @ loop.split(y)[3], atol=1e-12)
    np.testing.assert_allclose(now.e_star, w + loop.controller.beta * now.E, atol=1e-12)


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_the_joint_space_error_is_r_seen_from_the_joints(seed, space, coupling):
    _loop, _y, now = case(seed, space=space, coupling=coupling)
    s_q, r = now.s_q, now.r
    s = s_q if now.task.J is None else np.einsum("nij,nj->ni", now.task.J, s_q)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", now.reference.c, s), r, rtol=1e-9, atol=1e-9)


@CASES
@given(seed=seeds)
@settings(max_examples=8)
def test_the_torque_is_the_sum_of_its_three_terms(seed, space, coupling):
    loop, y, now = case(seed, space=space, coupling=coupling)
    k, theta_hat = loop.controller, loop.split(y)[2]
    for i, robot in enumerate(loop.cell.robots):
        q, v = loop.split(y)[0][i], loop.split(y)[1][i]
        Y = robot.regressor(q, v, now.v_ref[i], now.a_ref[i])
        force = now.reference.c[i].T @ (k.K_eps * now.sigma[i])
        push = force if now.task.J is None else now.task.J[i].T @ force
        np.testing.assert_allclose(now.tau[i], Y @ theta_hat[i] + k.K_r[i] * now.s_q[i] + push, atol=1e-9)
        np.testing.assert_allclose(now.z_dot[i], k.adaptation.Gamma[i] * (Y.T @ now.s_q[i]), atol=1e-9)


@given(seeds)
@settings(max_examples=8)
def test_damping_in_task_space_is_j_transposed_k_r_s(seed):
    joint = case(seed, space="tip")[2]
    loop, _y, task = case(seed, space="tip", k_r_space="task")
    J, K_r = task.task.J, loop.controller.K_r
    s = np.einsum("nij,nj->ni", task.reference.c_inv, task.r)
    swap = np.einsum("nji,nj->ni", J, K_r * s) - K_r * joint.s_q
    np.testing.assert_allclose(task.tau - joint.tau, swap, atol=1e-9)


# -- the proof's function ---------------------------------------------------------------------------------


def energy(loop, y, now) -> float:
    """V of section 2, with the true inertia and parameters."""
    q, _, theta_hat, _ = loop.split(y)
    k = loop.controller
    kinetic = sum(
        s @ robot.mass_matrix(qi) @ s for robot, qi, s in zip(loop.cell.robots, q, now.s_q, strict=True)
    )
    wrong = loop.cell.theta - theta_hat
    stored = (k.K_eps * now.epsilon**2).sum() + (k.K_eps * k.Lambda * k.beta * now.E**2).sum()
    return 0.5 * (kinetic + (wrong**2 / k.adaptation.Gamma).sum() + stored)


def power(loop, now) -> float:
    """V' of section 2."""
    k = loop.controller
    loss = k.K_r * now.s_q**2
    return -loss.sum() - (k.K_eps * k.Lambda * now.epsilon**2).sum() - (k.K_eps * k.beta * now.sigma**2).sum()


@CASES
@given(seed=seeds)
@settings(max_examples=10)
def test_robot_controller_and_adaptation_together_lose_v_exactly_as_the_proof_says(seed, space, coupling):
    loop, y, now = case(seed, space=space, coupling=coupling)
    expected = power(loop, now)
    assert expected < 0
    found = along(loop, T, y, lambda t, y, s: np.array(energy(loop, y, s)))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6 * energy(loop, y, now))


@given(seed=seeds)
@settings(max_examples=10)
def test_with_the_papers_reference_acceleration_v_gains_the_extra_term(seed):
    loop, y, now = case(seed, reference_acceleration="paper")
    c_inv, c_dot = now.reference.c_inv, now.reference.c_dot
    s = now.s_q
    rate_of_inverse = -c_inv @ c_dot @ c_inv
    extra = sum(
        s[i] @ robot.mass_matrix(loop.split(y)[0][i]) @ rate_of_inverse[i] @ now.reference.c[i] @ s[i]
        for i, robot in enumerate(loop.cell.robots)
    )
    found = along(loop, T, y, lambda t, y, s: np.array(energy(loop, y, s)))
    assert found == pytest.approx(power(loop, now) + extra, rel=1e-6, abs=1e-6 * energy(loop, y, now))


# -- special cases ----------------------------------------------------------------------------------------


def assert_is_slotine_and_li(loop, seed, rate_of):
    """v_ref = qd' + L e for L, (m, m), given by robot; joint space."""
    y = random_state(loop, seed)
    now, gains, (q, v, theta_hat, _) = look(loop, T, y)[1], loop.controller, loop.split(y)
    for i, robot in enumerate(loop.cell.robots):
        L = rate_of(now.reference, i)
        v_ref = now.reference.xd_dot[i] + L @ (now.reference.xd[i] - q[i])
        a_ref = now.reference.xd_ddot[i] + L @ (now.reference.xd_dot[i] - v[i])
        Y = robot.regressor(q[i], v[i], v_ref, a_ref)
        np.testing.assert_allclose(
            now.tau[i], Y @ theta_hat[i] + gains.K_r[i] * (v_ref - v[i]), rtol=1e-8, atol=1e-8
        )


@given(seeds)
@settings(max_examples=8)
def test_without_coupling_and_with_diagonal_c_the_law_is_slotine_and_lis(seed):
    experiment = random_experiment(seed)
    diagonal = np.random.default_rng(seed).uniform(0.5, 3, (4, 3))
    cell = Cell(experiment.cell.members, Coupling.ring(4, c=diagonal))
    loop = Experiment(cell, experiment.gains.independent(), 1.0).closed_loop()
    assert_is_slotine_and_li(loop, seed, lambda reference, i: np.diag(loop.controller.Lambda))


@given(seeds)
@settings(max_examples=8)
def test_without_coupling_a_full_constant_c_only_turns_lambda(seed):
    experiment = random_experiment(seed, moving=False)
    loop = Experiment(experiment.cell, experiment.gains.independent(), 1.0).closed_loop()
    Lambda = np.diag(loop.controller.Lambda)
    assert_is_slotine_and_li(loop, seed, lambda ref, i: ref.c_inv[i] @ Lambda @ ref.c[i])


@given(seeds)
@settings(max_examples=8)
def test_a_ring_of_two_is_the_pair_with_twice_beta_and_k_eps(seed):
    pair = random_experiment(seed, coupling="pair", moving=False)
    with pytest.warns(CouplingWarning):
        ring = Cell(
            pair.cell.members,
            Coupling.ring(
                2, c=look(pair.closed_loop(), 0, random_state(pair.closed_loop(), 0))[1].reference.c
            ),
        )
    twice = pair.gains.replace(beta=2 * pair.gains.beta, K_eps=2 * pair.gains.K_eps)
    one, two = (
        Experiment(pair.cell, twice, 1.0).closed_loop(),
        Experiment(ring, pair.gains, 1.0).closed_loop(),
    )
    y = random_state(one, seed)
    z = np.append(y, y[-3:])
    np.testing.assert_allclose(look(one, T, y)[1].tau, look(two, T, z)[1].tau, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("number", [-1.0, 0.01, 7.0])
def test_c_times_a_number_and_k_eps_over_its_square_is_the_same_motion(number):
    plain = simulate(small_cell(3), SMALL_GAINS, 0.3, dt=5e-3)
    coupling = Coupling.chain(3, c=[number] * 3)
    gains = SMALL_GAINS.replace(K_eps=SMALL_GAINS.K_eps / number**2)
    scaled = simulate(small_cell(3, coupling=coupling), gains, 0.3, dt=5e-3)
    np.testing.assert_allclose(scaled.q, plain.q, rtol=0, atol=1e-11)
    np.testing.assert_allclose(scaled.sync_error, number * plain.sync_error, rtol=0, atol=1e-11)


# -- plain arithmetic -------------------------------------------------------------------------------------


LAWS = pytest.mark.parametrize("reference_acceleration", ["exact", "paper"])


class Bent:
    """Ways from task to joints that are plain array arithmetic: v_ref = 2 xref'."""

    def to_joints(self, task, xref_dot, xref_ddot):
        return 2 * xref_dot, 2 * xref_ddot - xref_dot

    def to_torque(self, task, force):
        return 2 * force


def whole_order(reference_acceleration, k_r_space, numbers):
    """All lines from errors to torque, for arrays of any numbers, with or without a leading axis."""
    x = dict(numbers)
    Lambda, beta, K_eps, K_r, v = (x.pop(name) for name in ("Lambda", "beta", "K_eps", "K_r", "v"))
    w, w_dot = law.compute_weighted_errors(
        Weights(x["c"], x["c_dot"], x["c_ddot"], x["c_inv"]), np.array((x["e"], x["e_dot"]))
    )
    errors = Errors.from_rows(**x, w=w, w_dot=w_dot)
    asked = BoundSunMills(Lambda, beta, K_eps, reference_acceleration).command(errors)
    return *asked, *law.compute_joint_command(asked, errors, v, Bent(), K_r, k_r_space)


def some_numbers(rows, draw):
    """Random inputs of `whole_order`: one row per robot, and gains that are the same for all."""
    names = "e", "e_dot", "x_dot", "xd_dot", "xd_ddot", "E", "sigma", "sigma_dot", "K_r", "v"
    found = {name: draw(rows, 3) for name in names}
    found |= {name: draw(rows, 3, 3) for name in ("c", "c_dot", "c_ddot", "c_inv")}
    return found | {name: draw(3) for name in GAINS_OF_ALL}


GAINS_OF_ALL = "Lambda", "beta", "K_eps"


@LAWS
@pytest.mark.parametrize("k_r_space", ["joint", "task"])
def test_one_robot_alone_is_a_row_of_many(reference_acceleration, k_r_space):
    rng = np.random.default_rng(0)
    numbers = some_numbers(5, lambda *shape: rng.normal(size=shape))
    together = whole_order(reference_acceleration, k_r_space, numbers)
    for i in range(5):
        one = {name: array if name in GAINS_OF_ALL else array[i] for name, array in numbers.items()}
        alone = whole_order(reference_acceleration, k_r_space, one)
        for mine, rows in zip(alone, together, strict=True):
            row = rows[:, i] if rows.ndim == 3 else rows[i]
            np.testing.assert_allclose(mine, row, rtol=1e-13, atol=1e-13)


@LAWS
@pytest.mark.parametrize("k_r_space", ["joint", "task"])
def test_the_order_of_the_law_never_asks_what_its_numbers_are(reference_acceleration, k_r_space):
    rng = np.random.default_rng(1)

    def fractions(*shape):
        return np.vectorize(Fraction)(rng.integers(-9, 10, shape), rng.integers(1, 10, shape))

    numbers = some_numbers(2, fractions)
    exact, rounded = (
        whole_order(reference_acceleration, k_r_space, some)
        for some in (numbers, {name: array.astype(float) for name, array in numbers.items()})
    )
    for one, other in zip(exact, rounded, strict=True):
        assert all(isinstance(value, Fraction) for value in one.ravel())
        np.testing.assert_allclose(one.astype(float), other, rtol=1e-12, atol=1e-12)


@LAWS
@pytest.mark.parametrize("k_r_space", ["joint", "task"])
def test_the_order_of_the_law_can_be_traced_with_symbols(reference_acceleration, k_r_space):
    ca = pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    rng = np.random.default_rng(2)
    numbers = {
        name: array if name in GAINS_OF_ALL else array[0]
        for name, array in some_numbers(1, lambda *shape: rng.normal(size=shape)).items()
    }
    vector = ca.SX.sym("numbers", sum(array.size for array in numbers.values()))
    symbols, values = {}, iter(ca.vertsplit(vector))
    for name, array in numbers.items():
        symbols[name] = np.array([next(values) for _ in range(array.size)], dtype=object).reshape(array.shape)
    traced = whole_order(reference_acceleration, k_r_space, symbols)
    flat = ca.vertcat(*(entry for part in traced for entry in part.ravel()))
    found = ca.Function("order", [vector], [flat])(np.concatenate([a.ravel() for a in numbers.values()]))
    expected = np.concatenate([p.ravel() for p in whole_order(reference_acceleration, k_r_space, numbers)])
    np.testing.assert_allclose(np.array(found)[:, 0], expected, rtol=1e-12, atol=1e-12)


def test_signals_survive_the_next_evaluation():
    loop = random_experiment(3).closed_loop()
    first = look(loop, T, random_state(loop, 1))[1]
    kept = {name: getattr(first, name).copy() for name in ("Y", "tau", "s_q", "u", "z_dot", "a_ref")}
    look(loop, T, random_state(loop, 2))
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(first, name), value, err_msg=name)
