"""Gamma as a matrix, leakage and projection: what each of them owes to the proof, in numbers and in runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Experiment, load_robot
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.adaptation import Ball, Box, EModification, Gradient, Leakage, Seen, Switching
from synctrl.control.adaptation.metric import make_metric, read_metric
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four, planar_four
from synctrl.robots.pseudo_inertia import inertial_parameters, inverse_hessian, pseudo_inertia
from synctrl.simulation.result import LAYOUT

SEEDS = st.integers(0, 2**32 - 1)
CELL = a460_pair(friction=False).cell
P = CELL.theta.shape[1]


def singular(seed: int = 0, rank: int = 12) -> np.ndarray:
    """A symmetric positive semidefinite matrix, (P, P)."""
    rows = np.random.default_rng(seed).standard_normal((P, rank))
    return 0.02 * rows @ rows.T


def within(reach: float) -> Box:
    """A box about the first estimate."""
    return Box(0.3, CELL.theta_hat0 - reach, CELL.theta_hat0 + reach)


TIGHT = {"box": within(0.02), "ball": Ball(0.3, 0.05), "ball of a matrix": Ball([singular()], 0.1)}
FORGETTING = {
    "constant": Leakage(0.3, 0.5),
    "switching": Leakage([singular()], Switching(2.0, 0.02)),
    "e-modification": Leakage(0.3, EModification(0.5)),
}
FULL = {"matrix": Gradient([singular()]), "pullback": Gradient.pullback(load_robot("a460"), 0.1)}
ALL = {**FULL, **FORGETTING, **TIGHT}


def seen(rng: np.random.Generator) -> Seen:
    q, v, v_ref, a_ref, s_q = rng.standard_normal((5, 2, 3))
    Y = rng.standard_normal((2, 3, P))
    return Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, s_q, s_q)


def with_adaptation(experiment: Experiment, adaptation) -> Experiment:
    return replace(experiment, adaptation=adaptation, gains=experiment.gains.replace(Gamma=None))


def moved(bound, rng: np.random.Generator, far: float = 0.3) -> np.ndarray:
    """A state that rates and projections can lead to."""
    return bound.settle(bound.start() + far * bound.metric.raised(rng.standard_normal((2, P))))


# -- identities -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
@given(seed=SEEDS)
def test_the_storage_changes_by_minus_s_y_tilde_and_the_named_powers(name, seed):
    rng = np.random.default_rng(seed)
    bound, now, theta = ALL[name].bind(CELL), seen(rng), CELL.theta
    z = moved(bound, rng)
    model = float(np.sum(now.gradient * (theta - z)))
    found = bound.storage_rate(z, bound.rate(z, now), theta)
    expected = -model + sum(bound.powers(z, theta, now).values())
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8 * np.abs(now.gradient).max())


@given(seed=SEEDS)
def test_a_diagonal_matrix_learns_as_its_diagonal(seed):
    rng = np.random.default_rng(seed)
    diagonal = np.where(np.arange(P) % 4, rng.uniform(0.1, 1, P), 0.0)
    one, other = Gradient(diagonal).bind(CELL), Gradient([np.diag(diagonal)]).bind(CELL)
    now, z = seen(rng), moved(one, rng)
    np.testing.assert_allclose(other.rate(z, now), one.rate(z, now), atol=1e-12)
    assert other.storage(z, CELL.theta) == pytest.approx(one.storage(z, CELL.theta), rel=1e-9)
    assert other.powers(z, CELL.theta, now) == pytest.approx(one.powers(z, CELL.theta, now), rel=1e-9)


@given(seed=SEEDS)
def test_switching_leakage_takes_energy_if_the_truth_is_within_its_radius(seed):
    rng = np.random.default_rng(seed)
    bound = Leakage(0.3, Switching(2.0, 1.0)).bind(CELL)
    offset = rng.standard_normal((2, P))
    theta = bound.theta_hat0 + 0.99 * offset * np.sqrt(0.3) / np.linalg.norm(offset, axis=1, keepdims=True)
    z = moved(bound, rng, 2.0)
    assert bound.powers(z, theta, seen(rng))["leakage"] <= 1e-9


@given(seed=SEEDS)
def test_leakage_is_bounded_by_what_completing_the_square_gives(seed):
    """leakage <= -nu V_th + nu/2 |theta - theta_hat0|^2."""
    rng = np.random.default_rng(seed)
    bound = Leakage(0.3, 0.7).bind(CELL)
    z, theta = moved(bound, rng), CELL.theta
    offset = theta - bound.theta_hat0
    allowed = -0.7 * bound.storage(z, theta) + 0.35 * np.sum(offset**2) / 0.3
    assert bound.powers(z, theta, seen(rng))["leakage"] <= allowed + 1e-9 * abs(allowed)


# -- projection -------------------------------------------------------------------------------------------


def inside(bound, share: np.ndarray) -> np.ndarray:
    """A truth that lies inside the layer; `share` from -1 to 1, (2, P)."""
    if hasattr(bound, "lower"):
        middle, half = (bound.upper + bound.lower) / 2, (bound.upper - bound.lower) / 2
        return middle + 0.9 * half * share
    step = bound.metric.raised(share)
    length = np.sqrt(np.sum(step * bound.metric.lowered(step), axis=1))
    return bound.theta_hat0 + 0.9 * (bound.radius / np.maximum(length, 1e-12))[:, None] * step


@pytest.mark.parametrize("name", TIGHT)
@given(seed=SEEDS)
def test_what_projection_takes_away_never_feeds_v_if_the_truth_is_inside(name, seed):
    rng = np.random.default_rng(seed)
    bound = TIGHT[name].bind(CELL)
    z = moved(bound, rng, 10 ** rng.uniform(-2, 1))
    theta = inside(bound, rng.uniform(-1, 1, (2, P)))
    assert bound.powers(z, theta, seen(rng))["projection"] <= 1e-9


@pytest.mark.parametrize("name", TIGHT)
@given(seed=SEEDS)
def test_projecting_never_raises_the_storage_and_is_done_once(name, seed):
    rng = np.random.default_rng(seed)
    bound = TIGHT[name].bind(CELL)
    theta = inside(bound, rng.uniform(-1, 1, (2, P)))
    z = bound.start() + bound.metric.raised(10 ** rng.uniform(-2, 2) * rng.standard_normal((2, P)))
    settled = bound.settle(z)
    assert bound.storage(settled, theta) <= bound.storage(z, theta) * (1 + 1e-12)
    np.testing.assert_allclose(bound.settle(settled), settled, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", TIGHT)
@given(seed=SEEDS)
def test_nothing_is_taken_away_of_a_rate_that_points_inwards_or_far_from_the_border(name, seed):
    rng = np.random.default_rng(seed)
    bound, plain = TIGHT[name].bind(CELL), Gradient(TIGHT[name].Gamma).bind(CELL)
    now = seen(rng)
    np.testing.assert_array_equal(bound.rate(bound.start(), now), plain.rate(bound.start(), now))
    z = moved(bound, rng, 10.0)
    gradient = bound.metric.lowered(bound.start() - z)
    inwards = replace(now, gradient=gradient)
    np.testing.assert_allclose(bound.rate(z, inwards), plain.rate(z, inwards), atol=1e-12)


@pytest.mark.parametrize("name", TIGHT)
def test_estimates_stay_where_they_may_be_through_a_run_and_are_held_there(name):
    result = with_adaptation(a460_pair(friction=False), TIGHT[name]).simulate(0.3)
    bound = TIGHT[name].bind(CELL)
    far = [np.abs(bound.settle(row) - row).max() for row in result.theta_hat]
    assert max(far) <= 1e-12
    free = with_adaptation(a460_pair(friction=False), Gradient(TIGHT[name].Gamma)).simulate(0.3)
    assert np.abs(free.theta_hat - result.theta_hat).max() > 1e-3


@pytest.mark.parametrize("name", ["box", "ball"])
@pytest.mark.parametrize("seed", range(3))
def test_a_step_is_of_second_order_where_estimates_are_held_and_of_fourth_where_they_are_not(name, seed):
    assert 2.0 < order(TIGHT[name], seed) < 3.7
    assert order(Gradient(0.3), seed) == pytest.approx(4.0, abs=0.1)


def order(adaptation, seed: int) -> float:
    """With which power of the step the error falls, by a line through five halvings."""
    steps = 2 ** np.arange(4, 10)
    exact = learned(adaptation, seed, 4096)
    errors = [np.abs(learned(adaptation, seed, number) - exact).max() for number in steps]
    return float(-np.polyfit(np.log(steps), np.log(errors), 1)[0])


def learned(adaptation, seed: int, steps: int) -> np.ndarray:
    """What RK4 makes of a gradient that swings for a second."""
    bound, rng, h = adaptation.bind(CELL), np.random.default_rng(seed), 1 / steps
    one, other = 0.3 * rng.standard_normal((2, 2, P))
    now, z = seen(rng), bound.start()

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        return bound.rate(z, replace(now, gradient=one * np.sin(5 * t) + other * np.cos(3 * t)))

    for t in h * np.arange(steps):
        k1 = rate(t, z)
        k2 = rate(t + h / 2, z + h / 2 * k1)
        k3 = rate(t + h / 2, z + h / 2 * k2)
        z = bound.settle(z + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t + h, z + h * k3)))
    return z


# -- runs -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_v_changes_by_what_its_powers_supply(name):
    result = with_adaptation(a460_pair(friction=False), ALL[name]).simulate(0.1, dt=2.5e-4)
    record = lyapunov(result)
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.closes or name in TIGHT  # the layer has kinks, where quadrature knows no error bound
    assert record.largest_drift <= 1e-5 * record.V.max()


def test_a_gradient_in_the_metric_of_bodies_is_certified():
    result = with_adaptation(a460_pair(friction=False), FULL["pullback"]).simulate(0.3, dt=5e-4)
    assert certify(result).certified


@pytest.mark.parametrize("control", [{}, {"control_period": 2e-3}])
@pytest.mark.parametrize("name", ALL)
def test_both_engines_learn_alike(name, control):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = with_adaptation(a460_pair(friction=False), ALL[name])
    one, other = (experiment.simulate(0.2, engine=engine, **control) for engine in ("pinocchio", "compiled"))
    for array in LAYOUT:
        scale = np.abs(getattr(one, array)).max() + 1e-12
        assert np.abs(getattr(one, array) - getattr(other, array)).max() <= 1e-9 * scale, array


def test_robots_of_different_kinds_have_matrices_of_their_own():
    cell = mixed_four().cell
    matrices = [1e-3 * np.diag(1 + np.abs(p.theta)) for p in cell.parameters]
    experiment = with_adaptation(mixed_four(), Gradient(matrices))
    rows = [1e-3 * (1 + np.abs(p.theta)) for p in cell.parameters]
    result, same = experiment.simulate(0.01), with_adaptation(mixed_four(), Gradient(rows)).simulate(0.01)
    np.testing.assert_allclose(result.theta_hat, same.theta_hat, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("name", ["planar2r", "a460", "ur5", "panda", "so100"])
def test_all_that_a_gradient_in_the_metric_of_bodies_can_learn_is_in_v(name):
    """Its entries differ by 13 orders of magnitude on a Panda; none of them is singular."""
    robot = load_robot(name)
    metric = make_metric(Gradient.pullback(robot, 0.1).Gamma, [10 * robot.body_count])
    size = np.sqrt(np.diagonal(metric.Gamma[0]))
    error = size * np.random.default_rng(0).standard_normal((1, len(size)))
    np.testing.assert_allclose(metric.frozen(error) / size, 0, atol=1e-12)
    np.testing.assert_allclose(metric.raised(metric.lowered(error)) / size, error / size, atol=1e-6)


@given(SEEDS)
def test_what_a_singular_gamma_cannot_learn_does_not_depend_on_units(seed):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((6, 4))
    units = 10.0 ** rng.integers(-4, 5, 6)
    one, other = (make_metric((rows_u @ rows_u.T,), [6]) for rows_u in (rows, units[:, None] * rows))
    error = rng.standard_normal((1, 6))
    np.testing.assert_allclose(other.frozen(units * error), units * one.frozen(error), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(units * other.lowered(units * error), one.lowered(error), rtol=1e-5, atol=1e-7)


# -- the metric of bodies ---------------------------------------------------------------------------------


@given(SEEDS)
def test_the_metric_of_bodies_is_the_inverse_hessian_of_minus_log_det(seed):
    rng = np.random.default_rng(seed)
    root = rng.uniform(-0.3, 0.3, (4, 4)) + 2 * np.eye(4)
    theta = inertial_parameters(root @ root.T)

    def slope(at: np.ndarray) -> np.ndarray:
        inverse = np.linalg.inv(pseudo_inertia(at))
        return np.array([-np.sum(inverse * pseudo_inertia(unit)) for unit in np.eye(10)])

    h = 1e-4
    hessian = np.array([(slope(theta + h * unit) - slope(theta - h * unit)) / (2 * h) for unit in np.eye(10)])
    product = hessian @ inverse_hessian(root @ root.T)
    np.testing.assert_allclose(product, np.eye(10), atol=1e-6)


def test_friction_stands_beside_the_metric_of_bodies_with_rates_of_its_own():
    robot, rates = load_robot("a460"), [0.1, 0.2, 0.3, 1.0, 2.0, 3.0]
    (bodies,), (whole,) = (Gradient.pullback(robot, 0.1, friction).Gamma for friction in ((), rates))
    expected = np.zeros((36, 36))
    expected[:30, :30], expected[30:, 30:] = bodies, np.diag(rates)
    np.testing.assert_array_equal(whole, expected)


@given(SEEDS)
def test_the_metric_of_bodies_follows_the_unit_of_length(seed):
    """theta in mm is T theta, and Gamma there is T Gamma T."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((4, 4)) + 2 * np.eye(4)
    unit = np.diag([1e3, 1e3, 1e3, 1.0])
    T = np.array([1.0, 1e3, 1e3, 1e3, *[1e6] * 6])
    metric = inverse_hessian(root @ root.T)
    in_mm = inverse_hessian(unit @ root @ root.T @ unit)
    np.testing.assert_allclose(in_mm, T[:, None] * metric * T, rtol=1e-9, atol=1e-9)


