"""What docs/theory.md proves beyond V' <= 0: from V' to the errors, redundant arms, the gain of beta."""

from __future__ import annotations

import numpy as np
import pytest
from theory_cells import GAINS, coupling, experiment, planar_arm

from synctrl import Cell, Coupling, Experiment, FunctionTrajectory, Member
from synctrl.analysis import side_by_side
from synctrl.analysis.lyapunov import THEOREM, lyapunov
from synctrl.analysis.replay import replay
from synctrl.control.laws import Along, SunMills
from synctrl.experiments import planar_four
from synctrl.paper.fairness import STIFFEST, taken_apart

pytestmark = pytest.mark.filterwarnings("ignore::synctrl.errors.CouplingWarning")  # odd rings are meant
rng = np.random.default_rng(11)

# -- from V' to the errors --------------------------------------------------------------------------------

NO_BETA_ON_ONE_AXIS = GAINS.replace(beta=[0.0, 3.0])


@pytest.mark.parametrize("kind", ["ring", "signed graph", "all-to-all"])
def test_epsilon_is_s_e_star_less_what_the_integral_takes_axis_by_axis(kind: str) -> None:
    """So it is bounded, and goes to zero with e*: by itself where beta is 0, and with I where it is not."""
    link = coupling(kind, 5, 2, "moving")
    run = replay(experiment(link, NO_BETA_ON_ONE_AXIS).simulate(0.05, 1e-3))
    S, x, I = link.matrix, run.rows, run.result.sync_integral
    taken = NO_BETA_ON_ONE_AXIS.beta * (S @ S.T @ I)
    found = S @ x.e_star - taken
    np.testing.assert_allclose(x.epsilon, found, atol=1e-13 * np.abs(found).max())
    np.testing.assert_allclose(x.epsilon[..., :1], S @ x.e_star[..., :1], atol=1e-14)
    assert np.abs(taken[-1, :, 1]).max() > 1e-3 * np.abs(x.epsilon).max()
    outside = np.eye(len(S)) - S @ np.linalg.pinv(S)
    np.testing.assert_allclose(outside @ I, 0, atol=1e-14)  # I stays where S S^T is positive definite


@pytest.mark.parametrize("beta", [0.0, 2.0])
def test_the_rate_of_epsilon_bounds_it_only_where_beta_is_positive(beta: float) -> None:
    """epsilon' = S f - beta S S^T epsilon of a bounded f, in closed form per eigenvalue of S S^T."""
    S = coupling("ring", 4, 1).matrix
    lambdas, vectors = np.linalg.eigh(S @ S.T)
    f = vectors.T @ (S @ rng.uniform(-1, 1, 4))

    def reached(t: float) -> float:
        rate = beta * lambdas
        grown = np.where(rate > 1e-9, -np.expm1(-rate * t) / np.maximum(rate, 1e-9), t)
        return float(np.abs(grown * f).max())

    assert reached(100.0) / reached(10.0) == pytest.approx(1.0 if beta else 10.0, rel=1e-6)


def with_a_break() -> Experiment:
    """A pair whose desired acceleration jumps at 0.02 s, and nothing before it."""
    arm, at = planar_arm(gravity=3.0), 0.02
    late = lambda t: max(t - at, 0.0)  # noqa: E731
    members = [
        Member(
            arm,
            FunctionTrajectory(
                lambda t, q=q: q + 4.0 * late(t) ** 2 * np.ones(2),
                lambda t: 8.0 * late(t) * np.ones(2),
                lambda t: 8.0 * (t >= at) * np.ones(2),
                breaks=(at,),
            ),
            q0=q + 0.05,
            theta_hat0=0.6 * arm.inertial_parameters,
        )
        for q in (np.array([0.4, 1.1]), np.array([0.5, 0.9]))
    ]
    return Experiment(Cell(members, coupling("pair", 2, 2)), GAINS, 0.04)


def test_v_dot_is_continuous_and_lipschitz_across_a_break_at_which_its_slope_jumps() -> None:
    """V'' need not exist where xd'' jumps. Barbalat's lemma asks for a V' that is uniformly continuous."""
    result = with_a_break().simulate(dt=1e-3)
    run, record, k = replay(result), lyapunov(result), 20
    left, right = run.logged[k] - 1, run.logged[k]
    x, K_r, K_eps, Lambda, beta = run.rows, *(getattr(GAINS, g) for g in ("K_r", "K_eps", "Lambda", "beta"))

    def v_dot(row: int) -> float:
        s, epsilon, sigma = x.s_q[row], x.epsilon[row], x.sigma[row]
        lost = (K_r * s**2).sum() + K_eps * (Lambda * epsilon**2).sum() + K_eps * (beta * sigma**2).sum()
        return -float(lost)

    assert result.t[k] == pytest.approx(0.02) and left == k
    assert v_dot(left) == pytest.approx(v_dot(right), rel=1e-12)
    assert record.V_dot[k] == pytest.approx(v_dot(right), rel=1e-9)
    s_q_dot = x.a_ref[[left, right]] - x.v_dot[[left, right]]
    assert np.abs(np.diff(s_q_dot, axis=0)).max() > 0.1 * np.abs(s_q_dot).max()  # and so V'' jumps
    slopes = np.abs(np.diff(record.V_dot)) / np.diff(record.t)
    assert slopes[k - 1 : k + 1].max() < 2 * slopes[[k - 2, k + 1]].max()  # no steeper than beside the break


