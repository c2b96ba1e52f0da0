"""Arms that give way to the forces inside what they hold."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl.analysis import certify
from synctrl.control.adaptation import Box
from synctrl.control.admittance import Admittance, BoundAdmittance
from synctrl.coupling.cell import Reference
from synctrl.errors import InputError
from synctrl.experiments import a460_pair, carry_ur5
from synctrl.experiments.carry import GAINS
from synctrl.simulation.plant import Plant
from synctrl.simulation.result import Result
from synctrl.simulation.simulate import Experiment
from synctrl.tasks.measurement import Measurement
from synctrl.tasks.rotations import exp, log

SEEDS = st.integers(0, 2**32 - 1)
SOFT = Admittance(mass=(80.0, 2.0), damping=(2500.0, 70.0))


def squeezed(duration: float = 0.24, **options) -> np.ndarray:
    """Force inside at hand 1, N."""
    run = carry_ur5(**options).simulate(duration, dt=2e-3, log_dt=0.02)
    return np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)


@given(SEEDS)
def test_the_power_of_forces_inside_is_the_rate_of_a_storage_and_a_loss(seed):
    """With h = -(M y'' + D y') and A = Lambda + beta L, for any constant delta in yt = y - delta."""
    rng = np.random.default_rng(seed)
    S = rng.normal(size=(3, 4))
    M, D, Lambda, beta = rng.uniform(0.1, 5, 4)
    A = Lambda * np.eye(4) + beta * S.T @ S
    y_tilde, y_dot, y_ddot = rng.normal(size=(3, 4))
    h = -(M * y_ddot + D * y_dot)
    stored = M * (y_dot @ y_ddot + y_ddot @ A @ y_tilde + y_dot @ A @ y_dot) + D * y_tilde @ A @ y_dot
    lost = y_dot @ (D * np.eye(4) - M * A) @ y_dot
    assert (y_dot + A @ y_tilde) @ h == pytest.approx(-stored - lost, rel=1e-9, abs=1e-9)
    bound = (Lambda + beta * np.linalg.eigvalsh(S.T @ S)[-1]) * M
    assert (np.linalg.eigvalsh(D * np.eye(4) - M * A)[0] > 0) == (bound < D)


@given(SEEDS)
def test_integrals_that_leak_less_than_lambda_keep_the_proof_if_k_eps_is_at_least_beta_d_a(seed):
    """In one direction along an eigenvector of L: a storage above zero takes all power but what is lost."""
    rng = np.random.default_rng(seed)
    M, Lambda, beta, mu = 10 ** rng.uniform(-1, 1, 4)
    leak, A = rng.uniform(0, Lambda), Lambda + beta * mu
    D = M * A * (1 + 10 ** rng.uniform(-3, 2))
    K, rest = beta * D * (1 + rng.choice([0.0, 1.0]) * rng.uniform()), (Lambda - leak) * beta
    both = rest * (D + M * leak)
    of_E = rest * (K + leak * (D + M * leak) / mu)
    stored = np.array(
        [[M, M * A, rest * M], [M * A, K * mu + D * A - rest * M * mu, both], [rest * M, both, of_E]]
    )
    of_y = K * (Lambda + beta * mu) * mu - both * mu
    lost = np.array([D - M * A, of_y, leak * of_E])
    y, y_dot, y_ddot, E = rng.normal(size=4)
    E_dot = mu * y - leak * E
    x, x_dot = np.array([y_dot, y, E]), np.array([y_ddot, y_dot, E_dot])
    inside = (y_dot + A * y + rest * E) * -(M * y_ddot + D * y_dot)
    synchronized = K * mu * y * y_dot + K * rest * E * E_dot  # the rate of its energies, and what it takes
    taken = K * Lambda * mu * y**2 + K * beta * mu**2 * y**2 + leak * K * rest * E**2
    power = inside - synchronized - taken
    size = np.abs(x) @ np.abs(stored) @ np.abs(x_dot) + lost @ x**2
    assert power == pytest.approx(-x @ stored @ x_dot - lost @ x**2, abs=1e-12 * size)
    scale = 1 / np.sqrt(stored.diagonal())
    assert np.linalg.eigvalsh(scale[:, None] * stored * scale)[0] > 0 and lost.min() >= 0


def bound(admittance: Admittance) -> BoundAdmittance:
    nothing = SimpleNamespace(start=lambda: np.zeros((2, 0)))
    return BoundAdmittance(nothing, np.repeat(admittance.mass, 3), np.repeat(admittance.damping, 3))


@pytest.mark.parametrize("massless", [False, True])
@given(SEEDS)
def test_what_gives_way_moves_errors_and_desired_motion_together(massless, seed):
    """e and xd' are moved by Y and Y', and e' and xd'' by their rates, as the desired axes turn."""
    rng = np.random.default_rng(seed)
    giving = bound(Admittance((0.0, 0.0), (2.0, 3.0)) if massless else Admittance((2.0, 3.0), (4.0, 5.0)))
    xd, w, w_dot = rng.normal(size=(3, 2, 6)), rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
    y, h = rng.normal(size=(2, 2, 6)), rng.normal(size=(2, 6))

    def moved(t: float) -> np.ndarray:
        angle = (w + 0.5 * t * w_dot) * t  # the axes' turn to the second order, enough for a derivative at 0
        turn = exp(angle) @ exp(xd[0][:, 3:])
        desired = np.zeros((3, 2, 6))
        desired[0][:, 3:] = [log(R) for R in turn]
        desired[1][:, 3:], desired[2][:, 3:] = w + t * w_dot, w_dot
        y_dot, y_ddot = giving.giving.rates(y[1], h)
        now = np.concatenate((y[0] + t * y_dot + 0.5 * t**2 * y_ddot, y[1] + t * y_ddot), axis=1)
        zeros = np.zeros((2, 2, 6))
        task = Measurement(zeros, zeros, zeros)
        wrenches = np.matvec(exp(desired[0][:, None, 3:]), h.reshape(2, 2, 3)).reshape(2, 6)
        found, felt = giving.moved(task, now, Reference(desired, None), wrenches)
        np.testing.assert_allclose(felt, h, atol=1e-9)
        return np.stack((*found.error, *found.rates))

    here, step = moved(0.0), 1e-6
    rate = (moved(step) - moved(-step)) / (2 * step)
    np.testing.assert_allclose(here[1], rate[0], atol=1e-7)
    assert np.array_equal(here[2:], np.zeros((2, 2, 6))) == massless
    if not massless:
        np.testing.assert_allclose(here[2], here[1])
        np.testing.assert_allclose(here[3], rate[1], atol=1e-7)


@pytest.mark.parametrize("turning", [False, True])
@given(SEEDS)
def test_axes_that_turn_leave_the_power_of_what_was_given_way_through_them(turning, seed):
    """Of what the controller is told: e = -R_d delta and its rate, with y on top, in world axes."""
    rng = np.random.default_rng(seed)
    giving, (Lambda, beta) = bound(SOFT), rng.uniform(0.5, 5, 2)
    M, D, L = giving.mass, giving.damping, np.array([[1.0, -1.0], [-1.0, 1.0]])
    xd, h = np.zeros((3, 2, 6)), rng.normal(size=6) * [[1.0], [-1.0]]
    xd[:, :, 3:] = rng.normal(size=(3, 1, 3)) * [[[1.0]], [[turning]], [[turning]]]
    R, w, (y, y_dot, delta) = exp(xd[0, 0, 3:]), xd[1, 0, 3:], rng.normal(size=(3, 2, 6))

    def in_world(rows: np.ndarray) -> np.ndarray:
        return (rows.reshape(2, 2, 3) @ R.T).reshape(2, 6)

    def swept(rows: np.ndarray) -> np.ndarray:
        return np.cross(w, rows.reshape(2, 2, 3)).reshape(2, 6)

    error = np.stack((-in_world(delta), -swept(in_world(delta))))
    task = Measurement(np.zeros((2, 2, 6)), error, np.zeros((2, 2, 6)))
    state, wrenches = np.concatenate((y, y_dot), axis=1), in_world(h)
    e, e_dot = giving.moved(task, state, Reference(xd, None), wrenches)[0].error
    power = np.sum((e_dot + Lambda * e + beta * L @ e) * wrenches)
    y_ddot, tilde = giving.giving.rates(y_dot, h)[1], y - delta
    A_tilde, A_dot = (Lambda * x + beta * L @ x for x in (tilde, y_dot))
    stored = np.sum(M * (y_dot * y_ddot + y_ddot * A_tilde + y_dot * A_dot) + D * tilde * A_dot)
    left = np.sum(swept(in_world(tilde)) * wrenches)
    assert power == pytest.approx(-stored - np.sum(y_dot * (D * y_dot - M * A_dot)) + left, rel=1e-8)
    assert (left != 0) == turning


def test_arms_give_way_against_each_other_and_take_the_force_out_of_a_wrong_geometry():
    error = np.array([2e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    run = carry_ur5(geometric_error=error, admittance=True).simulate(0.4, dt=2e-3, log_dt=0.02)
    y = run.outputs["admittance"]
    assert np.abs(y).max() > 1e-4
    np.testing.assert_allclose(y[:, 0], -y[:, 1], atol=1e-9)  # what is felt inside sums to zero
    stiff = squeezed(0.4, geometric_error=error, leak=True)
    force = np.linalg.norm(run.outputs["internal_force"][:, 0, :3], axis=1)
    assert force[-1] < 0.6 * stiff[-1]


def test_an_admittance_helps_and_with_a_tare_and_stiff_synchronization_takes_two_thirds_of_the_force():
    wrong = {"geometric_error": True}
    alone = squeezed(synchronized=False, **wrong)[-1]
    giving = squeezed(synchronized=False, admittance=True, **wrong)[-1]
    stiff = GAINS.replace(K_eps=[2e4] * 3 + [200.0] * 3)
    best = squeezed(tare=True, admittance=True, gains=stiff, **wrong)[-1]
    assert giving < 0.95 * alone and best < alone / 3


def test_integrals_leak_at_lambda_with_an_admittance_unless_told_otherwise():
    made = carry_ur5(admittance=True)
    assert np.array_equal(made.gains.leak, made.gains.Lambda)
    assert made.admittance is not None and carry_ur5(admittance=SOFT).admittance is SOFT
    assert carry_ur5(admittance=True, leak=1.0).gains.leak == 1.0
    assert not np.any(carry_ur5().gains.leak) and carry_ur5().admittance is None


def test_a_digital_controller_is_given_the_wrenches_and_asks_the_same_torque():
    run = carry_ur5(geometric_error=True, admittance=SOFT)
    result = run.simulate(0.012, dt=1e-3, control_period=2e-3)
    loop, controller = run.closed_loop(), run.controller(2e-3)
    controller.reset(0.0, result.q[0], result.v[0])
    for k in range(0, 12, 2):
        wrenches = loop.plant.felt(result.q[k], result.v[k], result.outputs["plant_state"][k])
        tau = controller.step(result.t[k], result.q[k], result.v[k], wrenches=wrenches)
        assert np.array_equal(tau, result.tau[k])
    with refused(InputError, "wrenches"):
        controller.step(result.t[12], result.q[12], result.v[12])
    with refused(InputError, "wrenches"):
        controller.step(result.t[12], result.q[12], result.v[12], wrenches=np.zeros((2, 3)))


def test_a_run_with_an_admittance_is_saved_and_gone_through_again(tmp_path):
    made = carry_ur5(admittance=SOFT)
    made.simulate(4e-3, dt=1e-3).save(tmp_path / "run.npz")
    loaded = Result.load(tmp_path / "run.npz")
    assert loaded.info["admittance"] == SOFT.as_dict()
    certify(loaded, experiment=made)
    with refused(InputError, "experiment", found="admittance"):
        certify(loaded, experiment=carry_ur5(admittance=True))


def test_the_adaptation_learns_as_it_would_alone():
    """Its estimates are projected, and its state begins where it would."""
    made = carry_ur5(admittance=True, adaptation=Box(0.01, -100.0, 100.0))
    alone = carry_ur5(leak=True, adaptation=Box(0.01, -100.0, 100.0))
    pair = [each.closed_loop().controller.adaptation for each in (made, alone)]
    z = [each.start() for each in pair]
    assert np.array_equal(z[0][:, :-12], z[1]) and not z[0][:, -12:].any()
    far = [each.settle(1e4 * np.ones_like(state)) for each, state in zip(pair, z, strict=True)]
    assert np.array_equal(far[0][:, :-12], far[1]) and (far[0][:, -12:] == 1e4).all()


@pytest.mark.parametrize(
    ("make", "subject"),
    [
        (lambda: Admittance(mass=(-1.0, 1.0)), "admittance, mass"),
        (lambda: Admittance(damping=(0.0, 1.0)), "admittance, damping"),
        (lambda: Admittance(damping=(1.0,)), "admittance, damping"),
        (lambda: carry_ur5(admittance=1.0), "admittance"),
        (lambda: _with_admittance(a460_pair()), "space"),
        (lambda: _with_admittance(_uncarried()), "admittance"),
    ],
)
def test_what_cannot_give_way_is_refused(make, subject):
    with refused(InputError, subject):
        make()


def _with_admittance(experiment: Experiment) -> None:
    replace(experiment, admittance=Admittance())


def _uncarried() -> Experiment:
    return replace(carry_ur5(), plant_type=Plant)