# -- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [
        (lambda: Gradient([np.eye(3)[:2]]), "Gamma of robot 1"),
        (lambda: Gradient([np.triu(np.ones((3, 3)))]), "Gamma of robot 1"),
        (lambda: Gradient([np.eye(3), -np.eye(3)]), "Gamma of robot 2"),
        (lambda: Gradient([np.eye(3)]).bind(CELL), "Gamma"),
        (lambda: Gradient(np.eye(P)).bind(CELL), "Gamma"),
        (lambda: Gradient([np.eye(P)] * 3).bind(CELL), "Gamma"),
        (lambda: Gradient.pullback(load_robot("a460"), 0.0), "gamma"),
        (lambda: Leakage(0.3, 0.0), "rate"),
        (lambda: Leakage(0.3, "switching"), "rate"),
        (lambda: Leakage(0.3, Switching(1.0, -1.0)), "rate, radius"),
        (lambda: Box([np.eye(P)], -1, 1), "Gamma"),
        (lambda: Box(0.3, 1, 1).bind(CELL), "robot 1, Box"),
        (lambda: Box(0.3, 1e6, 2e6).bind(CELL), "robot 1, Box"),
        (lambda: Box(0.3, np.zeros(3), np.ones(3)).bind(CELL), "lower"),
        (lambda: Ball(0.3, 0.0), "radius"),
        (lambda: Ball(0.3, [1.0, 2.0, 3.0]).bind(CELL), "radius"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong, subject):
    with refused(InputError, subject):
        wrong()