def test_every_power_that_the_theorem_knows_is_below_zero_by_its_form() -> None:
    """So V' <= 0 wherever "other" and what is outside are zero: the check is that V' is its formula."""
    cell = experiment(coupling("ring", 4, 2)).cell
    law = SunMills().bind(cell, GAINS)
    epsilon, epsilon_dot = rng.normal(size=(2, 4, 2))
    E, sigma, sigma_dot, e_star, r = rng.normal(size=(5, 4, 2))
    c = np.broadcast_to(np.eye(2), (4, 2, 2))
    powers = law.proof(Along(epsilon, epsilon_dot, E, sigma, sigma_dot, e_star, r, c, np.zeros(0))).powers
    assert set(powers) < set(THEOREM)
    assert all((power <= 0).all() for power in powers.values())


@pytest.mark.filterwarnings("ignore::synctrl.errors.StepWarning")
@pytest.mark.parametrize("zero", ["beta", "K_eps"])
def test_errors_vanish_where_a_gain_of_the_coupling_is_zero_on_one_axis(zero: str) -> None:
    gains = GAINS.replace(K_r=8.0, Lambda=10.0, Gamma=1e-3, **{zero: [0.0, 3.0]})
    run = experiment(coupling("signed graph", 3, 2), gains, gravity=0.0, known=1.0)
    e = np.abs(run.simulate(1.0, 5e-3).tracking_error).max(axis=(1, 2))
    assert e[-1] < 1e-2 * e.max()


# -- redundant arms ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("weight", ["scalar", "moving"])
def test_j_s_q_is_c_inverse_r_at_every_instant_of_a_run_of_redundant_arms(weight: str) -> None:
    run = replay(experiment(coupling("ring", 4, 2, weight), joints=3, cartesian=True).simulate(0.05, 1e-3))
    x = run.rows
    assert x.J.shape[-2:] == (2, 3)
    slip = np.matvec(x.c_inv, x.r)
    np.testing.assert_allclose(np.matvec(x.J, x.s_q), slip, atol=1e-12 * np.abs(slip).max())
    hidden = x.s_q - np.matvec(x.J_inv, slip)
    assert np.abs(hidden).max() > 0.01 * np.abs(x.s_q).max()  # s_q is more than J^-1 c^-1 r, and V has it all


# -- how much gain the coupling adds ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("link", "Lambda", "beta", "most"),
    [(Coupling.ring(4), 10.0, 100.0, 410.0), (Coupling.pair(), 8.0, 8.0, 24.0)],
    ids=["four arms", "two A460"],
)
def test_the_command_has_the_gain_lambda_plus_beta_times_an_eigenvalue_of_s_transposed_s(
    link: Coupling, Lambda: float, beta: float, most: float
) -> None:
    """u - c xd' - c' e = Lambda w + beta sigma while the integral is 0: Lambda alone in common motion."""
    values, modes = np.linalg.eigh(link.matrix.T @ link.matrix)
    for value, w in zip(values, modes.T[:, :, None], strict=True):
        command = Lambda * w + beta * link.distribute(link.compare(w))
        np.testing.assert_allclose(command, (Lambda + beta * value) * w, atol=1e-9)
    assert Lambda + beta * values[-1] == pytest.approx(most)
    assert Lambda + beta * values[0] == pytest.approx(Lambda)


def test_over_the_papers_five_seconds_beta_does_nearly_all_of_the_work() -> None:
    pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")
    made = taken_apart(planar_four())
    law, nothing = next(iter(made)), "none of them"
    tried = (law, nothing, "β", "K_ε", "adaptation", STIFFEST)
    rows = side_by_side({name: made[name] for name in tried}, engine="compiled").rows
    found = {row.law: row.quiet for row in rows}
    rms = {name: sizes.sync_rms / found[nothing].sync_rms for name, sizes in found.items()}
    assert rms["β"] == pytest.approx(0.034, abs=5e-4)
    assert found["β"].sync_peak / found[nothing].sync_peak == pytest.approx(0.086, abs=5e-4)
    assert rms["K_ε"] == pytest.approx(0.90, abs=5e-3)
    assert rms["adaptation"] == pytest.approx(0.98, abs=5e-3)
    assert rms[STIFFEST] == pytest.approx(rms[law], rel=0.05)
    for size in ("sync_peak", "tracking_rms", "tracking_peak"):
        assert getattr(found[STIFFEST], size) < getattr(found[law], size)
    assert found[STIFFEST].peak_torque == pytest.approx(8 * found[law].peak_torque, rel=0.05)
