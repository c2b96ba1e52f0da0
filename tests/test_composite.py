"""Composite adaptation: what it owes to the proof, what it learns that the gradient does not, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engines import ENGINE
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Cell, Coupling, Cubic, Experiment, Friction, Gains, Member, Result, Robot, load_robot
from synctrl.analysis.certify import certify
from synctrl.analysis.lyapunov import lyapunov
from synctrl.control.adaptation import Composite, Gradient, Seen
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, mixed_four
from synctrl.robots.momentum import momentum_of_all
from synctrl.robots.parameters import planar_two_link_parameters
from synctrl.simulation.result import LAYOUT
from synctrl.simulation.schedules import Disturbance

SEEDS = st.integers(0, 2**32 - 1)
CELL = a460_pair(friction=False).cell
P = CELL.theta.shape[1]
ROWS = 0.1 * np.random.default_rng(0).standard_normal((P, 12))
SINGULAR = ROWS @ ROWS.T
KINDS = {
    "plain": Composite(0.3, 2.0, 20.0),
    "with memory": Composite(0.3, 2.0, 20.0, memory=1.0, fade=0.2),
    "of some entries": Composite(np.where(np.arange(P) % 3, 0.4, 0.0), 2.0, 20.0, memory=1.0),
    "of a singular matrix": Composite([SINGULAR], 2.0, 20.0, memory=1.0),
}
FORGETTING = Composite(0.02, 5.0, 20.0, memory=1.0, forgetting=3.0)


def with_adaptation(experiment: Experiment, adaptation) -> Experiment:
    return replace(experiment, adaptation=adaptation, gains=experiment.gains.replace(Gamma=None))


def arms(adaptation, limit: float = np.inf, friction: Friction | None = None, **options) -> Experiment:
    """Two arms that move for half a second and then rest, with the paper's three parameters each."""
    arm = load_robot("planar2r")
    model = arm.model.copy()
    model.effortLimit[:] = limit
    robot, path = Robot(model, arm.tip), Cubic([0.3, 1.0], [1.3, 2.0], 0.5)
    parameters = planar_two_link_parameters(robot)
    members = [
        Member(robot, path, parameters=parameters, theta_hat0=share * parameters.theta, friction=friction)
        for share in (0.5, 1.4)
    ]
    gains = Gains(Lambda=10.0, beta=5.0, K_r=1.0, K_eps=0.5)
    return Experiment(Cell(members, Coupling.pair()), gains, 3.0, adaptation=adaptation, **options)


def filtered(experiment: Experiment, result: Result) -> tuple[np.ndarray, np.ndarray]:
    """y and W theta along a run, (T, n, nv) each."""
    cell, bound = experiment.cell, experiment.adaptation.bind(experiment.cell)
    found = []
    for q, v, z in zip(result.q, result.v, result.outputs["adaptation_state"], strict=True):
        state = bound.parts(z)
        Y_p, _ = momentum_of_all(cell.robots, cell.parameters, q, v)
        W = experiment.adaptation.bandwidth * Y_p + state.Z
        found.append((state.y, np.matvec(W, cell.theta)))
    y, predicted = zip(*found, strict=True)
    return np.array(y), np.array(predicted)


# -- what the proof asks ----------------------------------------------------------------------------------


def seen(rng: np.random.Generator) -> Seen:
    q, v, v_ref, a_ref, s_q, tau = rng.standard_normal((6, 2, 3))
    Y, *momentum = rng.standard_normal((3, 2, 3, P))
    return Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, tau, tau, lambda: tuple(momentum))


@pytest.mark.parametrize("name", KINDS)
@given(seed=SEEDS)
def test_the_storage_changes_by_minus_s_y_tilde_and_the_named_powers(name, seed):
    rng = np.random.default_rng(seed)
    bound, now, theta = KINDS[name].bind(CELL), seen(rng), CELL.theta
    z = bound.start()
    z += 0.1 * rng.standard_normal(z.shape)
    model = float(np.sum(now.gradient * (theta - bound.estimate(z))))
    found = bound.storage_rate(z, bound.rate(z, now), theta)
    powers = bound.powers(z, theta, now)
    scale = abs(model) + sum(map(abs, powers.values()))
    assert found == pytest.approx(-model + sum(powers.values()), abs=1e-8 * scale)