def test_of_as_many_robots_as_parameters_a_diagonal_matrix_is_refused_and_rows_are_rows():
    sizes, rows = [3, 3, 3], [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    with refused(InputError, "Gamma"):
        make_metric(read_metric(2 * np.eye(3)), sizes)
    for kept in (rows, np.zeros((3, 3))):
        np.testing.assert_array_equal(make_metric(read_metric(kept), sizes).Gamma, kept)
    assert make_metric(read_metric([[0.3]]), [1]).Gamma == 0.3


def test_maps_without_bodies_have_leakage_and_projection_too():
    cell = planar_four().cell
    reach = np.abs(cell.theta).max(axis=0) + 1
    for adaptation in (Leakage(0.3, 0.1), Ball(0.3, 1.0), Box(0.3, -reach, reach)):
        with_adaptation(planar_four(), adaptation).simulate(0.01)


@pytest.mark.parametrize(
    "make", [lambda reach: Ball(0.3, reach), lambda reach: Leakage(0.3, Switching(2.0, reach))]
)
def test_what_is_known_to_hold_the_truth_leaves_the_theorem_as_it_is(make):
    far = np.sqrt(((CELL.theta - CELL.theta_hat0) ** 2).sum(axis=1).max() / 0.3)
    result = with_adaptation(a460_pair(friction=False), make(1.2 * far)).simulate(0.3, dt=5e-4)
    assert certify(result).certified