@given(seed=SEEDS)
def test_with_forgetting_predictions_take_what_v_owes_them_and_the_rest_is_named(seed):
    """V_th' = -s^T Y tilde - R/2 |W tilde|^2 - kappa tilde^T Q tilde - lambda V_th where y = W theta."""
    rng = np.random.default_rng(seed)
    cell = arms(FORGETTING).cell
    bound, theta = FORGETTING.bind(cell), cell.theta
    q, v, v_ref, a_ref, s_q, tau = rng.standard_normal((6, 2, 2))
    Y, *momentum = rng.standard_normal((3, 2, 2, 3))
    now = Seen(q, v, v_ref, a_ref, s_q, np.vecmat(s_q, Y), Y, tau, tau, lambda: tuple(momentum))
    z = bound.start()
    x = bound.parts(z * (1 + 0.1 * rng.standard_normal(z.shape)))
    W = 20.0 * momentum[0] + x.Z
    z = x._replace(y=np.matvec(W, theta)).joined()
    powers = bound.powers(z, theta, now)
    model = float(np.sum(now.gradient * (theta - x.theta_hat)))
    found = bound.storage_rate(z, bound.rate(z, now), theta)
    scale = abs(model) + sum(map(abs, powers.values()))
    assert found == pytest.approx(-model + sum(powers.values()), abs=1e-9 * scale)
    missed = np.matvec(W, theta - x.theta_hat)
    assert powers["prediction"] == pytest.approx(-2.5 * np.sum(missed**2), rel=1e-9)
    assert powers["forgetting"] <= 0


@pytest.mark.parametrize(
    "make",
    [
        lambda: with_adaptation(a460_pair(friction=False), KINDS["with memory"]),
        lambda: with_adaptation(a460_pair(adapt_friction=True), Composite(0.3, 2.0, 20.0)),
    ],
    ids=["a460", "a460 with friction in Y"],
)
def test_what_is_predicted_is_the_filtered_torque_and_takes_from_v(make):
    experiment = make()
    result = experiment.simulate(0.05, dt=2.5e-4)
    y, predicted = filtered(experiment, result)
    assert np.abs(y).max() > 1
    np.testing.assert_allclose(predicted, y, rtol=0, atol=1e-9)
    assert certify(result).certified
    record = lyapunov(result)
    for name in ("prediction", "memory"):
        assert (record.power[name] <= record.rounding).all()
    assert record.power["prediction"].min() < -1e-3


def test_robots_of_different_sizes_predict_their_torque_each():
    experiment = with_adaptation(mixed_four(), Composite(1e-3, 2.0, 20.0, memory=1.0))
    result = experiment.simulate(0.02, dt=5e-4)
    y, predicted = filtered(experiment, result)
    moved = np.abs(result.theta_hat - result.theta_hat[0]).max(axis=(0, 2))
    assert (moved > 0).all()
    np.testing.assert_allclose(predicted, y, rtol=0, atol=1e-6 * np.abs(y).max())


@pytest.mark.filterwarnings("ignore::synctrl.errors.SaturationWarning")  # torque is meant to be cut
def test_torque_that_limits_cut_off_is_not_predicted_and_v_changes_by_what_is_named():
    experiment = arms(Composite(0.02, 5.0, 20.0, memory=1.0), 0.5, saturate=True)
    result = experiment.simulate(0.15, dt=2.5e-4)
    y, predicted = filtered(experiment, result)
    assert np.abs(result.tau).max() > 1
    np.testing.assert_allclose(predicted, y, rtol=0, atol=1e-5 * np.abs(y).max())
    record = lyapunov(result)
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert record.largest_drift <= 1e-5 * record.V.max()
    for name in ("saturation", "prediction", "memory"):
        assert np.abs(record.power[name]).max() > 1e3 * record.rounding.max()


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")  # friction begins at once
def test_friction_outside_the_model_feeds_v_by_the_prediction_and_the_balance_says_so():
    rubbing = arms(Composite(0.02, 5.0, 20.0), friction=Friction(0.1, 0.3, 0.2)).simulate(0.3, dt=5e-4)
    record = lyapunov(rubbing)
    assert record.power["prediction"].max() > 1e3 * record.rounding.max()
    assert (np.abs(record.power["other"]) <= record.rounding).all()
    assert any("prediction" in found for found in certify(rubbing).outside)


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")  # a push begins at once
def test_a_push_enters_the_filtered_torque_as_if_it_were_dynamics():
    """y - W theta is less by the push, filtered."""
    push = Disturbance(0, [0.3, -0.1], 0.0, 1.0)
    experiment = arms(Composite(0.02, 5.0, 20.0), disturbances=(push,))
    result = experiment.simulate(0.3, dt=5e-4)
    y, predicted = filtered(experiment, result)
    passed = (1 - np.exp(-20.0 * result.t))[:, None]
    np.testing.assert_allclose((predicted - y)[:, 0], passed * [0.3, -0.1], atol=1e-6)
    np.testing.assert_allclose((predicted - y)[:, 1], 0, atol=1e-8)


# -- what it learns ---------------------------------------------------------------------------------------


def errors_of(experiment: Experiment, *times: float) -> np.ndarray:
    """Errors of the estimates at some instants, as shares of theta, (times, robots)."""
    result, theta = experiment.simulate(dt=1e-3, engine=ENGINE), experiment.cell.theta
    rows = [np.searchsorted(result.t, t) for t in times]
    return np.linalg.norm((result.theta_hat[rows] - theta) / theta, axis=-1)


def test_with_a_memory_estimates_converge_exponentially_at_rest_where_the_gradient_stands_still():
    gamma = 0.002
    plain = errors_of(arms(Gradient(gamma)), 1.0, 2.0, 3.0)
    assert (plain[2] > 0.95 * plain[1]).all() and (plain[2] > 0.05).all()
    start, middle, end = errors_of(arms(Composite(gamma, 5.0, 20.0, memory=5.0, fade=0.0)), 1.0, 2.0, 3.0)
    assert (middle < 0.5 * start).all()
    np.testing.assert_allclose(end / middle, middle / start, rtol=0.5)


def test_a_memory_that_fades_stops_pulling_at_rest_and_leaves_an_error():
    middle, end = errors_of(arms(Composite(0.002, 5.0, 20.0, memory=5.0, fade=5.0)), 2.0, 3.0)
    assert (end > 0.95 * middle).all() and (end > 0.05).all()


def test_forgotten_gamma_shrinks_where_something_is_learned_and_grows_back_to_its_bound():
    result = (experiment := arms(FORGETTING)).simulate(1.5, dt=2e-3, engine=ENGINE)
    bound = FORGETTING.bind(experiment.cell)
    grown = []
    for z in result.outputs["adaptation_state"][::25]:
        Gamma = bound.metric(z).Gamma / 0.02
        assert (np.linalg.eigvalsh(Gamma) > 0).all()
        grown.append(np.trace(Gamma, axis1=1, axis2=2) / 3)
    at, largest = result.t[::25], 2.0
    assert np.max(grown) <= largest
    assert np.min(grown) < 0.7
    assert (np.array(grown)[-1] > 1.0).all() and at[np.argmin(np.max(grown, axis=1))] <= 0.6
    record = lyapunov(result)
    assert record.closes
    assert (record.power["forgetting"] <= record.rounding).all() and record.power["forgetting"].min() < 0


def test_without_weight_of_predictions_it_is_the_gradient_bit_for_bit():
    one, other = (arms(law).simulate(0.1) for law in (Composite(0.02, 0.0, 20.0), Gradient(0.02)))
    for name in LAYOUT:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


# -- engines and samples ----------------------------------------------------------------------------------


@pytest.mark.parametrize("adaptation", [Composite(0.02, 5.0, 20.0), FORGETTING], ids=["plain", "forgetting"])
@pytest.mark.parametrize("control", [{}, {"control_period": 2e-3}], ids=["continuous", "sampled"])
def test_both_engines_learn_alike(control, adaptation):
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    experiment = arms(adaptation)
    one, other = (experiment.simulate(0.2, engine=engine, **control) for engine in ("pinocchio", "compiled"))
    assert np.abs(one.theta_hat - one.theta_hat[0]).max() > 1e-3
    for array in LAYOUT:
        scale = np.abs(getattr(one, array)).max() + 1e-12
        assert np.abs(getattr(one, array) - getattr(other, array)).max() <= 1e-9 * scale, array
    for array, values in one.outputs.items():
        np.testing.assert_allclose(other.outputs[array], values, rtol=1e-9, atol=1e-9, err_msg=array)


@given(seed=SEEDS, h=st.floats(1e-3, 1.0))
def test_a_sample_filters_held_torque_exactly_whatever_the_period(seed, h):
    """y tends to the torque with exp(-w h), in one sample as in many."""
    bound, now = KINDS["with memory"].bind(CELL), seen(np.random.default_rng(seed))
    z = bound.start()
    for _ in range(3):
        z = bound.leap(z, bound.rate(z, now), h)
    np.testing.assert_allclose(bound.parts(z).y, (1 - np.exp(-20.0 * 3 * h)) * now.applied, atol=1e-12)


def test_with_sampled_control_what_is_predicted_errs_in_proportion_to_the_period():
    experiment, found = arms(Composite(0.02, 5.0, 20.0)), []
    for period in (2e-3, 1e-3):
        result = experiment.simulate(0.3, dt=5e-4, control_period=period)
        y, predicted = filtered(experiment, result)
        sampled = slice(None, None, round(period / 5e-4))
        found.append(np.abs(y - predicted)[sampled].max() / np.abs(y).max())
    assert found[0] < 0.05
    assert found[0] / found[1] == pytest.approx(2, rel=0.2)


# -- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "subject"),
    [
        (lambda: Composite(-0.3, 1.0, 20.0), "Gamma"),
        (lambda: Composite(0.3, -1.0, 20.0), "prediction"),
        (lambda: Composite(0.3, 0.0, 20.0, memory=1.0), "prediction"),
        (lambda: Composite(0.3, 1.0, 0.0), "bandwidth"),
        (lambda: Composite(0.3, 1.0, 20.0, memory=np.nan), "memory"),
        (lambda: Composite(0.3, 1.0, 20.0, fade=-0.1), "fade"),
        (lambda: Composite(0.3, 1.0, 20.0, forgetting=-1.0), "forgetting"),
        (lambda: Composite(0.3, 0.0, 20.0, forgetting=1.0), "prediction"),
        (lambda: Composite(0.3, 1.0, 20.0, forgetting=1.0, growth=1.0), "growth"),
        (lambda: Composite(0.3, 1.0, 20.0, forgetting=1.0).bind(CELL), "robot 1, adaptation"),
        (lambda: arms(Composite([0.1, 0.1, 0.0], 1.0, 20.0, forgetting=1.0)), "Gamma"),
        (lambda: Composite(np.ones(3), 1.0, 20.0).bind(CELL), "Gamma"),
        (lambda: KINDS["plain"].bind(CELL).rate(KINDS["plain"].bind(CELL).start(), unknowing()), "momentum"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong, subject):
    with refused(InputError, subject):
        wrong()


def unknowing() -> Seen:
    """Signals without the regressors of momentum."""
    rows, gradient = np.zeros((2, 3)), np.zeros((2, P))
    return Seen(rows, rows, rows, rows, rows, gradient, None, rows, rows)
